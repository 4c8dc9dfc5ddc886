//! Whether `cargo xtask setup` has made what rclpy users need.

use std::path::{Path, PathBuf};

use super::finding::{Finding, Section};

const PYTHON: Section = Section("Python");

/// `shell` is the `PYTHONPATH` of this shell.
pub(super) fn check(repository: Option<&Path>, shell: Option<&str>) -> Vec<Finding> {
    let what = "rclpy and rakelight_msgs";
    let Some(repository) = repository else {
        let advice = "fine without Python; else clone the repository and run `cargo xtask setup` there";
        return vec![PYTHON.warn(what, "no repository here or above this program", advice)];
    };
    let setup = repository.join(".setup");
    let parts = [
        ("rclpy", setup.join("venv")),
        ("rakelight_msgs", setup.join("ros_install")),
    ];
    let missing: Vec<&str> = parts
        .iter()
        .filter(|(package, folder)| !has_package(folder, package))
        .map(|(package, _)| *package)
        .collect();
    if !missing.is_empty() {
        let found = format!("{} missing in {}", missing.join(", "), setup.display());
        return vec![PYTHON.warn(what, found, "fine without Python; else: cargo xtask setup")];
    }
    vec![PYTHON.ok(what, setup.display().to_string()), this_shell(&setup, shell)]
}

fn this_shell(setup: &Path, shell: Option<&str>) -> Finding {
    let what = "this shell";
    let ours = shell.is_some_and(|path| path.split(':').any(|entry| Path::new(entry).starts_with(setup)));
    if ours {
        return PYTHON.ok(what, "has them");
    }
    PYTHON.ok(
        what,
        format!(
            "does not have them; to use them: source {}",
            setup.join("env.sh").display()
        ),
    )
}

/// Whether a package lies in one of `lib/python*/site-packages`.
fn has_package(prefix: &Path, package: &str) -> bool {
    let versions = std::fs::read_dir(prefix.join("lib")).into_iter().flatten().flatten();
    versions
        .map(|version| version.path().join("site-packages").join(package))
        .any(|folder: PathBuf| folder.is_dir())
}

#[cfg(test)]
mod tests {
    use super::super::finding::Status;
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        assert_eq!(check(None, None)[0].status, Status::Warn);
        let root = tempfile::tempdir().unwrap();
        let packages = root.path().join(".setup/venv/lib/python3.11/site-packages");
        std::fs::create_dir_all(packages.join("rclpy")).unwrap();
        let found = check(Some(root.path()), None);
        assert!(found[0].found.starts_with("rakelight_msgs missing"), "{found:?}");
        let messages = root.path().join(".setup/ros_install/lib/python3.11/site-packages");
        std::fs::create_dir_all(messages.join("rakelight_msgs")).unwrap();
        let shell = format!("/elsewhere:{}", messages.display());
        let found = check(Some(root.path()), Some(&shell));
        assert_eq!((found[0].status, found[1].found.as_str()), (Status::Ok, "has them"));
        assert!(check(Some(root.path()), None)[1].found.contains("source"));
    }
}
