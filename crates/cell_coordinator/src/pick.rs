//! The service `pick` and the action `pick_cycle`.

use std::sync::Arc;

use interfaces::rakelight_msgs::action::{PickCycle, PickCycleFeedback, PickCycleGoal, PickCycleResult};
use interfaces::rakelight_msgs::msg::{Grasp, StageTiming};
use interfaces::std_srvs::srv::{Trigger, TriggerResponse};
use ros::{ActionServer, ActiveGoal, ServiceCall, ServiceServer};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use tracing::Instrument;

use crate::convert;
use crate::cycle::{Kind, Mode, Outcome, View};
use crate::desk::{Answer, Desk, Wish};
use crate::hands::Wanted;

/// Answers every call in a task of its own, so that one that comes while a cycle runs is refused at once.
pub(crate) async fn serve_service(mut server: ServiceServer<Trigger>, desk: Arc<Desk>) {
    let mut calls = JoinSet::new();
    while let Some(call) = server.next().await {
        while calls.try_join_next().is_some() {}
        calls.spawn(answer(call, Arc::clone(&desk)).in_current_span());
    }
}

async fn answer(call: ServiceCall<Trigger>, desk: Arc<Desk>) {
    let wish = Wish {
        asker: "the service `pick`",
        modes: desk.parameters.modes(),
        wanted: Wanted::default(),
        dry_run: false,
    };
    let Answer { outcome, .. } = desk.serve(wish, CancellationToken::new(), |_, _| {}).await;
    let response = TriggerResponse {
        success: outcome.kind == Kind::Succeeded,
        message: outcome.reason,
    };
    if let Err(error) = call.respond(response).await {
        tracing::warn!(%error, "an answer is lost");
    }
}

pub(crate) async fn serve_action(mut server: ActionServer<PickCycle>, desk: Arc<Desk>) {
    let mut goals = JoinSet::new();
    while let Some(offer) = server.next().await {
        while goals.try_join_next().is_some() {}
        match offer.accept().await {
            Ok(goal) => drop(goals.spawn(run(goal, Arc::clone(&desk)).in_current_span())),
            Err(error) => tracing::warn!(%error, "a goal is lost"),
        }
    }
}

async fn run(goal: ActiveGoal<PickCycle>, desk: Arc<Desk>) {
    let wish = match wish(goal.goal()) {
        Ok(wish) => wish,
        Err(reason) => {
            let result = PickCycleResult {
                reason,
                ..PickCycleResult::default()
            };
            return end(goal, Kind::Failed, result);
        }
    };
    let Answer { outcome, timings } = Box::pin(cycle(&goal, wish, &desk)).await;
    end(goal, outcome.kind, result(outcome, timings));
}

/// To its end, which a cancel brings about earlier.
async fn cycle(goal: &ActiveGoal<PickCycle>, wish: Wish, desk: &Desk) -> Answer {
    let cancel = CancellationToken::new();
    let tell = |view: &View, timings: &[StageTiming]| {
        // Feedback that is lost is followed by the next.
        let _ = goal.feedback(feedback(view, timings));
    };
    let serving = desk.serve(wish, cancel.clone(), tell);
    tokio::pin!(serving);
    tokio::select! {
        answer = &mut serving => answer,
        () = goal.cancel_requested() => {
            cancel.cancel();
            serving.await
        }
    }
}

fn wish(goal: &PickCycleGoal) -> Result<Wish, String> {
    let mode = match goal.mode {
        PickCycleGoal::SOLID => Mode::Solid,
        PickCycleGoal::THIN => Mode::Thin,
        mode => return Err(format!("mode is {mode}, allowed: 0 (SOLID) and 1 (THIN)")),
    };
    Ok(Wish {
        asker: "the action `pick_cycle`",
        modes: vec![mode],
        wanted: Wanted {
            target: goal.target.clone(),
            direction: goal.direction,
        },
        dry_run: goal.dry_run,
    })
}

fn feedback(view: &View, timings: &[StageTiming]) -> PickCycleFeedback {
    PickCycleFeedback {
        stage: view.stage.map_or(0, convert::stage),
        detail: view.detail.clone(),
        progress: view.progress,
        capture_id: view.capture_id.clone(),
        timings: timings.to_vec(),
    }
}

fn result(outcome: Outcome, timings: Vec<StageTiming>) -> PickCycleResult {
    PickCycleResult {
        success: outcome.kind == Kind::Succeeded,
        reason: outcome.reason,
        failed_stage: outcome.failed_stage.map_or(0, convert::stage),
        capture_id: outcome.capture_id,
        grasp: outcome.grasp.unwrap_or_else(no_grasp),
        timings,
    }
}

/// All zero, quaternions too.
fn no_grasp() -> Grasp {
    let mut grasp = Grasp::default();
    for pose in [&mut grasp.pregrasp, &mut grasp.grasp, &mut grasp.retreat] {
        pose.orientation.w = 0.0;
    }
    grasp
}

fn end(goal: ActiveGoal<PickCycle>, kind: Kind, result: PickCycleResult) {
    let told = match kind {
        Kind::Succeeded => goal.succeed(result),
        Kind::Cancelled if goal.is_cancel_requested() => goal.canceled(result),
        _ => goal.abort(result),
    };
    if let Err(error) = told {
        tracing::warn!(%error, "a result is lost");
    }
}
