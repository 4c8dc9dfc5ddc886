//! What goes over the wire between the xArm's controller and its clients: frames, requests, replies, pushed feedback,
//! reports, tool IO, and what error codes mean.
//!
//! It is *not* a driver and no controller: there is no socket, no clock and no thread here. Bytes come in, values come
//! out, and the other way round; both `xarm_tcp` (the driver) and the simulated controller speak through it.
//!
//! Units are those of the wire: millimetres, radians, seconds, kilograms. Drivers convert at their edge. Floats are little
//! endian, everything else big endian unless said otherwise; the layouts depend on the controller's [`Firmware`].
//!
//! ```
//! use xarm_protocol::{FrameReader, Protocol, Request};
//!
//! let frame = Request::ServoJoint { angles: [0.1; 7], speed: 0.0, acceleration: 0.0, time: 0.0 }.frame(7, Protocol::Private);
//! let mut reader = FrameReader::default();
//! reader.push(&frame.encode());
//! let received = reader.next()?.expect("a whole frame was pushed");
//! assert_eq!(Request::decode(received.register(), received.parameters())?.register(), 29);
//! # Ok::<(), xarm_protocol::ProtocolError>(())
//! ```

mod bytes;
mod error;
mod faults;
mod feedback;
mod firmware;
mod frame;
mod identity;
mod modes;
pub mod register;
mod reply;
pub mod report;
mod request;
mod request_decode;
mod request_encode;
mod tool_io;

pub use error::ProtocolError;
pub use faults::{
    Fault, Recovery, controller_error, controller_errors, markdown_table, servo_error, servo_errors, warning, warnings,
};
pub use feedback::{Feedback, FeedbackKind, FeedbackResult};
pub use firmware::Firmware;
pub use frame::{Frame, FrameReader, HEARTBEAT, Protocol, Transactions};
pub use identity::{Generation, Identity, JointRange};
pub use modes::{Mode, State, StateCommand};
pub use reply::{Reply, Status};
pub use report::{Report, ReportKind, ReportReader};
pub use request::{KEEP, MoveCircle, MoveCircleOptions, MoveJoint, MoveLine, MoveLineOptions, Request};
pub use tool_io::{TOOL_HOST, VacuumHardware, tool_address};
