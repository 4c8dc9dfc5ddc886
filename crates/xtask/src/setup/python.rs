//! The Python environment: CPython 3.11 (the wheels of rclpy exist for no other) and every package pinned.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use super::{cmake_paths, run_shown};
use crate::process::{capture, find_programs};
use crate::repository::Repository;
use crate::stamp::Fingerprint;

/// Names the interpreter to use instead of searching the `PATH`.
const OVERRIDE_VARIABLE: &str = "RAKELIGHT_PYTHON";

pub(super) const HOW_TO_GET: &str = "CPython 3.11 with its headers is needed: rclpy's wheels exist for no other version.\n\
     Debian 12 has it as python3.11, python3.11-dev and python3.11-venv. Elsewhere `uv python install 3.11` or \
     `pyenv install 3.11` provide it;\nthen name it: RAKELIGHT_PYTHON=/path/to/python3.11 cargo xtask setup";

/// Answers what an interpreter is and what it lacks for us.
const PROBE: &str = "import importlib.util, json, os, sys, sysconfig
headers = sysconfig.get_paths()['include']
print(json.dumps({'implementation': sys.implementation.name, 'version': '%d.%d' % sys.version_info[:2],
    'headers': os.path.exists(os.path.join(headers, 'Python.h')), 'venv': importlib.util.find_spec('ensurepip') is not None}))";

/// Whether the environment exists already, or else an interpreter to make it from.
pub(super) fn has_interpreter(repository: &Repository) -> bool {
    missing(repository).is_ok_and(|reason| reason.is_none()) || find_interpreter().is_some()
}

pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    if !repository.venv_python().exists() {
        return Ok(Some("not made yet".into()));
    }
    let complete = fingerprint(repository)?.matches(&repository.venv());
    Ok((!complete).then(|| "incomplete, or its pinned packages or its place have changed".into()))
}

/// Changes with the requirements and with the folder's place, which the scripts inside have written into them.
pub(super) fn fingerprint(repository: &Repository) -> Result<Fingerprint> {
    let place = repository.venv();
    Fingerprint::new()
        .with(place.to_string_lossy().as_bytes())
        .with_file(&requirements(repository))
}

fn requirements(repository: &Repository) -> PathBuf {
    repository.python_sources().join("requirements.txt")
}

pub(super) fn install(repository: &Repository) -> Result<()> {
    let Some(interpreter) = find_interpreter() else {
        bail!("{}", explain_candidates())
    };
    let venv = repository.venv();
    run_shown(Command::new(interpreter).args(["-m", "venv", "--clear"]).arg(&venv))?;
    // Every package is in the list, so pip must not add one: with --no-deps an unpinned one is an error of `check`.
    run_shown(
        pip(repository)
            .args(["install", "--quiet", "--no-deps", "--requirement"])
            .arg(requirements(repository)),
    )?;
    run_shown(pip(repository).arg("check"))?;
    cmake_paths::correct(repository)?;
    fingerprint(repository)?.write(&venv)
}

fn pip(repository: &Repository) -> Command {
    let mut command = Command::new(repository.venv_python());
    command.args(["-m", "pip", "--disable-pip-version-check", "--no-input"]);
    command
}

fn find_interpreter() -> Option<PathBuf> {
    candidates()
        .into_iter()
        .find(|path| lacks(path).is_ok_and(|lacks| lacks.is_empty()))
}

fn candidates() -> Vec<PathBuf> {
    if let Some(named) = std::env::var_os(OVERRIDE_VARIABLE) {
        return vec![named.into()];
    }
    ["python3.11", "python3"].into_iter().flat_map(find_programs).collect()
}

/// What an interpreter lacks for us; empty when it will do.
fn lacks(interpreter: &Path) -> Result<Vec<String>> {
    let answer = capture(Command::new(interpreter).args(["-c", PROBE]))?;
    let answer: Value = serde_json::from_str(answer.trim()).context("the interpreter did not answer the probe")?;
    Ok(judge(&answer))
}

fn judge(answer: &Value) -> Vec<String> {
    let mut lacks = Vec::new();
    if answer["implementation"] != "cpython" || answer["version"] != "3.11" {
        let text = |key: &str| answer[key].as_str().unwrap_or("?").to_owned();
        lacks.push(format!(
            "it is {} {}, not cpython 3.11",
            text("implementation"),
            text("version")
        ));
    }
    if answer["headers"] != true {
        lacks.push("it has no Python.h (Debian: python3.11-dev)".into());
    }
    if answer["venv"] != true {
        lacks.push("it cannot make environments (Debian: python3.11-venv)".into());
    }
    lacks
}

/// Every interpreter that was looked at, why none will do, and how to get one that does.
pub(super) fn explain_candidates() -> String {
    let mut lines = vec!["no usable Python was found:".to_owned()];
    for path in candidates() {
        let reasons = lacks(&path).map_or_else(|error| format!("{error:#}"), |lacks| lacks.join("; "));
        lines.push(format!("    {}: {reasons}", path.display()));
    }
    lines.push(HOW_TO_GET.to_owned());
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_complete_cpython_3_11_will_do() {
        let answer = serde_json::json!({"implementation": "cpython", "version": "3.11", "headers": true, "venv": true});
        assert_eq!(judge(&answer), Vec::<String>::new());
    }

    #[test]
    fn each_thing_an_interpreter_lacks_is_named() {
        let answer =
            serde_json::json!({"implementation": "cpython", "version": "3.12", "headers": false, "venv": false});
        let lacks = judge(&answer).join("\n");
        for expected in ["cpython 3.12", "python3.11-dev", "python3.11-venv"] {
            assert!(lacks.contains(expected), "{lacks}");
        }
    }

    #[test]
    fn every_requirement_is_pinned_once() {
        let list = include_str!("../../python/requirements.txt");
        let names: Vec<_> = list
            .lines()
            .filter(|line| !line.is_empty() && !line.starts_with('#'))
            .map(|line| {
                line.split_once("==")
                    .unwrap_or_else(|| panic!("`{line}` is not pinned"))
                    .0
            })
            .collect();
        let mut unique = names.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), names.len(), "a package is listed twice");
    }
}
