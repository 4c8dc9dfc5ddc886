//! `test`: everything that must hold before a change is good, with one summary at the end.

mod counts;
mod stages;

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::Result;

use crate::process;
use crate::repository::Repository;
use crate::setup;
use counts::Counts;
use stages::{Kind, Stage};

/// What became of one stage.
struct Outcome {
    name: &'static str,
    took: Duration,
    failure: Option<String>,
    tests: Option<(Kind, Counts)>,
    fatal: bool,
}

pub(crate) fn run(repository: &Repository) -> Result<ExitCode> {
    let begun = Instant::now();
    setup::ensure(repository)?;
    let mut outcomes = Vec::new();
    let mut skipped = Vec::new();
    for stage in stages::all(repository)? {
        if outcomes.last().is_some_and(|last: &Outcome| last.fatal) || !skipped.is_empty() {
            skipped.push(stage.name);
        } else {
            outcomes.push(perform(stage)?);
        }
    }
    print!("{}", summary(&outcomes, &skipped, begun.elapsed()));
    let good = outcomes.iter().all(|outcome| outcome.failure.is_none());
    Ok(if good { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn perform(mut stage: Stage) -> Result<Outcome> {
    println!("\n==> {}: {}", stage.name, process::describe(&stage.command));
    let begun = Instant::now();
    let watched = process::watch(&mut stage.command)?;
    let took = begun.elapsed();
    let tests = stage.tests.map(|tests| (tests.kind, (tests.count)(&watched.output)));
    let code = watched.status.code().unwrap_or(-1);
    let failure = judge(watched.status.success(), code, tests);
    let fatal = failure.is_some() && (stage.is_fatal)(code, &watched.output);
    println!(
        "==> {}: {} in {:.1} s",
        stage.name,
        if failure.is_some() { "FAILED" } else { "ok" },
        took.as_secs_f64()
    );
    Ok(Outcome {
        name: stage.name,
        took,
        failure,
        tests,
        fatal,
    })
}

/// Why a stage failed. A runner that succeeds without running a test has tested nothing; only a workspace without
/// documentation examples is in order.
fn judge(success: bool, code: i32, tests: Option<(Kind, Counts)>) -> Option<String> {
    match tests {
        _ if !success && tests.is_none() => Some(format!("exit code {code}")),
        Some((_, counts)) if !success => Some(format!("exit code {code}, {} failed", counts.failed)),
        Some((Kind::Rust | Kind::Rclpy, counts)) if counts.ran() == 0 => Some("ran no test".to_owned()),
        _ => None,
    }
}

fn summary(outcomes: &[Outcome], skipped: &[&str], took: Duration) -> String {
    let mut lines = vec![String::new(), "==> summary".to_owned()];
    for outcome in outcomes {
        let verdict = outcome
            .failure
            .as_ref()
            .map_or("ok".to_owned(), |failure| format!("FAILED: {failure}"));
        lines.push(format!(
            "{:>8.1} s  {:<30} {verdict}",
            outcome.took.as_secs_f64(),
            outcome.name
        ));
    }
    lines.extend(
        skipped
            .iter()
            .map(|name| format!("         -  {name:<30} not run: it cannot compile")),
    );
    let count = |kind: Kind| total(outcomes, |candidate| candidate == kind);
    lines.push(format!("Rust tests:  {}", count(Kind::Rust)));
    lines.push(format!("doc tests:   {}", count(Kind::Documentation)));
    lines.push(format!("rclpy tests: {}", count(Kind::Rclpy)));
    lines.push(format!("total time:  {:.0} s", took.as_secs_f64()));
    let mut all = total(outcomes, |_| true);
    // A stage without tests that fails, or a runner that dies before counting, must not read as success either.
    all.failed += outcomes.iter().filter(|outcome| is_uncounted_failure(outcome)).count();
    lines.push(format!("{all}\n"));
    lines.join("\n")
}

fn is_uncounted_failure(outcome: &Outcome) -> bool {
    outcome.failure.is_some() && outcome.tests.is_none_or(|(_, counts)| counts.failed == 0)
}

fn total(outcomes: &[Outcome], wanted: impl Fn(Kind) -> bool) -> Counts {
    let mut sum = Counts::default();
    for (_, counts) in outcomes
        .iter()
        .filter_map(|outcome| outcome.tests)
        .filter(|(kind, _)| wanted(*kind))
    {
        sum += counts;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counts(passed: usize, failed: usize) -> Counts {
        Counts {
            passed,
            failed,
            skipped: 0,
        }
    }

    fn outcome(name: &'static str, success: bool, tests: Option<(Kind, Counts)>) -> Outcome {
        Outcome {
            name,
            took: Duration::from_secs(1),
            failure: judge(success, 1, tests),
            tests,
            fatal: false,
        }
    }

    fn last_line(outcomes: &[Outcome]) -> String {
        summary(outcomes, &[], Duration::from_secs(9))
            .lines()
            .last()
            .unwrap()
            .to_owned()
    }

    #[test]
    fn the_last_line_adds_up_every_kind_of_test() {
        let outcomes = [
            outcome("format", true, None),
            outcome("Rust tests", true, Some((Kind::Rust, counts(40, 0)))),
            outcome("doc tests", true, Some((Kind::Documentation, counts(2, 0)))),
            outcome("rclpy tests", false, Some((Kind::Rclpy, counts(7, 1)))),
        ];
        assert_eq!(last_line(&outcomes), "49 passed, 1 failed");
    }

    #[test]
    fn a_failed_check_counts_as_one_failure() {
        let outcomes = [
            outcome("lints", false, None),
            outcome("Rust tests", true, Some((Kind::Rust, counts(3, 0)))),
        ];
        assert_eq!(last_line(&outcomes), "3 passed, 1 failed");
    }

    #[test]
    fn a_runner_that_ran_nothing_has_failed() {
        assert_eq!(
            judge(true, 0, Some((Kind::Rclpy, counts(0, 0)))).as_deref(),
            Some("ran no test")
        );
        assert_eq!(judge(true, 0, Some((Kind::Documentation, counts(0, 0)))), None);
        assert_eq!(judge(true, 0, None), None);
    }

    #[test]
    fn stages_that_were_not_run_are_named() {
        let text = summary(&[outcome("lints", false, None)], &["rclpy tests"], Duration::ZERO);
        assert!(text.contains("rclpy tests                    not run"), "{text}");
    }
}
