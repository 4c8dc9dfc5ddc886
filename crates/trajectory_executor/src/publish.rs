//! What the node tells: `joint_states`, `arm/state`, the arm's frames and its description.

mod frames;
mod state;

use std::sync::Arc;
use std::time::Duration;

use devices::{ArmState, JointReading, Suction, SuctionState};
use interfaces::rakelight_msgs::msg::ArmState as ArmStateMessage;
use interfaces::sensor_msgs::msg::JointState;
use interfaces::std_msgs::msg::{Header, String as StringMessage};
use ros::tf::{Broadcaster, StaticBroadcaster};
use ros::{Node, Publisher, Qos};
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;
use tracing::Instrument;

use crate::error::Error;
use crate::executor::Executor;
use crate::parameters::Parameters;
use frames::Frames;

/// Of `joint_states` and the moving frames.
const JOINTS: Duration = Duration::from_millis(10);
/// Of `arm/state`, between changes.
const STATE: Duration = Duration::from_millis(200);

pub(crate) struct Publishers {
    node: Node,
    joints: Publisher<JointState>,
    state: Publisher<ArmStateMessage>,
    moving: Broadcaster,
    executor: Arc<Executor>,
    suction: Arc<dyn Suction>,
    base: String,
    frames: Frames,
    // Latched: they are told to who comes later for as long as these live.
    _description: Publisher<StringMessage>,
    _fixed: StaticBroadcaster,
}

impl Publishers {
    pub(crate) fn new(
        node: &Node,
        parameters: &Parameters,
        executor: Arc<Executor>,
        suction: Arc<dyn Suction>,
    ) -> Result<Self, Error> {
        let model = executor.model();
        let description = node.publisher("/robot_description", Qos::LATCHED)?;
        description.publish(StringMessage {
            data: model.description.clone(),
        })?;
        let frames = Frames::of(&model.robot, &parameters.base_frame_id, &parameters.frames_from_others);
        let fixed = StaticBroadcaster::new(node)?;
        fixed.send(&frames.fixed())?;
        Ok(Self {
            joints: node.publisher("joint_states", Qos::STREAM)?,
            state: node.publisher("arm/state", Qos::STREAM)?,
            moving: Broadcaster::new(node)?,
            node: node.clone(),
            base: parameters.base_frame_id.clone(),
            executor,
            suction,
            frames,
            _description: description,
            _fixed: fixed,
        })
    }

    pub(crate) fn spawn_into(self, tasks: &mut JoinSet<()>) {
        let publishers = Arc::new(self);
        tasks.spawn(Arc::clone(&publishers).tell_joints().in_current_span());
        tasks.spawn(publishers.tell_state().in_current_span());
    }

    /// Every 10 ms, if something new was measured.
    async fn tell_joints(self: Arc<Self>) {
        let mut ticks = interval(JOINTS);
        let mut last = None;
        loop {
            ticks.tick().await;
            let state = self.executor.arm_state();
            let Some(joints) = state.borrow().joints else {
                continue;
            };
            if last.replace(joints.received_at) != Some(joints.received_at) {
                self.send_joints(&joints);
            }
        }
    }

    fn send_joints(&self, joints: &JointReading) {
        let model = self.executor.model();
        let age = joints.received_at.elapsed().as_nanos() as i64;
        let stamp = self.node.clock().now_nanos() - age;
        let message = JointState {
            header: Header {
                stamp: interfaces::builtin_interfaces::msg::Time::from_nanos(stamp).unwrap_or_default(),
                frame_id: self.base.clone(),
            },
            name: model.chain.joints().iter().map(|joint| joint.name.clone()).collect(),
            position: joints.angles.to_vec(),
            velocity: joints.velocities.to_vec(),
            effort: joints.torques.to_vec(),
        };
        let moving = self.frames.moving(&model.chain, &joints.angles, stamp);
        for lost in [self.joints.publish(message), self.moving.send(&moving)]
            .into_iter()
            .filter_map(Result::err)
        {
            tracing::warn!(error = %lost, "a state of the joints is lost");
        }
    }

    /// On every change, and five times a second.
    async fn tell_state(self: Arc<Self>) {
        let mut ticks = interval(STATE);
        let mut standing = self.executor.standing();
        let mut vacuum = SuctionState::default();
        loop {
            tokio::select! {
                _ = ticks.tick() => vacuum = self.read_vacuum().await,
                changed = standing.changed() => if changed.is_err() { return },
            }
            let arm: ArmState = self.executor.arm_state().borrow().clone();
            let mut message = state::message(&self.executor, &standing.borrow_and_update().clone(), &arm, vacuum);
            message.header = Header {
                stamp: self.node.clock().now(),
                frame_id: self.base.clone(),
            };
            if let Err(error) = self.state.publish(message) {
                tracing::warn!(%error, "a state of the arm is lost");
            }
        }
    }

    /// A controller that does not answer holds nothing as far as anybody knows.
    async fn read_vacuum(&self) -> SuctionState {
        let is_there = matches!(
            self.executor.arm_state().borrow().link,
            devices::ArmLink::Connected { .. }
        );
        if !is_there {
            return SuctionState::default();
        }
        let read = tokio::time::timeout(STATE, self.suction.read()).await;
        read.ok().and_then(Result::ok).unwrap_or_default()
    }
}

fn interval(period: Duration) -> tokio::time::Interval {
    let mut ticks = tokio::time::interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}
