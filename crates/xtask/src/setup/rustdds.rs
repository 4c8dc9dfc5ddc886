//! RustDDS with our patch. Its sources are not in this repository: cargo downloads the pinned crate, we patch a copy.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;

use crate::process::{capture, cargo};
use crate::repository::Repository;
use crate::stamp::{Fingerprint, files_below};

const VERSION: &str = "0.15.1";
/// Of the published archive, as the registry's index states it; cargo holds each download against the index.
const ARCHIVE_SHA256: &str = "42683a88b9dc025d7d45771b88d20846443b4901ec4b045ca78b8dd316ab616f";

/// Where `[patch.crates-io]` of the main workspace points.
fn patched(repository: &Repository) -> PathBuf {
    repository.setup().join(format!("rustdds-{VERSION}"))
}

fn patch_file(repository: &Repository) -> PathBuf {
    repository
        .root()
        .join(format!("crates/ros/rustdds_patch/rustdds-{VERSION}.patch"))
}

fn fingerprint(repository: &Repository) -> Result<Fingerprint> {
    Fingerprint::new()
        .with(ARCHIVE_SHA256)
        .with_file(&patch_file(repository))
}

pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    let folder = patched(repository);
    if !folder.join("Cargo.toml").is_file() {
        return Ok(Some("not made yet".into()));
    }
    Ok((!fingerprint(repository)?.matches(&folder)).then(|| "the patch has changed".into()))
}

/// Builds the patched copy beside its place and swaps it in complete, so that no build ever sees half of it.
pub(super) fn install(repository: &Repository) -> Result<()> {
    let fingerprint = fingerprint(repository)?;
    let source = download(repository)?;
    let target = patched(repository);
    let fresh = repository.setup().join("rustdds_new");
    let old = repository.setup().join("rustdds_old");
    for leftover in [&fresh, &old] {
        remove(leftover)?;
    }
    copy_tree(&source, &fresh)?;
    apply(&patch_file(repository), &fresh)?;
    fingerprint.write(&fresh)?;
    if target.exists() {
        fs::rename(&target, &old).with_context(|| format!("cannot move {} away", target.display()))?;
    }
    fs::rename(&fresh, &target).with_context(|| format!("cannot move {} into place", fresh.display()))?;
    remove(&old)
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    Ok(())
}

/// Cargo's own download of the pinned crate: a package of nothing that depends on it makes cargo fetch and verify it.
fn download(repository: &Repository) -> Result<PathBuf> {
    let folder = repository.setup().join("rustdds_download");
    fs::create_dir_all(&folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let manifest = folder.join("Cargo.toml");
    fs::write(folder.join("lib.rs"), "").context("cannot write the download package")?;
    fs::write(&manifest, download_manifest()).context("cannot write the download package")?;
    let metadata = capture(
        cargo()
            .args(["metadata", "--format-version=1", "--manifest-path"])
            .arg(&manifest),
    )?;
    let lock = fs::read_to_string(folder.join("Cargo.lock")).context("cargo wrote no lock file")?;
    verify_checksum(&lock)?;
    crate_folder(&serde_json::from_str(&metadata).context("cargo metadata is not JSON")?)
}

fn download_manifest() -> String {
    format!(
        "[package]\nname = \"rustdds_download\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[lib]\npath = \"lib.rs\"\n\n\
         [workspace]\n\n[dependencies]\nrustdds = {{ version = \"={VERSION}\", default-features = false }}\n"
    )
}

fn verify_checksum(lock: &str) -> Result<()> {
    let found = lock_checksum(lock, "rustdds").context("cargo's lock file has no checksum of rustdds")?;
    ensure!(
        found == ARCHIVE_SHA256,
        "rustdds {VERSION} has checksum {found}, expected {ARCHIVE_SHA256}"
    );
    Ok(())
}

/// The checksum that a Cargo.lock has for one package.
fn lock_checksum<'a>(lock: &'a str, package: &str) -> Option<&'a str> {
    let name = format!("name = \"{package}\"");
    let entry = lock
        .split("[[package]]")
        .find(|entry| entry.lines().any(|line| line == name))?;
    entry
        .lines()
        .find_map(|line| line.strip_prefix("checksum = \"")?.strip_suffix('"'))
}

