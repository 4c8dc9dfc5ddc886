//! Cargo's helpers: rustfmt, clippy and nextest.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, bail};

use super::{run_shown, succeeds};
use crate::process::{capture, cargo, find_program};
use crate::repository::Repository;

const COMPONENTS: [&str; 2] = ["rustfmt", "clippy"];
const NEXTEST_VERSION: &str = "0.9.143";

#[expect(clippy::unnecessary_wraps, reason = "the shape that all steps share")]
pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    let mut names: Vec<String> = missing_components().map(ToOwned::to_owned).collect();
    if find_nextest(repository).is_none() {
        names.push(format!("cargo-nextest {NEXTEST_VERSION} or newer"));
    }
    Ok((!names.is_empty()).then(|| names.join(", ")))
}

pub(super) fn install(repository: &Repository) -> Result<()> {
    let components: Vec<_> = missing_components().collect();
    if !components.is_empty() {
        install_components(&components)?;
    }
    if find_nextest(repository).is_none() {
        install_nextest(repository)?;
    }
    Ok(())
}

fn missing_components() -> impl Iterator<Item = &'static str> {
    // `cargo fmt --version` answers only if rustfmt is there: rustup's stand-in alone does not.
    COMPONENTS
        .into_iter()
        .filter(|name| !succeeds(cargo().args([name.trim_start_matches("rust"), "--version"])))
}

fn install_components(components: &[&str]) -> Result<()> {
    if find_program("rustup").is_none() {
        bail!(
            "this Rust was not installed by rustup. Install with its own package manager: {}",
            components.join(", ")
        );
    }
    run_shown(Command::new("rustup").args(["component", "add"]).args(components))
}

/// Built into the clone, so that a nextest of the person's own stays as it is.
fn install_nextest(repository: &Repository) -> Result<()> {
    eprintln!("    building cargo-nextest takes some minutes, once");
    run_shown(
        cargo()
            .args([
                "install",
                "--locked",
                "--quiet",
                "cargo-nextest",
                "--version",
                NEXTEST_VERSION,
            ])
            .args(["--no-default-features", "--features", "default-no-update", "--root"])
            .arg(tools(repository)),
    )
}

fn tools(repository: &Repository) -> PathBuf {
    repository.setup().join("tools")
}

/// The nextest to use, once set-up is complete.
pub(crate) fn nextest(repository: &Repository) -> Result<Command> {
    let Some(program) = find_nextest(repository) else {
        bail!("cargo-nextest is missing: run `cargo xtask setup`")
    };
    let mut command = Command::new(program);
    command.arg("nextest");
    Ok(command)
}

fn find_nextest(repository: &Repository) -> Option<PathBuf> {
    let ours = tools(repository).join("bin/cargo-nextest");
    find_program("cargo-nextest")
        .into_iter()
        .chain(ours.exists().then_some(ours))
        .find(|path| is_recent(path))
}

fn is_recent(program: &Path) -> bool {
    let answer = capture(Command::new(program).args(["nextest", "--version"]));
    answer.is_ok_and(|answer| version_in(&answer) >= parse_version(NEXTEST_VERSION))
}

/// The version in `cargo-nextest 0.9.143 (60fa45f63 2026-08-04)`.
fn version_in(answer: &str) -> Option<[u32; 3]> {
    answer.split_whitespace().nth(1).and_then(parse_version)
}

fn parse_version(text: &str) -> Option<[u32; 3]> {
    let parts: Vec<u32> = text.split('.').map(str::parse).collect::<Result<_, _>>().ok()?;
    parts.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn versions_compare_as_numbers() {
        let version = |text: &str| version_in(&format!("cargo-nextest {text} (60fa45f63 2026-08-04)\nrelease: x"));
        let pinned = parse_version(NEXTEST_VERSION);
        assert_eq!(version(NEXTEST_VERSION), pinned);
        assert!(version("0.9.99") < pinned && version("0.10.0") > pinned && version("1.0.0") > pinned);
    }

    #[test]
    fn an_unreadable_version_is_older_than_any() {
        assert!(version_in("unexpected") < parse_version(NEXTEST_VERSION));
        assert!(version_in("cargo-nextest 0.9.143-rc.1").is_none());
    }
}
