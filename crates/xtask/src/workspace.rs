//! What cargo knows about the main workspace.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use serde_json::Value;

use crate::process::{capture, cargo};
use crate::repository::Repository;

/// The package that holds the end-to-end tests and the benchmark programs.
pub(crate) const SCENARIOS: &str = "scenarios";

/// The main workspace as `cargo metadata` describes it.
pub(crate) struct Workspace {
    metadata: Value,
}

impl Workspace {
    pub(crate) fn read(repository: &Repository) -> Result<Self> {
        let manifest = repository.root().join("Cargo.toml");
        let text = capture(
            cargo()
                .args(["metadata", "--format-version=1", "--no-deps", "--manifest-path"])
                .arg(manifest),
        )?;
        Ok(Self {
            metadata: serde_json::from_str(&text).context("cargo metadata is not JSON")?,
        })
    }

    /// Where cargo puts what it builds, `CARGO_TARGET_DIR` and configuration taken into account.
    pub(crate) fn target_folder(&self) -> Result<PathBuf> {
        let folder = self.metadata["target_directory"]
            .as_str()
            .context("cargo metadata has no target_directory")?;
        Ok(Path::new(folder).to_owned())
    }

    /// Names of the programs of one package, sorted.
    pub(crate) fn programs(&self, package: &str) -> Vec<String> {
        let packages = self.metadata["packages"].as_array().into_iter().flatten();
        let targets = packages
            .filter(|candidate| candidate["name"] == package)
            .flat_map(|package| package["targets"].as_array().into_iter().flatten());
        let is_program = |target: &&Value| {
            target["kind"]
                .as_array()
                .is_some_and(|kinds| kinds.iter().any(|kind| kind == "bin"))
        };
        let mut names: Vec<String> = targets
            .filter(is_program)
            .filter_map(|target| Some(target["name"].as_str()?.to_owned()))
            .collect();
        names.sort();
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_programs_of_the_named_package_are_listed() {
        let target = |kind: &str, name: &str| serde_json::json!({"kind": [kind], "name": name});
        let metadata = serde_json::json!({"target_directory": "/t", "packages": [
            {"name": "scenarios", "targets": [target("bin", "bench_b"), target("lib", "scenarios"), target("bin", "bench_a")]},
            {"name": "rakelight", "targets": [target("bin", "rakelight")]},
        ]});
        let workspace = Workspace { metadata };
        assert_eq!(workspace.programs(SCENARIOS), ["bench_a", "bench_b"]);
        assert_eq!(workspace.target_folder().unwrap(), Path::new("/t"));
    }
}
