//! Pictures: colours of normals, gray values, PNG, contact sheets, undone gamma.

use imaging::{
    DecodedPng, Image, ImagingError, contact_sheet, decode_png, encode_png, gamma_to_linear_mono16, gray_picture,
    gray_to_rgb, normal_picture,
};
use proptest::prelude::*;

#[test]
fn a_level_table_is_light_blue_and_nothing_is_black() {
    let normals = Image::new(
        4,
        1,
        vec![[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [f32::NAN; 3]],
    )
    .unwrap();
    let picture = normal_picture(&normals);
    assert_eq!(
        picture.pixels(),
        [[128, 128, 255], [255, 128, 128], [128, 0, 128], [0, 0, 0]]
    );
}

#[test]
fn gray_values_span_black_to_white() {
    let image = Image::new(5, 1, vec![-1.0_f32, 0.0, 1.0, 3.0, f32::NAN]).unwrap();
    assert_eq!(gray_picture(&image, 0.0, 2.0).unwrap().pixels(), [0, 0, 128, 255, 0]);
    assert_eq!(
        gray_picture(&Image::filled(1, 1, 65_535_u16), 0.0, 65_535.0)
            .unwrap()
            .pixels(),
        [255]
    );
    assert!(matches!(
        gray_picture(&image, 1.0, 1.0),
        Err(ImagingError::OutOfRange { .. })
    ));
}

proptest! {
    #[test]
    fn png_keeps_every_pixel(width in 1_usize..20, height in 1_usize..20, seed: u16) {
        let value = |x: usize, y: usize| (x * 251 + y * 7919).wrapping_mul(usize::from(seed) + 1) as u16;
        let deep = Image::from_fn(width, height, value);
        let gray = deep.map(|&v| v as u8);
        let color = deep.map(|&v| [v as u8, (v >> 4) as u8, (v >> 8) as u8]);
        prop_assert_eq!(decode_png(&encode_png(&gray).unwrap()).unwrap(), DecodedPng::Gray8(gray));
        prop_assert_eq!(decode_png(&encode_png(&color).unwrap()).unwrap(), DecodedPng::Rgb8(color));
        prop_assert_eq!(decode_png(&encode_png(&deep).unwrap()).unwrap(), DecodedPng::Gray16(deep));
    }

    #[test]
    fn damaged_png_never_panics(position in 0_usize..400, value: u8, length in 0_usize..400) {
        let mut bytes = encode_png(&Image::from_fn(16, 16, |x, y| (x * y) as u8)).unwrap();
        let position = position % bytes.len();
        bytes[position] = value;
        bytes.truncate(length.max(1));
        let _ = decode_png(&bytes);
    }
}

#[test]
fn a_truncated_png_is_an_error_and_so_is_one_with_transparency() {
    let bytes = encode_png(&Image::filled(64, 64, 7_u16)).unwrap();
    assert!(matches!(
        decode_png(&bytes[..bytes.len() / 2]),
        Err(ImagingError::PngDecode(_))
    ));
    let mut with_alpha = Vec::new();
    let mut encoder = png::Encoder::new(&mut with_alpha, 1, 1);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[1, 2, 3, 4]).unwrap();
    writer.finish().unwrap();
    let error = decode_png(&with_alpha).unwrap_err();
    assert_eq!(
        error.to_string(),
        "PNG is Rgba of 8 bit; readable are 8 and 16 bit gray and 8 bit RGB"
    );
}

#[test]
fn a_contact_sheet_places_pictures_row_by_row() {
    let picture = |gray| gray_to_rgb(&Image::filled(2, 2, gray));
    let sheet = contact_sheet(&[picture(1), picture(2), picture(3)], 2, 1).unwrap();
    assert_eq!((sheet.width(), sheet.height()), (5, 5));
    let at = |x, y| sheet.get(x, y).unwrap()[0];
    assert_eq!([at(0, 0), at(3, 1), at(1, 4), at(2, 0), at(4, 4)], [1, 2, 3, 255, 255]);
    assert!(contact_sheet(&[], 2, 1).is_none());
}

#[test]
fn undone_gamma_is_monotone_and_marks_only_clipped_pixels() {
    let ramp = Image::from_fn(256, 1, |x, _| [x as u8; 3]);
    let linear = gamma_to_linear_mono16(&ramp, 2.2).unwrap();
    assert!(linear.pixels().is_sorted());
    assert_eq!((linear.pixels()[0], linear.pixels()[255]), (0, 65_535));
    assert!(linear.pixels()[254] < 65_535);
    // (128 / 255)^2.2 = 0.2195
    assert!((f64::from(linear.pixels()[128]) / 65_534.0 - 0.2195).abs() < 1e-4);
    let one_clipped = gamma_to_linear_mono16(&Image::filled(1, 1, [10, 255, 10]), 2.2).unwrap();
    assert_eq!(one_clipped.pixels(), [65_535]);
    assert!(gamma_to_linear_mono16(&ramp, f64::NAN).is_err());
}
