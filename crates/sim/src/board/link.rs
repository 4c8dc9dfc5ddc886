//! The symbolic link that a driver opens.

use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::BoardError;

/// A link that follows the terminal; it goes with the board.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    /// Removed with its content.
    _folder: Option<TempDir>,
}

impl Link {
    pub(super) fn new(path: Option<&Path>) -> Result<Self, BoardError> {
        let Some(path) = path else {
            return Self::in_a_folder_of_its_own();
        };
        // A link that an earlier board left behind may go; anything else is somebody's.
        match path.symlink_metadata() {
            Ok(there) if !there.is_symlink() => Err(problem(path, &"something else is there")),
            _ => Ok(Self {
                path: path.to_owned(),
                _folder: None,
            }),
        }
    }

    fn in_a_folder_of_its_own() -> Result<Self, BoardError> {
        let folder = tempfile::Builder::new().prefix("rakelight_lights_").tempdir();
        let folder = folder.map_err(|error| problem(&std::env::temp_dir(), &error))?;
        Ok(Self {
            path: folder.path().join("port"),
            _folder: Some(folder),
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// In one step, so that there is a link at any time.
    pub(super) fn lead_to(&self, terminal: &Path) -> Result<(), BoardError> {
        let name = self.path.file_name().unwrap_or_default().to_string_lossy();
        let new = self.path.with_file_name(format!(".{name}.{}", std::process::id()));
        let replaced = remove(&new)
            .and_then(|()| symlink(terminal, &new))
            .and_then(|()| std::fs::rename(&new, &self.path));
        replaced.map_err(|error| problem(&self.path, &error))
    }

    pub(super) fn remove(&self) {
        if let Err(error) = remove(&self.path) {
            tracing::warn!(link = %self.path.display(), %error, "the link to the light controller stays behind");
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.remove();
    }
}

fn problem(path: &Path, reason: &impl ToString) -> BoardError {
    BoardError::Link {
        path: path.to_owned(),
        reason: reason.to_string(),
    }
}

fn remove(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
