//! The probe's action. A goal's `target` says what becomes of it:
//!
//! | target | |
//! |---|---|
//! | `reject` | not accepted |
//! | `abort` | aborted after the last step |
//! | `drop` | dropped without a result after the first step |
//! | `hang` | steps for ever, until it is cancelled |
//! | anything else | succeeds after the last step |

use std::time::Duration;

use interfaces::rakelight_msgs::action::{PickCycle, PickCycleFeedback, PickCycleResult};
use ros::{ActionServer, ActiveGoal};
use tokio::time::sleep;

use crate::Options;

pub(crate) async fn serve(mut server: ActionServer<PickCycle>, options: &Options) -> anyhow::Result<()> {
    while let Some(offer) = server.next().await {
        if offer.goal().target == "reject" {
            offer.reject().await?;
            continue;
        }
        println!("goal {}", offer.goal().target);
        let goal = offer.accept().await?;
        let (steps, pause) = (options.steps, Duration::from_millis(options.step_millis));
        tokio::spawn(async move {
            if let Err(error) = execute(goal, steps, pause).await {
                tracing::error!(%error, "a goal failed");
            }
        });
    }
    Ok(())
}

async fn execute(goal: ActiveGoal<PickCycle>, steps: u32, pause: Duration) -> Result<(), ros::Error> {
    let target = goal.goal().target.clone();
    let last = if target == "hang" { u32::MAX } else { steps };
    for step in 1..=last {
        tokio::select! {
            () = goal.cancel_requested() => {
                return goal.canceled(result(false, format!("{target} cancelled before step {step}")));
            }
            () = sleep(pause) => {}
        }
        goal.feedback(PickCycleFeedback {
            detail: format!("{target}: step {step} of {steps}"),
            progress: step as f32 / steps as f32,
            capture_id: target.clone(),
            ..PickCycleFeedback::default()
        })?;
        if target == "drop" {
            return Ok(());
        }
    }
    match target.as_str() {
        "abort" => goal.abort(result(false, "asked to abort".to_owned())),
        _ => goal.succeed(PickCycleResult {
            capture_id: target,
            ..result(true, String::new())
        }),
    }
}

fn result(success: bool, reason: String) -> PickCycleResult {
    PickCycleResult {
        success,
        reason,
        ..PickCycleResult::default()
    }
}
