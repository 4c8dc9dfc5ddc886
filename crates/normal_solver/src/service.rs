//! What others may ask of the node. Captures are solved as their images come; a call waits for that.

use std::time::{Duration, Instant};

use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::rakelight_msgs::msg::{CellState, StageTiming};
use interfaces::rakelight_msgs::srv::{Solve, SolveRequest, SolveResponse};
use ros::parameters::ParameterHandle;
use ros::{Clock, ServiceCall, ServiceServer};
use tokio::task::JoinSet;
use tracing::Instrument;

use crate::captures::{Ask, Captures, Done, Outcome};
use crate::error::Refusal;

/// Who answers `solve`.
#[derive(Clone)]
pub(crate) struct Desk {
    pub(crate) captures: Captures,
    /// All that may take part.
    pub(crate) cameras: Vec<String>,
    pub(crate) solve_timeout: ParameterHandle<f64>,
    pub(crate) clock: Clock,
}

impl Desk {
    /// Answers until the node is shut down; one who waits keeps nobody waiting.
    pub(crate) async fn serve(self, mut server: ServiceServer<Solve>) {
        let mut calls = JoinSet::new();
        while let Some(call) = server.next().await {
            calls.spawn(self.clone().answer(call).in_current_span());
            while calls.try_join_next().is_some() {}
        }
    }

    async fn answer(self, call: ServiceCall<Solve>) {
        let (started, started_at) = (Instant::now(), self.clock.now());
        let outcome = self.outcome(call.request()).await;
        let waited = timing(started_at, started.elapsed());
        let response = response(outcome, !call.request().cameras.is_empty(), waited);
        if let Err(error) = call.respond(response).await {
            tracing::warn!(%error, "an answer is lost");
        }
    }

    async fn outcome(&self, request: &SolveRequest) -> Result<Outcome, Refusal> {
        let ask = Ask::read(request, &self.cameras)?;
        let patience = Duration::from_secs_f64(self.solve_timeout.get());
        self.captures.wait(&ask, &self.cameras, patience).await
    }
}

impl Ask {
    fn read(request: &SolveRequest, known: &[String]) -> Result<Self, Refusal> {
        let mut cameras: Vec<String> = Vec::new();
        for camera in &request.cameras {
            if !known.contains(camera) {
                return Err(Refusal::Camera {
                    found: camera.clone(),
                    known: known.join(", "),
                });
            }
            if !cameras.contains(camera) {
                cameras.push(camera.clone());
            }
        }
        Ok(Self {
            capture_id: request.capture_id.clone(),
            cameras,
        })
    }
}

/// Cameras that were named must all be solved, otherwise one is enough. `waited` is told where nothing was solved.
fn response(outcome: Result<Outcome, Refusal>, are_named: bool, waited: StageTiming) -> SolveResponse {
    let Outcome { id, solved, problems } = match outcome {
        Ok(outcome) => outcome,
        Err(refusal) => {
            return SolveResponse {
                message: refusal.to_string(),
                timing: waited,
                ..SolveResponse::default()
            };
        }
    };
    let success = !solved.is_empty() && (problems.is_empty() || !are_named);
    let notes = solved
        .iter()
        .map(|(_, done)| done.note.clone())
        .filter(|note| !note.is_empty());
    let message = problems.into_iter().chain(notes).collect::<Vec<_>>().join("; ");
    SolveResponse {
        success,
        message: if success {
            message
        } else {
            format!("capture {id:?} is not solved: {message}")
        },
        capture_id: id,
        valid_fractions: solved.iter().map(|(_, done)| done.valid_fraction).collect(),
        timing: StageTiming {
            succeeded: success,
            ..all_of(&solved).unwrap_or(waited)
        },
        cameras: solved.into_iter().map(|(camera, _)| camera).collect(),
    }
}

/// From where the first camera's solving began to where the last one's ended.
fn all_of(solved: &[(String, Done)]) -> Option<StageTiming> {
    let starts = solved.iter().map(|(_, done)| done.started_at);
    let began = starts.min_by_key(|start| start.to_nanos())?;
    let since_then = |(_, done): &(String, Done)| {
        let later = done.started_at.to_nanos() - began.to_nanos();
        Duration::from_nanos(later.unsigned_abs()) + done.took
    };
    let took = solved.iter().map(since_then).max()?;
    Some(timing(began, took))
}

fn timing(started_at: Time, took: Duration) -> StageTiming {
    StageTiming {
        stage: CellState::SOLVE,
        succeeded: false,
        started_at,
        duration: DurationMessage::try_from(took).unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(valid_fraction: f32, nanosec: u32, millis: u64) -> Done {
        Done {
            valid_fraction,
            started_at: Time { sec: 2, nanosec },
            took: Duration::from_millis(millis),
            note: String::new(),
        }
    }

    fn outcome(problems: &[&str]) -> Outcome {
        Outcome {
            id: "a".into(),
            solved: vec![
                ("c2".into(), done(0.5, 0, 100)),
                ("c1".into(), done(0.25, 40_000_000, 90)),
            ],
            problems: problems.iter().map(|problem| (*problem).to_owned()).collect(),
        }
    }

    #[test]
    fn an_answer_says_what_each_camera_gave_and_how_long_both_took() {
        let response = response(Ok(outcome(&[])), true, StageTiming::default());
        assert!(response.success && response.message.is_empty());
        assert_eq!(response.capture_id, "a");
        assert_eq!(response.cameras, ["c2", "c1"]);
        assert_eq!(response.valid_fractions, [0.5, 0.25]);
        let timing = response.timing;
        assert_eq!((timing.stage, timing.succeeded), (CellState::SOLVE, true));
        assert_eq!((timing.started_at.sec, timing.started_at.nanosec), (2, 0));
        assert_eq!((timing.duration.sec, timing.duration.nanosec), (0, 130_000_000));
    }

    #[test]
    fn a_camera_without_normals_spoils_the_answer_only_when_it_was_named() {
        let problem = "c3: light channels [4] are missing";
        let any = response(Ok(outcome(&[problem])), false, StageTiming::default());
        assert!(any.success && any.timing.succeeded);
        assert_eq!((any.message.as_str(), any.cameras.len()), (problem, 2));
        let named = response(Ok(outcome(&[problem])), true, StageTiming::default());
        assert!(!named.success && !named.timing.succeeded);
        assert_eq!(
            named.message,
            "capture \"a\" is not solved: c3: light channels [4] are missing"
        );
        assert_eq!(named.cameras.len(), 2, "what was solved is told all the same");
    }

    #[test]
    fn cameras_that_nobody_solves_are_refused_and_others_taken_once() {
        let known = ["c1".to_owned(), "c2".to_owned()];
        let request = |cameras: &[&str]| SolveRequest {
            cameras: cameras.iter().map(|camera| (*camera).to_owned()).collect(),
            ..SolveRequest::default()
        };
        let ask = Ask::read(&request(&["c2", "c2"]), &known).expect("known");
        assert_eq!(ask.cameras, ["c2"]);
        let refusal = Ask::read(&request(&["c1", "c9"]), &known).expect_err("unknown");
        assert_eq!(
            refusal.to_string(),
            "camera \"c9\" is not one of those solved here: c1, c2"
        );
    }
}
