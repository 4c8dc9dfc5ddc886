//! `setup`: a list of steps, each of which can tell in milliseconds whether it has anything to do.

mod cmake_paths;
mod environment;
mod messages;
mod privilege;
mod python;
mod rust_tools;
mod rustdds;
mod system;

use std::fs::{self, File};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

pub(crate) use environment::ros_environment;
pub(crate) use rust_tools::nextest;

use crate::process;
use crate::repository::Repository;

/// One thing that set-up takes care of.
struct Step {
    name: &'static str,
    /// Why the step must run, or `None` when it is complete. Fast, and changes nothing.
    missing: fn(&Repository) -> Result<Option<String>>,
    /// Makes it complete. May be interrupted and repeated at any point.
    install: fn(&Repository) -> Result<()>,
}

/// In the order of their needs: the Python environment needs a Python, the messages a compiler and the environment.
const STEPS: [Step; 6] = [
    Step {
        name: "system packages",
        missing: system::missing,
        install: system::install,
    },
    Step {
        name: "Rust tools",
        missing: rust_tools::missing,
        install: rust_tools::install,
    },
    Step {
        name: "patched RustDDS",
        missing: rustdds::missing,
        install: rustdds::install,
    },
    Step {
        name: "Python environment",
        missing: python::missing,
        install: python::install,
    },
    Step {
        name: "ROS messages for Python",
        missing: messages::missing,
        install: messages::install,
    },
    Step {
        name: "shell environment",
        missing: environment::missing,
        install: environment::install,
    },
];

/// `setup --check`: says what is there and what is not, and changes nothing.
pub(crate) fn check(repository: &Repository) -> Result<ExitCode> {
    let mut complete = true;
    for step in &STEPS {
        match (step.missing)(repository)? {
            None => println!("{}: ok", step.name),
            Some(reason) => {
                complete = false;
                println!("{}: MISSING, {reason}", step.name);
            }
        }
    }
    if !complete {
        println!("\nRun `cargo xtask setup` to install what is missing.");
    }
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// `setup`: completes every step.
pub(crate) fn run(repository: &Repository) -> Result<ExitCode> {
    complete(repository)?;
    eprintln!(
        "\nReady. `source {}` gives a shell rclpy and the messages.",
        repository.environment_script().display()
    );
    Ok(ExitCode::SUCCESS)
}

/// What `demo`, `test` and `bench` do first: nothing, in well under a second, when set-up is complete.
pub(crate) fn ensure(repository: &Repository) -> Result<()> {
    for step in &STEPS {
        if (step.missing)(repository)?.is_some() {
            eprintln!("Something is missing; setting up first.\n");
            complete(repository)?;
            eprintln!();
            return Ok(());
        }
    }
    Ok(())
}

fn complete(repository: &Repository) -> Result<()> {
    let _lock = lock(repository)?;
    for (number, step) in STEPS.iter().enumerate() {
        let place = format!("[{}/{}] {}", number + 1, STEPS.len(), step.name);
        match (step.missing)(repository)? {
            None => eprintln!("{place}: ok"),
            Some(reason) => perform(repository, step, &place, &reason)?,
        }
    }
    Ok(())
}

fn perform(repository: &Repository, step: &Step, place: &str, reason: &str) -> Result<()> {
    eprintln!("{place}: installing ({reason})");
    let begun = Instant::now();
    (step.install)(repository).with_context(|| format!("set-up step `{}` failed", step.name))?;
    if let Some(reason) = (step.missing)(repository)? {
        bail!(
            "set-up step `{}` ran without an error, yet is incomplete: {reason}",
            step.name
        );
    }
    eprintln!("{place}: done in {:.0} s", begun.elapsed().as_secs_f64());
    Ok(())
}

/// Two set-ups in one clone would tear down each other's folders, so the second waits. Released by the file's closing.
fn lock(repository: &Repository) -> Result<File> {
    let path = repository.setup().join("lock");
    fs::create_dir_all(repository.setup())
        .with_context(|| format!("cannot create {}", repository.setup().display()))?;
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    if file.try_lock().is_err() {
        eprintln!("Waiting for another set-up of this clone to finish ...");
        file.lock().with_context(|| format!("cannot lock {}", path.display()))?;
    }
    Ok(file)
}

/// Runs one command of a step and shows it first.
fn run_shown(command: &mut Command) -> Result<()> {
    eprintln!("    $ {}", process::describe(command));
    process::run(command)
}

/// A silent yes-or-no question to another program.
fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
