//! `calibrate target`, `cameras` and `hand-eye` as a user calls them.

mod bag;
#[path = "../../../camera_calibration/tests/calibration/rendering.rs"]
mod rendering;

use std::path::Path;
use std::process::{Command, Output};

use bag::Stand;
use calibration_files::CameraPosesFile;
use camera_aravis::CalibrationFile;
use camera_calibration::CharucoTarget;
use geometry::nalgebra::UnitQuaternion;
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use imaging::{Image, encode_png};
use rendering::{Picture, target_at};

const TARGET: CharucoTarget = CharucoTarget::A4;

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

/// A small camera behind a lens that bends.
fn camera() -> PinholeCamera {
    let lens = PlumbBob {
        k1: -0.1,
        k2: 0.05,
        ..PlumbBob::default()
    };
    let camera = PinholeCamera::new(480, 480, [681.8, 682.5], [240.9, 238.1]).unwrap();
    camera.with_distortion(lens)
}

fn pose(turn: [f64; 3], shift: [f64; 3]) -> RigidTransform {
    RigidTransform::from_parts(shift.into(), UnitQuaternion::from_scaled_axis(turn.into()))
}

fn flange_from_camera() -> RigidTransform {
    pose([0.05, -0.02, 1.55], [0.07, 0.01, 0.03])
}

fn base_from_target() -> RigidTransform {
    pose([3.1, 0.03, 0.0], [0.33, 0.07, 0.002])
}

/// Stands of the arm from which the target is seen from all sides and in all parts of the image.
fn stands(count: usize) -> Vec<Stand> {
    let stand = |index: usize| {
        let angle = index as f64 * 2.4;
        let turn = [
            0.45 * angle.cos(),
            0.45 * (1.3 * angle).sin(),
            0.6 * (1.7 * angle).sin(),
        ];
        let column = (index % 3) as f64 - 1.0;
        let row = (index / 3 % 3) as f64 - 1.0;
        let camera_from_target = target_at(&TARGET, turn, [0.03 * column, 0.045 * row, 0.36 + 0.03 * angle.cos()]);
        Stand {
            base_from_flange: base_from_target() * camera_from_target.inverse() * flange_from_camera().inverse(),
            camera_from_target,
        }
    };
    (0..count).map(stand).collect()
}

#[test]
fn a_bag_gives_the_lens_and_then_the_place_on_the_arm() {
    let folder = tempfile::tempdir().unwrap();
    bag::write(&folder.path().join("bag"), &TARGET, &camera(), &stands(12));

    // Without a lens there is no hand-eye.
    let hand_eye = ["calibrate", "hand-eye", "--eye-in-hand", "c1", "--bag", "bag"];
    let blind = rakelight(folder.path(), &hand_eye);
    assert_eq!(blind.status.code(), Some(2), "{}", text(&blind.stderr));
    assert!(
        text(&blind.stderr).contains("--lens c1=FILE"),
        "{}",
        text(&blind.stderr)
    );

    let cameras = ["calibrate", "cameras", "--bag", "bag", "-o", "lens", "--binning", "2"];
    let output = rakelight(folder.path(), &cameras);
    let said = text(&output.stdout);
    assert!(output.status.success(), "{said}{}", text(&output.stderr));
    assert!(
        said.contains("stand-3, c1: ") && said.contains("the worst") && said.contains("written: lens/c1.yaml"),
        "{said}"
    );
    let file = CalibrationFile::read(folder.path().join("lens/c1.yaml").to_str().unwrap()).unwrap();
    assert_eq!((file.width(), file.height()), (960, 960));
    let truth = camera().enlarged(2).unwrap();
    for axis in 0..2 {
        assert!(
            (file.camera().focal()[axis] / truth.focal()[axis] - 1.0).abs() < 1e-3,
            "{:?}",
            file.camera()
        );
        assert!(
            (file.camera().principal()[axis] - truth.principal()[axis]).abs() < 1.0,
            "{:?}",
            file.camera()
        );
    }
    let again = rakelight(folder.path(), &cameras);
    assert_eq!(again.status.code(), Some(2));
    assert!(text(&again.stderr).contains("--force"), "{}", text(&again.stderr));

    let output = rakelight(folder.path(), &[&hand_eye[..], &["--lens", "c1=lens/c1.yaml"]].concat());
    let said = text(&output.stdout);
    assert!(output.status.success(), "{said}{}", text(&output.stderr));
    assert!(said.contains("link_eef_from_c1_optical_frame: ["), "{said}");
    let poses = CameraPosesFile::read(&folder.path().join("cameras.yaml")).unwrap();
    let c1 = poses.camera("c1").unwrap();
    assert_eq!(
        (c1.parent_frame_id.as_str(), c1.frame_id.as_str()),
        ("link_eef", "c1_optical_frame")
    );
    let (found, truth) = (c1.parent_from_camera().unwrap(), flange_from_camera());
    assert!((found.translation() - truth.translation()).norm() < 0.2e-3, "{found:?}");
    assert!(
        found.rotation().angle_to(&truth.rotation()).to_degrees() < 0.02,
        "{found:?}"
    );
}

fn put_png(path: &Path, image: &Image<u16>) {
    std::fs::write(path, encode_png(image).unwrap()).unwrap();
}

