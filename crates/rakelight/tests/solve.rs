//! `calibrate lights` and `solve` as a user calls them.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use recording::Bag;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn rakelight(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rakelight"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_recorded_capture_becomes_a_bag_of_results_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let bag = repository().join("bags/octagon2");
    let bag = bag.to_str().unwrap();
    let output = rakelight(folder.path(), &["solve", bag, "-o", "results", "--png", "png"]);
    let (said, complained) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{said}{complained}");
    assert!(said.contains("2 solved") || said.contains("1 solved"), "{said}");
    assert!(complained.contains("where the rig was drawn"), "{complained}");
    let results = Bag::open(folder.path().join("results")).unwrap();
    let topics: Vec<&str> = results.topics().iter().map(|topic| topic.name.as_str()).collect();
    for wanted in [
        "normals",
        "depth",
        "edges",
        "edge_confidence",
        "confidence",
        "albedo",
        "shadows",
    ] {
        assert!(topics.contains(&format!("/cell/c1/{wanted}").as_str()), "{topics:?}");
    }
    let pictures = std::fs::read_dir(folder.path().join("png")).unwrap().count();
    assert!(pictures >= 3, "{pictures}");

    let again = rakelight(folder.path(), &["solve", bag, "-o", "results"]);
    assert_eq!(again.status.code(), Some(2), "{}", text(&again.stderr));
    assert!(text(&again.stderr).contains("results"), "{}", text(&again.stderr));
}

#[test]
fn what_cannot_be_solved_or_calibrated_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let missing = rakelight(folder.path(), &["solve", "nowhere", "-o", "results"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(
        text(&missing.stderr).contains("no bag at nowhere"),
        "{}",
        text(&missing.stderr)
    );

    let bag = repository().join("bags/octagon2");
    let bag = bag.to_str().unwrap();
    let few = rakelight(
        folder.path(),
        &["calibrate", "lights", "--bag", bag, "-o", "lights.yaml"],
    );
    assert_eq!(few.status.code(), Some(1), "{}", text(&few.stdout));
    assert!(text(&few.stderr).contains("placements"), "{}", text(&few.stderr));
    assert!(!folder.path().join("lights.yaml").exists());

    std::fs::write(folder.path().join("bad.yaml"), "version: 1\n").unwrap();
    let bad = rakelight(folder.path(), &["solve", bag, "--lights", "bad.yaml", "-o", "results"]);
    assert_eq!(bad.status.code(), Some(2));
    assert!(text(&bad.stderr).contains("bad.yaml"), "{}", text(&bad.stderr));
    assert!(!folder.path().join("results").exists());
}

#[test]
fn a_calibration_from_bags_is_not_written_over_another() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("lights.yaml"), "mine").unwrap();
    let bag = repository().join("bags/octagon2");
    let refused = rakelight(folder.path(), &["calibrate", "lights", "--bag", bag.to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("--force"), "{}", text(&refused.stderr));
    assert_eq!(
        std::fs::read_to_string(folder.path().join("lights.yaml")).unwrap(),
        "mine"
    );
}
