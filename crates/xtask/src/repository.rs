//! Where things are in a clone.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

/// A clone of the repository. Every path is absolute, so that nothing depends on the current folder.
pub(crate) struct Repository {
    root: PathBuf,
}

impl Repository {
    /// The clone that this xtask was started from (`cargo run` names its manifest's folder in the environment).
    pub(crate) fn locate() -> Result<Self> {
        let manifest_folder =
            std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
        let root = Path::new(&manifest_folder).join("../..");
        let root = root
            .canonicalize()
            .with_context(|| format!("no repository at {}", root.display()))?;
        ensure!(
            root.join("crates/xtask").is_dir(),
            "{} is not a clone: it has no crates/xtask",
            root.display()
        );
        Ok(Self { root })
    }

    #[cfg(test)]
    pub(crate) fn at(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// The git-ignored folder for everything that set-up makes.
    pub(crate) fn setup(&self) -> PathBuf {
        self.root.join(".setup")
    }

    pub(crate) fn venv(&self) -> PathBuf {
        self.setup().join("venv")
    }

    pub(crate) fn venv_python(&self) -> PathBuf {
        self.venv().join("bin/python")
    }

    /// Install prefix of the ROS interface packages that set-up builds for rclpy.
    pub(crate) fn ros_install(&self) -> PathBuf {
        self.setup().join("ros_install")
    }

    pub(crate) fn environment_script(&self) -> PathBuf {
        self.setup().join("env.sh")
    }

    /// Pinned requirements, the check script and the interface packages that have no wheel.
    pub(crate) fn python_sources(&self) -> PathBuf {
        self.root.join("crates/xtask/python")
    }

    pub(crate) fn xtask_manifest(&self) -> PathBuf {
        self.root.join("crates/xtask/Cargo.toml")
    }
}
