//! Plain least squares with the rig as drawn, on path-traced captures whose plates have one known normal each.
//!
//! The figures are this method's, not the rig's: shadows, the near field and bounced light are all unmodelled.

mod common;

use std::path::{Path, PathBuf};

use common::angle;
use imaging::{DecodedPng, ExposureStack, Image, Mask, decode_png};
use photometric::{LeastSquaresOptions, least_squares_normals, nominal_panels};

/// Above the middle of the mat, where the objects stand; base frame, metres.
const REFERENCE: [f64; 3] = [0.43, 0.0, 0.015];

fn scene(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/rig/objects")
        .join(name);
    if folder.exists() {
        return Some(folder);
    }
    println!("SKIPPED: {} is missing", folder.display());
    None
}

fn png(path: &Path) -> DecodedPng {
    decode_png(&std::fs::read(path).unwrap()).unwrap()
}

fn raw(path: &Path) -> Image<u16> {
    let DecodedPng::Gray16(image) = png(path) else {
        panic!("{} is not 16 bit gray", path.display())
    };
    image
}

fn mask(path: &Path) -> Mask {
    let DecodedPng::Gray8(image) = png(path) else {
        panic!("{} is not 8 bit gray", path.display())
    };
    Mask::from_nonzero(&image)
}

fn normals(view: &Path) -> Image<[f32; 3]> {
    let lit = (1..=7_u8).map(|channel| (channel, raw(&view.join(format!("L{channel}.png")))));
    let images = std::iter::once((0, raw(&view.join("dark.png")))).chain(lit);
    let stack = ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, 65_535).unwrap();
    let lights = nominal_panels().map(|panel| panel.directional_light(REFERENCE).unwrap());
    least_squares_normals(&stack, &lights, &LeastSquaresOptions::default())
        .unwrap()
        .normals
}

/// Mean angle in degrees to `truth` over the object; a pixel without a normal counts 90.
fn mean_angular_error(view: &Path, truth: [f32; 3]) -> f64 {
    let (normals, mask) = (normals(view), mask(&view.join("mask.png")));
    let inside = normals
        .pixels()
        .iter()
        .zip(mask.as_image().pixels())
        .filter(|&(_, &inside)| inside != 0);
    let error = |normal: [f32; 3]| if normal[0].is_nan() { 90.0 } else { angle(normal, truth) };
    inside.map(|(&normal, _)| error(normal)).sum::<f64>() / mask.count() as f64
}

#[test]
fn a_level_plate_comes_out_level() {
    let Some(folder) = scene("plate_flat") else { return };
    for camera in ["C1", "C2"] {
        let error = mean_angular_error(&folder.join(camera), [0.0, 0.0, 1.0]);
        println!("plate_flat {camera}: {error:.2} degrees");
        assert!(error < 6.0, "{camera}: {error} degrees");
    }
}

#[test]
fn a_tilted_plate_leans_the_right_way() {
    let Some(folder) = scene("wedge_flat") else { return };
    let description = std::fs::read_to_string(folder.join("scene.json")).unwrap();
    let description: serde_json::Value = serde_json::from_str(&description).unwrap();
    let object = description["objects"]
        .as_array()
        .unwrap()
        .iter()
        .find(|object| object["role"] == "object")
        .unwrap();
    let pose = &object["T_base_obj"];
    // The plate is tilted by 45 degrees: its normal is (1, 0, 1) in the object's frame.
    let along = |row: usize, column: usize| pose[row][column].as_f64().unwrap();
    let truth = [0, 1, 2].map(|row| ((along(row, 0) + along(row, 2)) * 0.5_f64.sqrt()) as f32);
    // C2 also sees the plate's edges, so that one normal is not the truth everywhere.
    let error = mean_angular_error(&folder.join("C1"), truth);
    println!("wedge_flat C1: {error:.2} degrees");
    assert!(error < 27.0, "{error} degrees off a plate tilted by 45");
}
