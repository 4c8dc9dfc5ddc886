//! The YAML of `camera_calibration`: as others write it, broken in every way, scaled, and written again.

use std::path::Path;

use camera_aravis::CalibrationFile;
use devices::{Binning, Region};
use geometry::{PinholeCamera, PlumbBob};
use nalgebra::Point3;
use proptest::prelude::*;

/// As `camera_calibration`'s cameracalibrator saves it.
const STANDARD: &str = "\
image_width: 1536
image_height: 1536
camera_name: narrow_stereo/left
camera_matrix:
  rows: 3
  cols: 3
  data: [2181.80000,    0.     ,  767.10000,
            0.     , 2180.20000,  766.40000,
            0.     ,    0.     ,    1.     ]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.120000, 0.090000, 0.001000, -0.000500, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1., 0., 0.,
         0., 1., 0.,
         0., 0., 1.]
projection_matrix:
  rows: 3
  cols: 4
  data: [2150.,    0.,  768.,    -3.5,
            0., 2149.,  767.,    0.,
            0.,    0.,    1.,    0.]
";

const WHOLE: Binning = Binning {
    horizontal: 1,
    vertical: 1,
};

fn parse(text: &str) -> Result<CalibrationFile, String> {
    CalibrationFile::parse(text, Path::new("c1.yaml")).map_err(|error| error.to_string())
}

fn standard() -> CalibrationFile {
    parse(STANDARD).unwrap()
}

#[test]
fn the_standard_file_is_read() {
    let file = standard();
    assert_eq!(file.camera_name(), "narrow_stereo/left");
    assert_eq!((file.width(), file.height()), (1536, 1536));
    assert_eq!(file.camera_matrix()[..3], [2181.8, 0.0, 767.1]);
    assert_eq!(file.distortion_model(), "plumb_bob");
    assert_eq!(file.distortion_coefficients(), [-0.12, 0.09, 0.001, -0.0005, 0.0]);
    assert_eq!(file.rectification_matrix()[3..6], [0.0, 1.0, 0.0]);
    assert_eq!(file.projection_matrix()[..4], [2150.0, 0.0, 768.0, -3.5]);
    let camera = PinholeCamera::new(1536, 1536, [2181.8, 2180.2], [767.1, 766.4]).unwrap();
    let lens = PlumbBob {
        k1: -0.12,
        k2: 0.09,
        p1: 0.001,
        p2: -0.0005,
        k3: 0.0,
    };
    assert_eq!(*file.camera(), camera.with_distortion(lens));
}

#[test]
fn what_is_wrong_is_named_with_file_key_value_and_what_is_allowed() {
    let broken = |from: &str, to: &str| {
        assert!(STANDARD.contains(from), "{from}");
        parse(&STANDARD.replacen(from, to, 1)).unwrap_err()
    };
    for (from, to, expected) in [
        (
            "image_width: 1536",
            "image_width: 0",
            "c1.yaml: image_width is 0; allowed: 1 to 65536 pixels",
        ),
        (
            "rows: 3\n  cols: 3",
            "rows: 3\n  cols: 4",
            "c1.yaml: camera_matrix is 3 x 4 with 9 numbers; allowed: 3 x 3 with 9 numbers",
        ),
        (
            "cols: 4\n  data: [2150.,",
            "cols: 4\n  data: [",
            "projection_matrix is 3 x 4 with 11 numbers; allowed: 3 x 4 with 12 numbers",
        ),
        ("2181.80000", ".nan", "camera_matrix is NaN in [NaN, 0.0"),
        ("2181.80000", "0.0", "focal length (0, 2180.2) px must be positive"),
        (
            "distortion_model: plumb_bob",
            "distortion_model: equidistant",
            "distortion_model is \"equidistant\" with 5 coefficients; allowed: \"plumb_bob\" with 0, 4 or 5 coefficients",
        ),
        (
            "cols: 5",
            "cols: 4",
            "distortion_coefficients is 1 x 4 with 5 numbers; allowed: one row",
        ),
        ("[2150.,", "[-2150.,", "projection_matrix is [-2150.0"),
        ("image_height: 1536\n", "", "c1.yaml: missing field `image_height`"),
        (
            "image_width: 1536",
            "image_width: wide",
            "c1.yaml: image_width: invalid type: string \"wide\"",
        ),
        ("image_width: 1536", "image_width: [", "c1.yaml: "),
    ] {
        let error = broken(from, to);
        assert!(error.contains(expected), "{error:?} does not say {expected:?}");
    }
}

