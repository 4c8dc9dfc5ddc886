//! `rakelight up` and what belongs to it, as a person uses them: processes, signals, configs.

mod configs;
mod doctor;
mod supervision;

use std::path::{Path, PathBuf};

use scenarios::{Domain, Program};
use tempfile::TempDir;

/// The program under test.
const RAKELIGHT: &str = env!("CARGO_BIN_EXE_rakelight");

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// A launch config in a folder of its own.
struct Config {
    _folder: TempDir,
    path: PathBuf,
}

impl Config {
    fn new(text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("cell.yaml");
        std::fs::write(&path, text).unwrap();
        Self { _folder: folder, path }
    }

    /// A recorded capture, played in a loop in one process and solved in another.
    fn replay() -> Self {
        Self::new(&format!(
            "cell:\n  processes:\n    player: [bag_player]\n    vision: [normal_solver]\n\
             bag_player:\n  ros__parameters: {{bag: {}, loop: true, rate: 0.2}}\n",
            repository().join("bags/octagon2").display()
        ))
    }

    fn as_str(&self) -> &str {
        self.path.to_str().unwrap()
    }
}

/// Starts the program in a domain.
fn rakelight(domain: &Domain, arguments: &[&str]) -> Program {
    Program::start(domain, RAKELIGHT, arguments)
}
