//! What is written comes back; what is wrong is named.

use calibration_files::{LightResidual, LightsFile, MadeWith, PlacementResidual};
use photometric::LightRig;

fn file() -> LightsFile {
    let made_with = vec![MadeWith {
        camera: "c1".into(),
        width: 768,
        height: 768,
    }];
    let residuals = vec![LightResidual {
        channel: 1,
        samples: 6000,
        median_sigmas: 0.7,
        rms_percent: 4.2,
    }];
    let used = PlacementResidual {
        placement: "hemi00".into(),
        centre: Some([0.4, -0.1]),
        median_sigmas: Some(0.7),
        left_out: None,
    };
    let missed = PlacementResidual {
        placement: "hemi01".into(),
        centre: None,
        median_sigmas: None,
        left_out: Some("the target was not found".into()),
    };
    LightsFile::new(&LightRig::nominal(), "2026-11-25", made_with, residuals).with_placements(vec![used, missed])
}

#[test]
fn a_file_comes_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lights.yaml");
    file().write(&path).unwrap();
    let read = LightsFile::read(&path).unwrap();
    assert_eq!(read, file());
    for (ours, drawn) in read.rig().unwrap().panels().iter().zip(LightRig::nominal().panels()) {
        assert!((ours.rectangle.centre - drawn.rectangle.centre).norm() < 1e-12);
        assert!((ours.rectangle.facing.into_inner() - drawn.rectangle.facing.into_inner()).norm() < 1e-12);
    }
}

/// The error of a text in which one line was exchanged.
fn error(from: &str, to: &str) -> String {
    let text = file().to_text().unwrap();
    assert!(text.contains(from), "{text}");
    LightsFile::from_text(&text.replacen(from, to, 1))
        .unwrap_err()
        .to_string()
}

#[test]
fn what_is_wrong_is_named() {
    assert_eq!(
        error("version: 1", "version: 7"),
        "version 7 of the format, understood is 1"
    );
    assert!(error("frame:", "frames:").contains("frames"));
    assert!(error("channel: 2", "channel: 1").contains("light channel 1 is described twice"));
    assert!(error("radiance: 1.0", "radiance: .nan").contains("intensity NaN"));
    assert!(error("radiance: 1.0", "radiance: -1.0").contains("-1"));
    let shortened = error("- -1.0\n", "- -0.5\n");
    assert!(
        shortened.contains("light 5: right") && shortened.contains("unit vectors"),
        "{shortened}"
    );
    assert!(LightsFile::from_text("").is_err());
    let missing = LightsFile::read(std::path::Path::new("nowhere.yaml"))
        .unwrap_err()
        .to_string();
    assert!(missing.contains("nowhere.yaml"), "{missing}");
}

#[test]
fn another_camera_is_refused_by_name() {
    file().require_camera("C1", 384, 384).unwrap();
    let refused = file().require_camera("c3", 1536, 1536).unwrap_err().to_string();
    assert_eq!(refused, "made with c1 (768 x 768), not with camera c3 at 1536 x 1536");
}

#[test]
fn a_file_from_before_placements_were_kept_is_read() {
    let text = file().to_text().unwrap();
    let (old, _) = text.split_once("placements:").unwrap();
    let read = LightsFile::from_text(old).unwrap();
    assert!(read.placements.is_empty() && read.residuals == file().residuals);
}
