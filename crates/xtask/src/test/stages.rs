//! The stages of `test`, as commands.

use std::process::Command;

use anyhow::Result;

use super::counts::Counts;
use crate::process::cargo;
use crate::repository::Repository;
use crate::setup;
use crate::workspace::Workspace;

/// Whose tests a stage runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Rust,
    Documentation,
    Rclpy,
}

/// How to read a stage's test counts from its output.
#[derive(Clone, Copy)]
pub(super) struct Tests {
    pub(super) kind: Kind,
    pub(super) count: fn(&str) -> Counts,
}

pub(super) struct Stage {
    pub(super) name: &'static str,
    pub(super) command: Command,
    /// `None` for a stage that checks without running tests.
    pub(super) tests: Option<Tests>,
    /// Whether the failure seen in this output makes the later stages pointless.
    pub(super) is_fatal: fn(i32, &str) -> bool,
}

impl Stage {
    fn check(name: &'static str, command: Command) -> Self {
        Self {
            name,
            command,
            tests: None,
            is_fatal: |_, _| false,
        }
    }

    /// Compiles all that the later stages need.
    fn lints(name: &'static str, command: Command) -> Self {
        Self {
            is_fatal: |_, output| has_compile_error(output),
            ..Self::check(name, command)
        }
    }

    fn tests(name: &'static str, kind: Kind, count: fn(&str) -> Counts, command: Command) -> Self {
        Self {
            tests: Some(Tests { kind, count }),
            ..Self::check(name, command)
        }
    }
}

/// rustc's own errors have a number; a lint, a failed test or a formatting difference has none.
fn has_compile_error(output: &str) -> bool {
    output.lines().any(|line| line.starts_with("error[E"))
}

/// In an order that fails early: what is quick first, what needs everything built last.
pub(super) fn all(repository: &Repository) -> Result<Vec<Stage>> {
    let mut stages = xtask_stages(repository);
    stages.extend(workspace_stages(repository)?);
    stages.push(rclpy_stage(repository)?);
    Ok(stages)
}

fn xtask_stages(repository: &Repository) -> Vec<Stage> {
    let own = |words: &[&str]| {
        let mut command = cargo();
        command
            .arg(words[0])
            .arg("--manifest-path")
            .arg(repository.xtask_manifest());
        if words[0] != "fmt" {
            command
                .arg("--locked")
                .arg("--target-dir")
                .arg(repository.root().join("target/xtask"));
        }
        command.args(&words[1..]);
        command
    };
    vec![
        Stage::check("xtask format", own(&["fmt", "--check"])),
        Stage::lints(
            "xtask lints",
            own(&["clippy", "--all-targets", "--quiet", "--", "-D", "warnings"]),
        ),
        Stage::tests("xtask tests", Kind::Rust, Counts::of_libtest, own(&["test", "--quiet"])),
    ]
}

fn workspace_stages(repository: &Repository) -> Result<Vec<Stage>> {
    let main = |words: &[&str]| {
        let mut command = cargo();
        command.args(words).current_dir(repository.root());
        command
    };
    // Without --no-deps clippy would judge the patched RustDDS too, which is a path dependency.
    let lints = main(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--no-deps",
        "--",
        "-D",
        "warnings",
    ]);
    let mut nextest = setup::nextest(repository)?;
    nextest.args(["run", "--workspace"]).current_dir(repository.root());
    let mut documentation = main(&["doc", "--workspace", "--no-deps"]);
    documentation.env("RUSTDOCFLAGS", "-D warnings");
    Ok(vec![
        Stage::check("format", main(&["fmt", "--check"])),
        Stage::lints("lints", lints),
        Stage {
            is_fatal: |code, _| code == NEXTEST_BUILD_FAILED,
            ..Stage::tests("Rust tests", Kind::Rust, Counts::of_nextest, nextest)
        },
        Stage::tests(
            "doc tests",
            Kind::Documentation,
            Counts::of_libtest,
            main(&["test", "--doc", "--workspace"]),
        ),
        Stage::check("documentation", documentation),
    ])
}

/// nextest's exit code when the tests could not be built.
const NEXTEST_BUILD_FAILED: i32 = 101;

/// They start the programs that the Rust tests' stage has built: a build of the programs alone would compile most of
/// the workspace once more, without the features that only tests ask for.
fn rclpy_stage(repository: &Repository) -> Result<Stage> {
    let programs = Workspace::read(repository)?.target_folder()?.join("debug");
    let mut pytest = Command::new(repository.venv_python());
    pytest
        .args([
            "-m",
            "pytest",
            "-p",
            "no:cacheprovider",
            "-r",
            "fEs",
            "--durations=5",
            "tests/rclpy",
        ])
        .current_dir(repository.root())
        .envs(setup::ros_environment(repository))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("PYTHONUNBUFFERED", "1")
        .env("RAKELIGHT_BIN_DIR", programs);
    Ok(Stage::tests("rclpy tests", Kind::Rclpy, Counts::of_pytest, pytest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compile_error_is_told_from_a_lint() {
        assert!(has_compile_error(
            "warning: x\nerror[E0425]: cannot find value `x` in this scope"
        ));
        assert!(!has_compile_error(
            "error: this could be a `let...else`\nerror: could not compile `ros` (lib)"
        ));
    }
}