#[test]
fn only_plain_paths_are_read() {
    let refused = |path: &str| CalibrationFile::read(path).unwrap_err().to_string();
    assert_eq!(
        refused("package://cell/c1.yaml"),
        "calibration file \"package://cell/c1.yaml\": packages are not searched for; allowed: the plain path of a YAML \
         file"
    );
    assert!(refused("file:///tmp/c1.yaml").contains("URLs are not read"));
    assert!(refused("").contains("it is empty"));
    let folder = tempfile::tempdir().unwrap();
    let absent = folder.path().join("absent.yaml");
    assert!(refused(absent.to_str().unwrap()).contains("cannot read it"));
    let nowhere = folder.path().join("no_folder/c1.yaml");
    assert!(
        standard()
            .write(nowhere.to_str().unwrap())
            .unwrap_err()
            .to_string()
            .contains("cannot write it")
    );
}

#[test]
fn a_written_file_reads_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c1.yaml");
    let path = path.to_str().unwrap();
    let file = standard();
    file.write(path).unwrap();
    assert_eq!(CalibrationFile::read(path).unwrap(), file);
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "something was left beside it"
    );
    assert!(
        file.to_yaml()
            .starts_with("image_width: 1536\nimage_height: 1536\ncamera_name: \"narrow_stereo/left\"\n")
    );
}

/// A point's pixel in the whole image, carried into the smaller one by hand.
fn carried(whole: [f64; 2], binning: Binning, region: Region) -> [f64; 2] {
    let carry = |pixel: f64, factor: u32, start: u32| (pixel + 0.5) / f64::from(factor) - 0.5 - f64::from(start);
    [
        carry(whole[0], binning.horizontal, region.x),
        carry(whole[1], binning.vertical, region.y),
    ]
}

#[test]
fn a_scaled_camera_sees_a_point_where_the_smaller_image_has_it() {
    let binning = Binning {
        horizontal: 2,
        vertical: 4,
    };
    let region = Region {
        x: 100,
        y: 50,
        width: 512,
        height: 256,
    };
    let file = standard();
    let scaled = file.scaled(binning, Some(region)).unwrap();
    assert_eq!((scaled.width(), scaled.height()), (512, 256));
    let point = Point3::new(0.02, -0.05, 0.4);
    let whole = file.camera().project(&point).unwrap();
    let seen = scaled.camera().project(&point).unwrap();
    let expected = carried([whole.x, whole.y], binning, region);
    assert!((seen.x - expected[0]).abs() < 1e-9 && (seen.y - expected[1]).abs() < 1e-9);
    // The rectified image and the stereo term are scaled alike.
    let (p, q) = (file.projection_matrix(), scaled.projection_matrix());
    let [u, v] = carried([p[2], p[6]], binning, region);
    assert_eq!([q[0], q[3], q[5]].as_slice(), [p[0] / 2.0, p[3] / 2.0, p[5] / 4.0]);
    assert!((q[2] - u).abs() < 1e-9 && (q[6] - v).abs() < 1e-9);
    assert_eq!(scaled.distortion_coefficients(), file.distortion_coefficients());
    // What was cut is a calibration like any other.
    assert_eq!(parse(&scaled.to_yaml()).unwrap(), scaled);
}

#[test]
fn what_does_not_fit_the_image_is_refused() {
    let file = standard();
    assert_eq!(file.scaled(WHOLE, None).unwrap(), file);
    let region = |x, width| Region {
        x,
        y: 0,
        width,
        height: 16,
    };
    let refused = |binning, region| file.scaled(binning, region).unwrap_err().to_string();
    assert_eq!(
        refused(
            Binning {
                horizontal: 2,
                vertical: 2
            },
            Some(region(700, 100))
        ),
        "a region of 100 x 16 at (700, 0) does not fit the calibrated image of 768 x 768 pixels"
    );
    assert!(refused(WHOLE, Some(region(0, 0))).contains("does not fit"));
    assert!(refused(WHOLE, Some(region(u32::MAX, 2))).contains("does not fit"));
    let none = Binning {
        horizontal: 0,
        vertical: 1,
    };
    assert!(refused(none, None).contains("binning of 0 x 1"));
}

proptest! {
    #[test]
    fn every_camera_survives_the_file(
        name in "[ -~]{1,24}",
        focal in prop::array::uniform2(1.0..1e5_f64),
        principal in prop::array::uniform2(-1e4..1e4_f64),
        side in 1_usize..9000,
    ) {
        let camera = PinholeCamera::new(side, side + 1, focal, principal).unwrap();
        let file = CalibrationFile::new(name, &camera);
        let read = CalibrationFile::parse(&file.to_yaml(), Path::new("any")).unwrap();
        prop_assert_eq!(read, file);
    }

    #[test]
    fn no_text_makes_it_panic(text in ".{0,400}", at in 0_usize..STANDARD.len()) {
        let _ = parse(&text).is_ok();
        let mixed = format!("{}{text}{}", &STANDARD[..at], &STANDARD[at..]);
        let _ = parse(&mixed).is_ok();
    }
}
