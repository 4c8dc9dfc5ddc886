//! Which cells `rakelight up` runs on this machine.
//!
//! Each has a file that its supervisor holds locked, so that a second one for the same place is refused and other
//! commands find the cell. The kernel unlocks it when the supervisor dies, however it dies.

use std::env;
use std::fs::{self, File, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

use ros::DiscoveryRange;
use serde::{Deserialize, Serialize};

/// Where a cell is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct RunningCell {
    /// Of the supervisor.
    pub(crate) pid: u32,
    pub(crate) config: PathBuf,
    pub(crate) namespace: String,
    pub(crate) domain_id: u16,
    /// This machine only.
    pub(crate) localhost: bool,
}

/// Why a cell cannot be claimed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ClaimError {
    #[error(
        "a cell runs already in namespace {namespace} of ROS domain {domain_id}: `rakelight up` with {config}, process {pid}. \
         End it first, or choose another domain with ROS_DOMAIN_ID or `domain_id` in the config"
    )]
    Taken {
        namespace: String,
        domain_id: u16,
        config: String,
        pid: u32,
    },
    #[error("cannot write {path}: {reason}")]
    File { path: PathBuf, reason: io::Error },
}

impl RunningCell {
    /// Claims the place for as long as the file is held.
    pub(crate) fn claim(&self, folder: &Path) -> Result<File, ClaimError> {
        let path = folder.join(self.file_name());
        let failed = |reason| ClaimError::File {
            path: path.clone(),
            reason,
        };
        fs::create_dir_all(folder).map_err(failed)?;
        let mut file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::Error(reason)) => return Err(failed(reason)),
            Err(TryLockError::WouldBlock) => return Err(self.taken(&mut file)),
        }
        let text = serde_json::to_string(self).map_err(|error| failed(error.into()))?;
        file.set_len(0)
            .and_then(|()| file.rewind())
            .and_then(|()| file.write_all(text.as_bytes()))
            .map_err(failed)?;
        Ok(file)
    }

    fn taken(&self, file: &mut File) -> ClaimError {
        let other = read(file).unwrap_or_else(|| self.clone());
        ClaimError::Taken {
            namespace: other.namespace,
            domain_id: other.domain_id,
            config: other.config.display().to_string(),
            pid: other.pid,
        }
    }

    fn file_name(&self) -> String {
        format!("cell_{}{}.json", self.domain_id, self.namespace.replace('/', "_"))
    }

    /// Cells that run now, by domain.
    pub(crate) fn all(folder: &Path) -> Vec<Self> {
        let files = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut cells: Vec<Self> = files.filter_map(|file| running(&file.path())).collect();
        cells.sort_by_key(|cell| cell.domain_id);
        cells
    }

    pub(crate) fn discovery_range(&self) -> DiscoveryRange {
        if self.localhost {
            DiscoveryRange::Localhost
        } else {
            DiscoveryRange::Subnet
        }
    }
}

/// Where the files are: a folder of this user.
pub(crate) fn folder() -> PathBuf {
    match env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty()) {
        Some(folder) => PathBuf::from(folder).join("rakelight"),
        None => env::temp_dir().join(format!("rakelight_{}", rustix::process::getuid().as_raw())),
    }
}

/// What the file says, if somebody holds it.
fn running(path: &Path) -> Option<RunningCell> {
    let mut file = File::open(path).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => read(&mut file),
        _ => None,
    }
}

fn read(file: &mut File) -> Option<RunningCell> {
    let mut text = String::new();
    file.rewind().ok()?;
    file.read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(domain_id: u16) -> RunningCell {
        RunningCell {
            pid: 42,
            config: "sim.yaml".into(),
            namespace: "/cell".into(),
            domain_id,
            localhost: true,
        }
    }

    #[test]
    fn a_place_is_claimed_once_and_free_when_its_holder_is_gone() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(RunningCell::all(folder.path()), []);
        let held = cell(3).claim(folder.path()).unwrap();
        let error = cell(3).claim(folder.path()).unwrap_err().to_string();
        assert!(
            error.starts_with("a cell runs already in namespace /cell of ROS domain 3") && error.contains("process 42"),
            "{error}"
        );
        let other = cell(1).claim(folder.path()).unwrap();
        assert_eq!(RunningCell::all(folder.path()), [cell(1), cell(3)]);
        drop((held, other));
        assert_eq!(RunningCell::all(folder.path()), []);
        cell(3).claim(folder.path()).unwrap();
    }

    #[test]
    fn other_files_are_no_cells() {
        let folder = tempfile::tempdir().unwrap();
        let junk = File::create(folder.path().join("cell_junk.json")).unwrap();
        junk.lock().unwrap();
        assert_eq!(RunningCell::all(folder.path()), []);
    }
}
