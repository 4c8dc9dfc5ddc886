//! Where the default launch config is.

use std::path::{Path, PathBuf};

use anyhow::anyhow;

const DEFAULT: &str = "launch_configs/sim.yaml";

/// The config that was asked for, or the default one: in the working folder, else in the repository that the executable
/// was built in.
pub(crate) fn config(asked: Option<PathBuf>) -> anyhow::Result<PathBuf> {
    match asked {
        Some(path) => Ok(path),
        None => default_in(Path::new(""), std::env::current_exe().ok().as_deref()),
    }
}

/// The repository of the working folder, else of the executable.
pub(crate) fn repository() -> Option<PathBuf> {
    let here = std::env::current_dir().ok();
    let executable = std::env::current_exe().ok();
    let mut folders = here.iter().chain(&executable).flat_map(|path| path.ancestors());
    folders
        .find(|folder| folder.join(DEFAULT).is_file())
        .map(Path::to_owned)
}

fn default_in(working: &Path, executable: Option<&Path>) -> anyhow::Result<PathBuf> {
    let above = executable.into_iter().flat_map(Path::ancestors).skip(1);
    std::iter::once(working)
        .chain(above)
        .map(|folder| folder.join(DEFAULT))
        .find(|path| path.is_file())
        .ok_or_else(|| {
            anyhow!(
                "no {DEFAULT} here or above {}; name a launch config with --config FILE",
                executable.map_or_else(|| "the executable".into(), |path| path.display().to_string())
            )
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_working_folder_comes_first_and_then_the_executables_repository() {
        let root = tempfile::tempdir().unwrap();
        let (here, clone) = (root.path().join("here"), root.path().join("clone"));
        let executable = clone.join("target/debug/rakelight");
        let error = default_in(&here, Some(&executable)).unwrap_err().to_string();
        assert!(
            error.contains("--config FILE") && error.contains("target/debug"),
            "{error}"
        );
        for folder in [&clone, &here] {
            std::fs::create_dir_all(folder.join("launch_configs")).unwrap();
            std::fs::write(folder.join(DEFAULT), "").unwrap();
            assert_eq!(default_in(&here, Some(&executable)).unwrap(), folder.join(DEFAULT));
        }
    }
}
