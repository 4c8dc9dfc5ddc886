//! `rakelight eval`: the simulated cameras' images against captures that were path-traced independently.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn eval(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rakelight"));
    command.args(["eval", "render"]).args(arguments);
    command.output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The captures; none, and a loud line, where they are missing.
fn captures() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/rig");
    if folder.is_dir() {
        return Some(folder);
    }
    println!("SKIPPED: no captures at {}", folder.display());
    None
}

#[test]
fn rendered_images_are_close_to_path_traced_ones() {
    let Some(folder) = captures() else { return };
    for scene in ["octagon2", "pyramid"] {
        let folder = folder.display().to_string();
        let output = eval(&["--truth", &folder, "--only", scene, "--bin", "4", "--limit", "5"]);
        let said = text(&output.stdout) + &text(&output.stderr);
        assert!(output.status.success(), "{said}");
        assert!(
            said.contains(&format!("{scene} C1")) && said.contains(&format!("{scene} C2")),
            "{said}"
        );
    }
}

#[test]
fn a_difference_beyond_the_limit_fails() {
    let Some(folder) = captures() else { return };
    let folder = folder.display().to_string();
    let output = eval(&[
        "--truth",
        &folder,
        "--only",
        "plate_flat",
        "--bin",
        "8",
        "--limit",
        "0.01",
    ]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("allowed are 0.01 %"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn a_folder_without_captures_is_bad_usage() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = eval(&["--truth", &folder.path().display().to_string()]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("no scene in"), "{}", text(&output.stderr));
}