#[test]
fn pictures_that_do_not_do_are_named_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    for index in 0..3 {
        let flat = target_at(
            &TARGET,
            [0.0, 0.0, 0.2 * f64::from(index)],
            [0.0, 0.0, 0.34 + 0.02 * f64::from(index)],
        );
        let image = Picture::USUAL.take(&TARGET, &camera(), &flat);
        put_png(&images.join(format!("{index}.png")), &image);
    }
    put_png(&images.join("dark.png"), &Image::filled(480, 480, 11));
    let calibrate = ["calibrate", "cameras", "--images", "images", "-o", "lens"];
    let output = rakelight(folder.path(), &calibrate);
    let (said, complained) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(1), "{said}{complained}");
    assert!(said.contains("dark.png, c1: NOT FOUND: the image is all 11"), "{said}");
    assert!(complained.contains("tilt"), "{complained}");
    assert!(!folder.path().join("lens").exists());

    // Fewer than three are left.
    let output = rakelight(folder.path(), &[&calibrate[..], &["--without", "0.png"]].concat());
    assert!(
        text(&output.stdout).contains("0.png, c1: left out as wished"),
        "{}",
        text(&output.stdout)
    );
    assert!(
        text(&output.stderr).contains("2 views can be used, needed are 3"),
        "{}",
        text(&output.stderr)
    );

    let hand_eye = [
        "calibrate",
        "hand-eye",
        "--eye-to-hand",
        "c1",
        "--images",
        "images",
        "--lens",
        "c1=none.yaml",
    ];
    let output = rakelight(folder.path(), &hand_eye);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("none.yaml"), "{}", text(&output.stderr));

    std::fs::write(
        images.join("poses.json"),
        r#"{"views": [{"image": "0.png", "pose": [1]}]}"#,
    )
    .unwrap();
    let output = rakelight(folder.path(), &calibrate);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("unknown field `pose`"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn a_standing_camera_is_found_from_a_folder_of_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    let base_from_camera = pose([2.2, 2.2, 0.1], [0.35, 0.05, 0.75]);
    let flange_from_target = pose([0.0, 3.1, 0.1], [0.09, -0.06, 0.05]);
    let views: Vec<String> = stands(9)
        .iter()
        .enumerate()
        .map(|(index, stand)| {
            put_png(&images.join(format!("{index}.png")), &Picture::USUAL.take(&TARGET, &camera(), &stand.camera_from_target));
            let flange = base_from_camera * stand.camera_from_target * flange_from_target.inverse();
            let ([x, y, z], [qx, qy, qz, qw]): ([f64; 3], _) = (flange.translation().into(), flange.quaternion_xyzw());
            format!(r#"{{"image": "{index}.png", "camera": "c2", "base_from_flange": [{x}, {y}, {z}, {qx}, {qy}, {qz}, {qw}]}}"#)
        })
        .collect();
    std::fs::write(
        images.join("poses.json"),
        format!(r#"{{"views": [{}]}}"#, views.join(", ")),
    )
    .unwrap();
    let lens = folder.path().join("c2.yaml");
    CalibrationFile::new("c2", &camera().enlarged(2).unwrap())
        .write(lens.to_str().unwrap())
        .unwrap();
    let calibrate = [
        "calibrate",
        "hand-eye",
        "--eye-to-hand",
        "c2",
        "--images",
        "images",
        "--lens",
        "c2=c2.yaml",
    ];
    let output = rakelight(folder.path(), &calibrate);
    assert!(
        output.status.success(),
        "{}{}",
        text(&output.stdout),
        text(&output.stderr)
    );
    let poses = CameraPosesFile::read(&folder.path().join("cameras.yaml")).unwrap();
    let c2 = poses.camera("c2").unwrap();
    assert_eq!(c2.parent_frame_id, "link_base");
    let found = c2.parent_from_camera().unwrap();
    assert!(
        (found.translation() - base_from_camera.translation()).norm() < 0.2e-3,
        "{found:?}"
    );
    assert!(
        found.rotation().angle_to(&base_from_camera.rotation()).to_degrees() < 0.02,
        "{found:?}"
    );
}

#[test]
fn the_target_is_drawn_and_wrong_usage_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let drawn = rakelight(folder.path(), &["calibrate", "target", "--square", "0.02"]);
    assert!(drawn.status.success(), "{}", text(&drawn.stderr));
    assert!(
        text(&drawn.stdout).contains("260.0 x 180.0 mm"),
        "{}",
        text(&drawn.stdout)
    );
    assert!(
        std::fs::read_to_string(folder.path().join("target.svg"))
            .unwrap()
            .contains("width=\"300.000mm\"")
    );

    for (arguments, says) in [
        (&["calibrate", "target"][..], "--force"),
        (
            &["calibrate", "target", "--square", "9", "-o", "b.svg"],
            "allowed are 0.001 to 0.5",
        ),
        (&["calibrate", "cameras"], "no pictures"),
        (&["calibrate", "cameras", "--bag", "nowhere"], "no bag at nowhere"),
        (&["calibrate", "cameras", "--fix", "everything"], "everything"),
        (&["calibrate", "hand-eye", "--bag", "nowhere"], "--eye-in-hand"),
        (
            &["calibrate", "hand-eye", "--eye-to-hand", "c2", "--scene-camera", "c1"],
            "cannot be used with",
        ),
    ] {
        let refused = rakelight(folder.path(), arguments);
        let complained = text(&refused.stderr);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}: {complained}");
        assert!(complained.contains(says), "{arguments:?}: {complained}");
    }
}
