//! What is heard of the arm.

use std::sync::Arc;
use std::time::Duration;

use interfaces::rakelight_msgs::msg::ArmState;
use interfaces::sensor_msgs::msg::JointState;
use ros::{Node, Qos, Subscription};
use tokio::sync::watch;
use tokio::task::JoinSet;
use tokio::time::{Instant, timeout};
use tracing::Instrument;

use crate::convert;

/// Between where the arm stands and home, radians: captures are taken there.
const HOME_WITHIN: f64 = 0.02;

/// Clones hear the same.
#[derive(Clone)]
pub(crate) struct Arm {
    state: watch::Receiver<Option<Heard<ArmState>>>,
    joints: watch::Receiver<Option<Heard<JointState>>>,
}

/// A message and when it came.
pub(crate) struct Heard<M> {
    pub(crate) message: Arc<M>,
    at: Instant,
}

impl<M> Clone for Heard<M> {
    fn clone(&self) -> Self {
        Self {
            message: Arc::clone(&self.message),
            at: self.at,
        }
    }
}

impl Arm {
    /// Listens until the node is shut down.
    pub(crate) fn listen(node: &Node, tasks: &mut JoinSet<()>) -> Result<Self, ros::Error> {
        Ok(Self {
            state: newest(node.subscription("arm/state", Qos::STREAM)?, tasks),
            joints: newest(node.subscription("joint_states", Qos::SENSOR)?, tasks),
        })
    }

    /// What was heard last, if anything was.
    pub(crate) fn last(&self) -> Option<Arc<ArmState>> {
        self.state.borrow().as_ref().map(|heard| Arc::clone(&heard.message))
    }

    /// Waits for the next state.
    pub(crate) async fn next(&mut self) -> Option<Arc<ArmState>> {
        self.state.changed().await.ok()?;
        let heard = self.state.borrow_and_update().clone();
        heard.map(|heard| heard.message)
    }

    /// A state that is not older than `patience`; waits as long for one.
    pub(crate) async fn fresh(&self, patience: Duration) -> Result<Arc<ArmState>, String> {
        self.wait(patience, |_| true).await
    }

    /// Waits until a fresh state says that the arm takes motions, or why it does not. The state may come a little behind
    /// the end of a motion.
    pub(crate) async fn ready(&self, patience: Duration) -> Result<(), String> {
        let decided = |state: &ArmState| state.mode == ArmState::READY || convert::unfit(state).is_some();
        let state = self.wait(patience, decided).await?;
        convert::unfit(&state).map_or(Ok(()), Err)
    }

    async fn wait(&self, patience: Duration, is_wanted: impl Fn(&ArmState) -> bool) -> Result<Arc<ArmState>, String> {
        let mut state = self.state.clone();
        let wanted = state.wait_for(|heard| {
            heard
                .as_ref()
                .is_some_and(|heard| heard.at.elapsed() <= patience && is_wanted(&heard.message))
        });
        if let Ok(Ok(heard)) = timeout(patience, wanted).await
            && let Some(heard) = &*heard
        {
            return Ok(Arc::clone(&heard.message));
        }
        Err(self.complaint(patience))
    }

    fn complaint(&self, patience: Duration) -> String {
        let patience = patience.as_secs_f64();
        match &*self.state.borrow() {
            None => "nothing was heard of the arm (arm/state)".into(),
            Some(heard) if heard.at.elapsed().as_secs_f64() > patience => format!(
                "the last arm/state is {:.1} s old, allowed are {patience} s (arm_state_timeout)",
                heard.at.elapsed().as_secs_f64()
            ),
            Some(_) => format!("the arm is still busy after {patience} s (arm/state)"),
        }
    }

    /// Whether the arm stands at `home` (radians), by what is heard from now on; an error when that is nothing within
    /// `patience`.
    pub(crate) async fn is_at(&self, home: &[f64], patience: Duration) -> Result<bool, String> {
        let mut joints = self.joints.clone();
        joints.mark_unchanged();
        match timeout(patience, joints.changed()).await {
            Ok(Ok(())) => Ok(joints
                .borrow()
                .as_ref()
                .is_some_and(|heard| is_at(&heard.message.position, home))),
            _ => Err("where the arm stands is not known (joint_states)".into()),
        }
    }
}

fn is_at(position: &[f64], home: &[f64]) -> bool {
    position.len() == home.len()
        && position
            .iter()
            .zip(home)
            .all(|(at, home)| (at - home).abs() <= HOME_WITHIN)
}

fn newest<M: interfaces::Message>(
    mut subscription: Subscription<M>,
    tasks: &mut JoinSet<()>,
) -> watch::Receiver<Option<Heard<M>>> {
    let (newest, receiver) = watch::channel(None);
    let listen = async move {
        while let Some(received) = subscription.next().await {
            newest.send_replace(Some(Heard {
                message: received.message,
                at: Instant::now(),
            }));
        }
    };
    tasks.spawn(listen.in_current_span());
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn home_is_where_every_joint_is() {
        let home = [0.1; 7];
        assert!(is_at(&[0.11; 7], &home));
        assert!(!is_at(&[0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.13], &home));
        assert!(!is_at(&[0.1; 6], &home) && !is_at(&[f64::NAN; 7], &home));
    }
}
