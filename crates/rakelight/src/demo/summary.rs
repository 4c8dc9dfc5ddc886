//! What is told at the end of the demo.

use std::fmt::Write;
use std::path::PathBuf;

use serde::Deserialize;

use super::tour::Replay;

/// Robot time of a pick of the published system, seconds.
const PUBLISHED_ROBOT: f64 = 20.0;

/// What came of everything.
pub(super) struct Outcome {
    /// Of `rakelight pick --json`.
    pub(super) lines: Vec<serde_json::Value>,
    pub(super) replays: Vec<Replay>,
    pub(super) folder: PathBuf,
    /// Since the start.
    pub(super) seconds: f64,
}

/// A pick as its command tells it.
#[derive(Debug, Deserialize)]
struct Pick {
    success: bool,
    reason: String,
    stages: Vec<Stage>,
}

#[derive(Debug, Deserialize)]
struct Stage {
    stage: String,
    seconds: f64,
}

pub(super) fn text(outcome: &Outcome) -> String {
    let picks: Vec<Pick> = outcome
        .lines
        .iter()
        .filter_map(|line| Pick::deserialize(line).ok())
        .collect();
    let done = picks.iter().filter(|pick| pick.success).count();
    let same = outcome.replays.iter().filter(|replay| replay.same).count();
    // Writing to a String cannot fail.
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{done} of {} in the bin, {same} of {} recordings replayed to the same results; {:.0} s in all",
        picks.len(),
        outcome.replays.len(),
        outcome.seconds
    );
    for (index, pick) in picks.iter().enumerate().filter(|(_, pick)| !pick.success) {
        let _ = writeln!(text, "  pick {}: {}", index + 1, pick.reason);
    }
    let _ = writeln!(text, "\n  stage      seconds a pick   published system");
    for stage in ["capture", "solve", "plan", "execute"] {
        let published = match stage {
            "execute" => format!("{PUBLISHED_ROBOT:.0} s of robot time"),
            _ => "-".to_owned(),
        };
        let _ = writeln!(text, "  {stage:<10} {:>14}   {published}", mean(&picks, stage));
    }
    let _ = writeln!(text, "  (with the second capture that shows that the object is gone)\n");
    for replay in &outcome.replays {
        let _ = writeln!(
            text,
            "  pictures of {}: {}",
            replay.bag.display(),
            replay.pictures.display()
        );
    }
    let _ = write!(
        text,
        "\nNext: `rakelight up` in one terminal and `rakelight pick` in another; README.md, \"Operators\", has the rest.\n\
         Everything of this run is in {}",
        outcome.folder.display()
    );
    text
}

/// All attempts of a pick count.
fn mean(picks: &[Pick], name: &str) -> String {
    if picks.is_empty() {
        return "-".into();
    }
    let stages = picks.iter().flat_map(|pick| &pick.stages);
    let seconds: f64 = stages
        .filter(|stage| stage.stage == name)
        .map(|stage| stage.seconds)
        .sum();
    format!("{:.2}", seconds / picks.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_means_and_what_was_missed_says_why() {
        let line = |success, execute| {
            let stages = [("plan", 0.1), ("execute", execute)];
            let stages = stages.map(|(stage, seconds)| serde_json::json!({"stage": stage, "seconds": seconds}));
            serde_json::json!({"success": success, "reason": "no seal", "stages": stages})
        };
        let outcome = Outcome {
            lines: vec![line(true, 4.0), line(false, 6.0)],
            replays: vec![Replay {
                bag: "bags/cycle_1".into(),
                pictures: "pictures/cycle_1".into(),
                same: true,
            }],
            folder: "demo_output/run_1".into(),
            seconds: 61.4,
        };
        let text = text(&outcome);
        for part in [
            "1 of 2 in the bin, 1 of 1 recordings",
            "pick 2: no seal",
            "5.00   20 s of robot time",
            "pictures/cycle_1",
            "61 s in all",
        ] {
            assert!(text.contains(part), "{part:?} is missing in {text}");
        }
    }
}