fn crate_folder(metadata: &Value) -> Result<PathBuf> {
    let packages = metadata["packages"]
        .as_array()
        .context("cargo metadata names no packages")?;
    let package = packages
        .iter()
        .find(|package| package["name"] == "rustdds" && package["version"] == VERSION)
        .with_context(|| format!("cargo did not download rustdds {VERSION}"))?;
    let manifest = package["manifest_path"]
        .as_str()
        .context("cargo metadata has no manifest_path")?;
    Ok(Path::new(manifest)
        .parent()
        .context("a manifest has a folder")?
        .to_owned())
}

/// Copies with fresh modification times, by which cargo sees that it must build again.
fn copy_tree(from: &Path, to: &Path) -> Result<()> {
    for source in files_below(from)? {
        let target = to.join(source.strip_prefix(from).expect("files_below stays below"));
        let folder = target.parent().expect("a file has a folder");
        fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        fs::copy(&source, &target).with_context(|| format!("cannot copy {}", source.display()))?;
    }
    Ok(())
}

/// Every hunk must fit exactly: a patch that almost fits belongs to another version.
fn apply(patch: &Path, folder: &Path) -> Result<()> {
    let arguments = [
        "-p1",
        "--fuzz=0",
        "--batch",
        "--forward",
        "--no-backup-if-mismatch",
        "--input",
    ];
    let result = capture(Command::new("patch").args(arguments).arg(patch).current_dir(folder));
    match result {
        Ok(said) => {
            said.lines().for_each(|line| eprintln!("    {line}"));
            Ok(())
        }
        Err(error) => bail!("{} does not fit rustdds {VERSION}: {error}", patch.display()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATCH: &str = "--- a/src/a.rs\n+++ b/src/a.rs\n@@ -1,3 +1,3 @@\n one\n-two\n+zwei\n three\n";

    fn crate_with(content: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("src")).unwrap();
        fs::write(folder.path().join("src/a.rs"), content).unwrap();
        let patch = folder.path().join("the.patch");
        fs::write(&patch, PATCH).unwrap();
        (folder, patch)
    }

    #[test]
    fn a_fitting_patch_changes_the_copy() {
        let (folder, patch) = crate_with("one\ntwo\nthree\n");
        apply(&patch, folder.path()).unwrap();
        assert_eq!(
            fs::read_to_string(folder.path().join("src/a.rs")).unwrap(),
            "one\nzwei\nthree\n"
        );
    }

    #[test]
    fn a_hunk_that_almost_fits_is_an_error_that_names_the_patch() {
        let (folder, patch) = crate_with("one\ntwo\nTHREE\n");
        let error = apply(&patch, folder.path()).unwrap_err().to_string();
        assert!(
            error.contains("the.patch does not fit") && error.contains("FAILED"),
            "{error}"
        );
    }

    #[test]
    fn the_checksum_is_that_of_the_named_package() {
        let lock = "[[package]]\nname = \"rustdds-derive\"\nchecksum = \"1\"\n\n[[package]]\nname = \"rustdds\"\nchecksum = \"2\"\n";
        assert_eq!(lock_checksum(lock, "rustdds"), Some("2"));
        assert_eq!(lock_checksum(lock, "other"), None);
    }

    #[test]
    fn an_archive_with_another_checksum_is_refused() {
        let lock = |checksum: &str| format!("[[package]]\nname = \"rustdds\"\nchecksum = \"{checksum}\"\n");
        verify_checksum(&lock(ARCHIVE_SHA256)).unwrap();
        assert!(
            verify_checksum(&lock("00"))
                .unwrap_err()
                .to_string()
                .contains("00, expected")
        );
    }

    #[test]
    fn another_version_is_not_taken_for_the_pinned_one() {
        let metadata = |version: &str| serde_json::json!({"packages": [{"name": "rustdds", "version": version, "manifest_path": "/r/Cargo.toml"}]});
        assert_eq!(crate_folder(&metadata(VERSION)).unwrap(), Path::new("/r"));
        assert!(crate_folder(&metadata("0.15.2")).is_err());
    }
}
