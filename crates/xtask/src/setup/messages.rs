//! The interface packages that no wheel has, built for the Python environment: ours, the message of `/tf`, and the action
//! that follows joint trajectories.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use super::{python, ros_environment, run_shown};
use crate::repository::Repository;
use crate::stamp::Fingerprint;

fn packages(repository: &Repository) -> [PathBuf; 3] {
    [
        repository.root().join("msgs/rakelight_msgs"),
        repository.python_sources().join("tf2_msgs"),
        repository.python_sources().join("control_msgs"),
    ]
}

fn check_script(repository: &Repository) -> PathBuf {
    repository.python_sources().join("check_messages.py")
}

pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    if !repository.ros_install().is_dir() {
        return Ok(Some("not built yet".into()));
    }
    let complete = fingerprint(repository)?.matches(&repository.ros_install());
    Ok((!complete).then(|| "incomplete, or a message or the Python environment has changed".into()))
}

fn fingerprint(repository: &Repository) -> Result<Fingerprint> {
    packages(repository)
        .iter()
        .try_fold(python::fingerprint(repository)?, |fingerprint, package| {
            fingerprint.with_tree(package)
        })?
        .with_tree(&repository.root().join("crates/interfaces/standard/control_msgs"))?
        .with_file(&check_script(repository))
}

pub(super) fn install(repository: &Repository) -> Result<()> {
    for package in packages(repository) {
        ensure!(
            package.join("package.xml").is_file(),
            "{} is not an interface package",
            package.display()
        );
    }
    let fingerprint = fingerprint(repository)?;
    let build = repository.setup().join("ros_build");
    // From scratch: a message that was removed or renamed must not live on in either folder.
    remove(&build)?;
    remove(&repository.ros_install())?;
    run_shown(&mut colcon(repository, &build))?;
    remove(&build)?;
    let mut check = Command::new(repository.venv_python());
    run_shown(check.arg(check_script(repository)).envs(ros_environment(repository)))?;
    fingerprint.write(&repository.ros_install())
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(())
}

fn colcon(repository: &Repository, build: &Path) -> Command {
    let venv = repository.venv();
    let mut command = Command::new(venv.join("bin/colcon"));
    command
        .args(["--log-level", "error", "--log-base"])
        .arg(build.join("log"))
        .args(["build", "--merge-install", "--base-paths"]);
    command.args(packages(repository));
    command
        .arg("--build-base")
        .arg(build)
        .arg("--install-base")
        .arg(repository.ros_install());
    command.args([
        "--event-handlers",
        "console_direct-",
        "--cmake-args",
        "-DBUILD_TESTING=OFF",
    ]);
    command.arg(format!("-DPython3_EXECUTABLE={}", repository.venv_python().display()));
    // What a sourced ROS installation of another kind has set must not leak into this build.
    for variable in ["COLCON_PREFIX_PATH", "ROS_DISTRO", "ROS_VERSION", "CMAKE_GENERATOR"] {
        command.env_remove(variable);
    }
    command
        .envs(ros_environment(repository))
        .env("CMAKE_PREFIX_PATH", &venv);
    command
}
