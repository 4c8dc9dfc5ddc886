//! Actions: goals that take a while, tell how far they are, and can be cancelled.
//!
//! An action is three services and two topics below its name; all of it is built from this crate's own services and
//! topics. What it adds:
//!
//! - **Goals are kept apart by id.** One task per server takes every cancel and every request for a result and looks
//!   the goal up; one task per client takes all feedback and hands it to the goal that it is for.
//! - **Every goal ends.** An [`ActiveGoal`] that is dropped without a result is aborted; an offer that is dropped is
//!   rejected; a client whose server goes away is told so. Every wait has a limit.
//! - **Everything is bounded**: goals at once, results kept and for how long, callers that wait for a result, feedback
//!   that nobody takes.
//!
//! ```no_run
//! # use std::time::Duration;
//! # use interfaces::rakelight_msgs::action::{PickCycle, PickCycleFeedback, PickCycleGoal, PickCycleResult};
//! # async fn serve(node: ros::Node) -> Result<(), ros::Error> {
//! let mut server = node.action_server::<PickCycle>("pick_cycle")?;
//! while let Some(offer) = server.next().await {
//!     let goal = offer.accept().await?;
//!     goal.feedback(PickCycleFeedback { progress: 0.5, ..PickCycleFeedback::default() })?;
//!     if goal.is_cancel_requested() {
//!         goal.canceled(PickCycleResult::default())?;
//!     } else {
//!         goal.succeed(PickCycleResult { success: true, ..PickCycleResult::default() })?;
//!     }
//! }
//! # Ok(())
//! # }
//! # async fn ask(node: ros::Node) -> Result<(), ros::Error> {
//! let client = node.action_client::<PickCycle>("pick_cycle")?;
//! let mut goal = client.send_goal(PickCycleGoal::default(), Duration::from_secs(5)).await?;
//! while let Some(feedback) = goal.feedback().await {
//!     println!("{:.0} %", feedback.progress * 100.0);
//! }
//! let (status, result) = goal.result(Duration::from_secs(60)).await?;
//! println!("{status:?}: {}", result.reason);
//! # Ok(())
//! # }
//! ```

mod book;
mod client;
mod feedback;
mod goal;
mod server;
mod wire;

pub use client::{ActionClient, GoalHandle};
pub use goal::{GoalEvent, GoalId, GoalStatus};
pub use server::{ActionServer, ActiveGoal, GoalOffer};

/// Names of an action's services and topics.
struct Names {
    send_goal: String,
    cancel_goal: String,
    get_result: String,
    feedback: String,
    status: String,
}

impl Names {
    fn of(action: &str) -> Self {
        let below = |part: &str| format!("{action}/_action/{part}");
        Self {
            send_goal: below("send_goal"),
            cancel_goal: below("cancel_goal"),
            get_result: below("get_result"),
            feedback: below("feedback"),
            status: below("status"),
        }
    }
}
