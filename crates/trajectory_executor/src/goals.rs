//! What the actions that move the arm have in common.

use std::future::Future;
use std::time::Duration;

use interfaces::Action;
use ros::{ActionServer, ActiveGoal};
use tokio::task::JoinSet;
use tokio::time::MissedTickBehavior;
use tracing::Instrument;

use crate::error::MotionError;
use crate::executor::{Executor, Running};

/// Feedback is for people and progress bars.
const FEEDBACK: Duration = Duration::from_millis(50);

/// Runs every goal in a task of its own, until the node is shut down: one that comes while another runs is told so.
pub(crate) async fn serve<A: Action, F>(mut server: ActionServer<A>, run: impl Fn(ActiveGoal<A>) -> F)
where
    F: Future<Output = ()> + Send + 'static,
{
    let mut goals = JoinSet::new();
    while let Some(offer) = server.next().await {
        while goals.try_join_next().is_some() {}
        match offer.accept().await {
            Ok(goal) => {
                goals.spawn(run(goal).in_current_span());
            }
            Err(error) => tracing::warn!(%error, "a goal is lost"),
        }
    }
}

/// Waits for the end of a goal's motion, which a cancel brings about earlier; tells how far it is meanwhile.
pub(crate) async fn follow<A: Action>(
    executor: &Executor,
    goal: &ActiveGoal<A>,
    mut running: Running,
    tell: impl Fn(&Running),
) -> Result<(), MotionError> {
    let mut ticks = tokio::time::interval(FEEDBACK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut cancelled = false;
    loop {
        tokio::select! {
            ending = running.ended() => return ending,
            () = goal.cancel_requested(), if !cancelled => {
                cancelled = true;
                executor.cancel();
            }
            _ = ticks.tick() => tell(&running),
        }
    }
}
