//! What the driver's task tells everybody.

use devices::{ArmCondition, ArmError, ArmLink, ArmState, JointReading};
use parking_lot::Mutex;
use tokio::sync::watch;

use crate::greeting::Link;
use crate::statistics::ArmStatistics;

#[derive(Debug)]
pub(crate) struct Shared {
    state: watch::Sender<ArmState>,
    link: Mutex<Result<Link, String>>,
    statistics: Mutex<ArmStatistics>,
}

impl Shared {
    pub(crate) fn new(reason: String) -> Self {
        Self {
            state: watch::Sender::new(ArmState {
                link: ArmLink::Disconnected { reason: reason.clone() },
                condition: ArmCondition::Unknown,
                joints: None,
            }),
            link: Mutex::new(Err(reason)),
            statistics: Mutex::default(),
        }
    }

    pub(crate) fn subscribe(&self) -> watch::Receiver<ArmState> {
        self.state.subscribe()
    }

    pub(crate) fn statistics(&self) -> ArmStatistics {
        self.statistics.lock().clone()
    }

    pub(crate) fn count(&self, change: impl FnOnce(&mut ArmStatistics)) {
        change(&mut self.statistics.lock());
    }

    /// The condition stays where there is none.
    pub(crate) fn tell(&self, link: ArmLink, condition: Option<ArmCondition>, joints: Option<JointReading>) {
        self.state.send_modify(|state| {
            state.link = link;
            state.condition = condition.unwrap_or_else(|| state.condition.clone());
            // A reading outlives the connection that it came by.
            state.joints = joints.or(state.joints);
        });
    }

    /// The controller, for those who do not move the arm.
    pub(crate) fn link(&self) -> Result<Link, ArmError> {
        let link = self.link.lock().clone();
        link.map_err(|reason| ArmError::Disconnected { reason })
    }

    pub(crate) fn connect(&self, link: Link) {
        *self.link.lock() = Ok(link);
        self.count(|statistics| statistics.connections += 1);
    }

    /// The last that was measured stays.
    pub(crate) fn disconnect(&self, reason: String) {
        *self.link.lock() = Err(reason.clone());
        self.count(|statistics| statistics.last_fault = Some(reason.clone()));
        self.state.send_modify(|state| {
            state.link = ArmLink::Disconnected { reason };
            state.condition = ArmCondition::Unknown;
        });
    }
}
