//! Where a new bag goes.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use chrono::DateTime;
use recording::{BagWriter, RecordingError};

use crate::error::Error;

/// Bags of one second that get a number behind their name; more in one second is no use.
const NAMESAKES: u32 = 100;

/// Creates the bag: `requested` below `folder` (unless it is absolute), or a new one named by date and time.
pub(crate) fn create(folder: &Path, requested: &str) -> Result<BagWriter, Error> {
    let refused = |source| Error::Folder {
        path: folder.to_owned(),
        source,
    };
    let folder = std::path::absolute(folder).map_err(refused)?;
    if !Path::new(requested).is_absolute() {
        std::fs::create_dir_all(&folder).map_err(refused)?;
    }
    if !requested.is_empty() {
        return Ok(BagWriter::create(folder.join(requested))?);
    }
    let name = name(SystemTime::now());
    let numbered = (2..NAMESAKES).map(|number| folder.join(format!("{name}_{number}")));
    for path in std::iter::once(folder.join(&name)).chain(numbered) {
        match BagWriter::create(path) {
            Err(RecordingError::Exists { .. }) => {}
            other => return Ok(other?),
        }
    }
    let path = folder.join(name);
    Err(RecordingError::Exists { path }.into())
}

/// `2026-03-01_14-05-09`, in UTC.
fn name(time: SystemTime) -> String {
    let since_epoch = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let time = DateTime::from_timestamp(since_epoch.as_secs() as i64, 0).unwrap_or_default();
    time.format("%Y-%m-%d_%H-%M-%S").to_string()
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    #[test]
    fn bags_are_named_by_date_and_time() {
        let time = UNIX_EPOCH + std::time::Duration::from_secs(1_700_000_000);
        assert_eq!(name(time), "2023-11-14_22-13-20");
    }

    #[test]
    fn bags_of_one_second_get_different_names() {
        let scratch = tempfile::tempdir().unwrap();
        let folder = scratch.path().join("not/there/yet");
        let folders: Vec<PathBuf> = (0..4)
            .map(|_| create(&folder, "").unwrap().folder().to_owned())
            .collect();
        let distinct: std::collections::BTreeSet<&PathBuf> = folders.iter().collect();
        assert_eq!(distinct.len(), 4, "{folders:?}");
    }

    #[test]
    fn a_path_is_taken_below_the_folder_and_never_twice() {
        let scratch = tempfile::tempdir().unwrap();
        let bag = create(scratch.path(), "mine").unwrap();
        assert_eq!(bag.folder(), scratch.path().join("mine"));
        let again = create(scratch.path(), "mine").map(drop).unwrap_err().to_string();
        assert!(again.contains("exists already"), "{again}");
        let absolute = scratch.path().join("absolute");
        let bag = create(Path::new("elsewhere"), absolute.to_str().unwrap()).unwrap();
        assert_eq!(bag.folder(), absolute);
        assert!(!Path::new("elsewhere").exists());
    }

    #[test]
    fn what_is_in_the_way_is_named() {
        let scratch = tempfile::tempdir().unwrap();
        let file = scratch.path().join("file");
        std::fs::write(&file, "").unwrap();
        let error = create(&file, "").map(drop).unwrap_err().to_string();
        assert!(error.contains(file.to_str().unwrap()), "{error}");
    }
}
