//! The variables that make rclpy and the messages importable, for our own child processes and for a person's shell.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};

use crate::repository::Repository;

const RMW: (&str, &str) = ("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp");

/// The search paths to put in front, in the order of precedence: what set-up built hides what the wheels bring.
fn search_paths(repository: &Repository) -> [(&'static str, Vec<PathBuf>); 4] {
    let (built, venv) = (repository.ros_install(), repository.venv());
    [
        ("PATH", vec![venv.join("bin")]),
        ("PYTHONPATH", vec![built.join("lib/python3.11/site-packages")]),
        ("LD_LIBRARY_PATH", vec![built.join("lib"), venv.join("lib")]),
        ("AMENT_PREFIX_PATH", vec![built, venv]),
    ]
}

/// For child processes. Only `PATH` keeps what the caller had: libraries of another ROS would break ours.
pub(crate) fn ros_environment(repository: &Repository) -> BTreeMap<&'static str, OsString> {
    let inherited = std::env::var_os("PATH").unwrap_or_default();
    let mut variables: BTreeMap<_, _> = search_paths(repository)
        .into_iter()
        .map(|(name, mut folders)| {
            if name == "PATH" {
                folders.extend(std::env::split_paths(&inherited));
            }
            (
                name,
                std::env::join_paths(folders).expect("the clone's path has no colon: checked by `missing`"),
            )
        })
        .collect();
    variables.insert(RMW.0, RMW.1.into());
    variables
}

pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    anyhow::ensure!(
        !repository.root().to_string_lossy().contains([':', '\'']),
        "{} has a colon or a quote in its path, which search paths cannot hold: move the clone",
        repository.root().display()
    );
    let current = fs::read_to_string(repository.environment_script()).is_ok_and(|text| text == script(repository));
    Ok((!current).then(|| "env.sh is absent or out of date".into()))
}

pub(super) fn install(repository: &Repository) -> Result<()> {
    let path = repository.environment_script();
    fs::write(&path, script(repository)).with_context(|| format!("cannot write {}", path.display()))
}

/// A script for bash, zsh and dash that may be sourced from any folder and more than once.
fn script(repository: &Repository) -> String {
    let mut text = String::from(
        "# Written by `cargo xtask setup`. Source it to use rclpy and rakelight_msgs in this shell.\n\
         if [ -n \"${ROS_DISTRO:-}\" ]; then\n    \
             echo \"warning: a ROS installation ($ROS_DISTRO) is sourced in this shell; use a fresh one\" >&2\n\
         fi\n\
         rakelight_prepend() { # variable, folder\n    \
             eval \"rakelight_now=\\${$1:-}\"\n    \
             case \":$rakelight_now:\" in\n        \
                 *\":$2:\"*) ;;\n        \
                 *) eval \"export $1=\\\"\\$2\\${rakelight_now:+:\\$rakelight_now}\\\"\" ;;\n    \
             esac\n\
         }\n",
    );
    for (name, folders) in search_paths(repository) {
        // The last one prepended comes first.
        for folder in folders.iter().rev() {
            text.extend(["rakelight_prepend ", name, " '", &folder.to_string_lossy(), "'\n"]);
        }
    }
    text.extend([
        "export ",
        RMW.0,
        "=",
        RMW.1,
        "\nunset rakelight_now\nunset -f rakelight_prepend\n",
    ]);
    text
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::Command;

    use super::*;
    use crate::process::{capture, find_program};

    /// What a shell has in `variable` after sourcing the script `times` times.
    fn sourced(shell: &str, variable: &str, before: &str, times: usize) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("env.sh");
        fs::write(&path, script(&Repository::at(Path::new("/clone of mine")))).unwrap();
        let code = format!(
            "{}printf %s \"${variable}\"",
            format!(". '{}'; ", path.display()).repeat(times)
        );
        capture(
            Command::new(shell)
                .args(["-c", &code])
                .current_dir("/")
                .env(variable, before)
                .env_remove("ROS_DISTRO"),
        )
        .unwrap()
    }

    #[test]
    fn every_shell_gets_the_same_paths_however_often_it_is_sourced() {
        let expected = "/clone of mine/.setup/ros_install/lib:/clone of mine/.setup/venv/lib:/mine";
        for shell in ["sh", "bash", "zsh"]
            .into_iter()
            .filter(|shell| find_program(shell).is_some())
        {
            for times in [1, 2] {
                assert_eq!(
                    sourced(shell, "LD_LIBRARY_PATH", "/mine", times),
                    expected,
                    "{shell}, {times} times"
                );
            }
        }
    }

    #[test]
    fn an_empty_variable_gets_no_empty_entry() {
        assert_eq!(
            sourced("sh", "PYTHONPATH", "", 1),
            "/clone of mine/.setup/ros_install/lib/python3.11/site-packages"
        );
    }

    #[test]
    fn children_and_shells_agree() {
        let repository = Repository::at(Path::new("/clone of mine"));
        let children = ros_environment(&repository);
        for variable in [
            "PYTHONPATH",
            "LD_LIBRARY_PATH",
            "AMENT_PREFIX_PATH",
            "RMW_IMPLEMENTATION",
        ] {
            assert_eq!(
                sourced("sh", variable, "", 1),
                children[variable].to_str().unwrap(),
                "{variable}"
            );
        }
    }
}
