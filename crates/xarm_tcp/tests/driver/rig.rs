//! A controller and a driver that is connected to it.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use devices::{Arm, ArmCondition, ArmLink, ArmState, JointValues, SetPointStream, StreamFault};
use sim::arm::{ArmConfig, ArmController};
use xarm_tcp::{XArm, XArmConfig};

pub(crate) const PATIENCE: Duration = Duration::from_secs(10);
pub(crate) const PERIOD: Duration = Duration::from_millis(4);
/// Where the simulated arm stands, radians.
pub(crate) const HOME: JointValues = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

pub(crate) struct Rig {
    pub(crate) arm: XArm,
    pub(crate) controller: ArmController,
}

pub(crate) fn start(config: ArmConfig) -> ArmController {
    ArmController::start(config).expect("ports are free")
}

/// For a controller on this host.
pub(crate) fn driver_config(controller: &ArmController) -> XArmConfig {
    let ports = controller.ports();
    XArmConfig {
        control_port: ports.control,
        real_time_report_port: ports.real,
        rich_report_port: ports.rich,
        ..XArmConfig::new(controller.address().to_string())
    }
}

impl Rig {
    pub(crate) async fn connected() -> Self {
        Self::with(ArmConfig::default(), |_| {}).await
    }

    pub(crate) async fn with(config: ArmConfig, change: impl FnOnce(&mut XArmConfig)) -> Self {
        let controller = start(config);
        let mut config = driver_config(&controller);
        change(&mut config);
        let rig = Self {
            arm: XArm::open(config),
            controller,
        };
        rig.wait_for(is_connected).await;
        rig
    }

    pub(crate) async fn wait_for(&self, wanted: impl FnMut(&ArmState) -> bool) -> ArmState {
        wait_for(&self.arm, wanted).await
    }

    pub(crate) async fn wait_for_condition(&self, wanted: ArmCondition) -> ArmState {
        self.wait_for(|state| state.condition == wanted).await
    }

    pub(crate) async fn armed(&self) -> Box<dyn SetPointStream> {
        self.arm.arm().await.expect("it can be armed")
    }
}

pub(crate) async fn wait_for(arm: &XArm, wanted: impl FnMut(&ArmState) -> bool) -> ArmState {
    let mut state = arm.state();
    let waited = tokio::time::timeout(PATIENCE, state.wait_for(wanted)).await;
    if let Ok(Ok(state)) = waited {
        return state.clone();
    }
    panic!("it did not come about; the arm is {:?}", *arm.state().borrow());
}

pub(crate) fn is_connected(state: &ArmState) -> bool {
    matches!(state.link, ArmLink::Connected { .. })
}

pub(crate) fn lost_reason(state: &ArmState) -> Option<&str> {
    match &state.link {
        ArmLink::Disconnected { reason } => Some(reason),
        ArmLink::Connected { .. } => None,
    }
}

/// Swings joint 7 from where the arm stands: 0.2 rad there and back within a second, begun at rest.
pub(crate) fn swing(time: f64) -> JointValues {
    let mut angles = HOME;
    angles[6] += 0.1 * (1.0 - (TAU * time).cos());
    angles
}

/// Largest speed of [`swing`], rad/s.
pub(crate) const SWING_SPEED: f64 = 0.1 * TAU;

/// A thread that sends set-points every 4 ms, as a real-time thread would.
pub(crate) struct Sender(tokio::task::JoinHandle<Sent>);

/// What became of it.
pub(crate) struct Sent {
    pub(crate) count: usize,
    pub(crate) fault: Option<StreamFault>,
    pub(crate) ended_at: Instant,
}

impl Sender {
    /// For so long, or until the stream ends.
    pub(crate) fn start(mut stream: Box<dyn SetPointStream>, time: Duration) -> Self {
        Self(tokio::task::spawn_blocking(move || {
            let start = Instant::now();
            let (mut count, mut fault) = (0, None);
            while PERIOD * count < time {
                if let Err(error) = stream.send(&swing((PERIOD * count).as_secs_f64())) {
                    fault = Some(error);
                    break;
                }
                count += 1;
                std::thread::sleep((start + PERIOD * count).saturating_duration_since(Instant::now()));
            }
            let count = count as usize;
            let ended_at = Instant::now();
            Sent { count, fault, ended_at }
        }))
    }

    pub(crate) async fn end(self) -> Sent {
        let ended = tokio::time::timeout(PATIENCE, self.0).await;
        ended.expect("it ends").expect("it does not panic")
    }
}
