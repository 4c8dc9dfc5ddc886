//! Stamps: a finished step leaves a fingerprint of its inputs, and is repeated when they no longer agree.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Name of the stamp inside the folder that it vouches for.
const STAMP_NAME: &str = ".rakelight_stamp";

/// FNV-1a over names and contents: it detects edits, it does not resist attack, and it never changes with the compiler.
#[derive(Clone, Copy)]
pub(crate) struct Fingerprint(u64);

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds one field. Its length goes in too, so that moving a byte from one field to the next is a change.
    pub(crate) fn with(self, bytes: impl AsRef<[u8]>) -> Self {
        let bytes = bytes.as_ref();
        let length = (bytes.len() as u64).to_le_bytes();
        Self(length.iter().chain(bytes).fold(self.0, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
        }))
    }

    pub(crate) fn with_file(self, path: &Path) -> Result<Self> {
        let content = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Ok(self.with(content))
    }

    /// Adds every file below `folder`, with its relative name, in the order of the names.
    pub(crate) fn with_tree(mut self, folder: &Path) -> Result<Self> {
        for path in files_below(folder)? {
            let name = path
                .strip_prefix(folder)
                .expect("files_below stays below")
                .to_string_lossy()
                .into_owned();
            self = self.with(name).with_file(&path)?;
        }
        Ok(self)
    }

    fn text(self) -> String {
        format!("{:016x}\n", self.0)
    }

    /// Whether `folder` was completed from the same inputs.
    pub(crate) fn matches(self, folder: &Path) -> bool {
        fs::read_to_string(folder.join(STAMP_NAME)).is_ok_and(|found| found == self.text())
    }

    /// Marks `folder` as complete. Must be the last act of a step.
    pub(crate) fn write(self, folder: &Path) -> Result<()> {
        let path = folder.join(STAMP_NAME);
        fs::write(&path, self.text()).with_context(|| format!("cannot write {}", path.display()))
    }
}

/// Every file below a folder, sorted.
pub(crate) fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).with_context(|| format!("cannot read folder {}", next.display()))? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, content) in files {
            let path = folder.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, content).unwrap();
        }
        folder
    }

    fn text_of(files: &[(&str, &str)]) -> String {
        Fingerprint::new().with_tree(tree(files).path()).unwrap().text()
    }

    #[test]
    fn the_same_tree_elsewhere_has_the_same_fingerprint() {
        assert_eq!(
            text_of(&[("a", "1"), ("msg/b", "2")]),
            text_of(&[("msg/b", "2"), ("a", "1")])
        );
    }

    #[test]
    fn content_name_and_boundary_all_count() {
        let original = text_of(&[("a", "12"), ("b", "3")]);
        for changed in [
            [("a", "12"), ("b", "4")],
            [("a", "12"), ("c", "3")],
            [("a", "1"), ("b", "23")],
        ] {
            assert_ne!(text_of(&changed), original, "{changed:?}");
        }
    }

    #[test]
    fn a_stamp_vouches_only_for_its_own_inputs() {
        let folder = tree(&[]);
        let stamp = Fingerprint::new().with("first");
        assert!(!stamp.matches(folder.path()), "an unstamped folder is not complete");
        stamp.write(folder.path()).unwrap();
        assert!(stamp.matches(folder.path()));
        assert!(!Fingerprint::new().with("second").matches(folder.path()));
    }
}
