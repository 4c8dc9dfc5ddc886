//! What the cell expects of its lights, cameras, arm and cup, whoever drives them.
//!
//! Small traits, [`LightBank`], [`Camera`], [`Arm`] with its [`SetPointStream`] and [`Suction`], and the values that pass
//! through them. Drivers implement them (`light_serial`, `camera_aravis`, `xarm_tcp`); nodes use them and so know neither
//! serial ports nor GenICam nor the arm's controller. There is no
//! wire protocol here, no ROS, and no device.
//!
//! Times that drivers report are [`std::time::Instant`]s of this host; what a camera's own clock says is a
//! [`Duration`](std::time::Duration) since that clock's zero, good for differences only.

mod arm;
mod camera;
mod light_bank;
mod lights;

pub use arm::{
    ARM_JOINTS, Arm, ArmCondition, ArmError, ArmFault, ArmLink, ArmState, FaultRecovery, JointReading, JointValues,
    SetPointStream, StreamFault, Suction, SuctionState,
};
pub use camera::{
    AppliedSettings, Binning, Camera, CameraError, CameraIdentity, CameraLink, CameraSettings, Frame, FrameEvent,
    FrameFault, Frames, Region, TriggerMode,
};
pub use light_bank::{LightBank, LightBankState, LightError, LightLink, LightMode, SequenceReport, TimedStep};
pub use lights::{Channel, LightSequence, LightStep, PANEL_COUNT, PanelSet};
