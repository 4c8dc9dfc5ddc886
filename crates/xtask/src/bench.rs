//! `bench NAME`: the program `bench_NAME` of package `scenarios`, in a release build.

use std::ffi::OsString;
use std::process::{Command, ExitCode};

use anyhow::{Result, bail};

use crate::process;
use crate::repository::Repository;
use crate::setup;
use crate::workspace::{SCENARIOS, Workspace};

const PREFIX: &str = "bench_";

pub(crate) fn run(repository: &Repository, name: &str, json: bool, arguments: &[OsString]) -> Result<ExitCode> {
    setup::ensure(repository)?;
    let workspace = Workspace::read(repository)?;
    let program = program_named(name, &workspace.programs(SCENARIOS))?;
    // Every program, not this one alone: a benchmark starts others as its peers.
    process::run(
        process::cargo()
            .args(["build", "--release", "-p", "rakelight", "-p", SCENARIOS, "--bins"])
            .current_dir(repository.root()),
    )?;
    let programs = workspace.target_folder()?.join("release");
    let mut command = Command::new(programs.join(program));
    command
        .args(json.then_some("--json"))
        .args(arguments)
        .envs(setup::ros_environment(repository))
        .env("RAKELIGHT_BIN_DIR", programs);
    Ok(process::exit_code(process::status(&mut command)?))
}

fn program_named(name: &str, programs: &[String]) -> Result<String> {
    let known: Vec<&str> = programs
        .iter()
        .filter_map(|program| program.strip_prefix(PREFIX))
        .collect();
    if known.contains(&name) {
        return Ok(format!("{PREFIX}{name}"));
    }
    let known = if known.is_empty() {
        "none yet".to_owned()
    } else {
        known.join(", ")
    };
    bail!("there is no benchmark `{name}`; there are: {known}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_name_is_its_program_and_another_lists_the_known_ones() {
        let programs = ["bench_solve", "bench_transport", "probe_node"].map(ToOwned::to_owned);
        assert_eq!(program_named("transport", &programs).unwrap(), "bench_transport");
        let error = program_named("probe_node", &programs).unwrap_err().to_string();
        assert!(error.ends_with("there are: solve, transport"), "{error}");
    }
}
