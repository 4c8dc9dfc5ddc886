//! Images, stacks and masks: shapes, crops, raw rows, refusals.

use imaging::{ByteOrder, ExposureStack, Image, ImagingError, Mask};
use proptest::prelude::*;

fn numbered(width: usize, height: usize) -> Image<u16> {
    Image::from_fn(width, height, |x, y| (y * width + x) as u16)
}

proptest! {
    #[test]
    fn a_crop_of_an_enlargement_is_an_enlargement_of_a_crop(
        (x, y, width, height) in (0_usize..5, 0_usize..5, 1_usize..5, 1_usize..5), factor in 1_usize..4
    ) {
        let image = numbered(10, 10);
        let crop_first = image.crop(x, y, width, height).unwrap().enlarge(factor).unwrap();
        let enlarged = image.enlarge(factor).unwrap();
        let enlarge_first = enlarged.crop(x * factor, y * factor, width * factor, height * factor).unwrap();
        prop_assert_eq!(crop_first, enlarge_first);
    }

    #[test]
    fn raw_rows_round_trip(width in 1_usize..9, height in 1_usize..9, padding in 0_usize..5, seed: u16) {
        let image = Image::from_fn(width, height, |x, y| seed.wrapping_mul(31).wrapping_add((x * 7 + y * 1000) as u16));
        let mut little = Vec::new();
        let mut big = Vec::new();
        for row in image.rows() {
            for value in row {
                little.extend(value.to_le_bytes());
                big.extend(value.to_be_bytes());
            }
            little.extend(vec![0xAA; padding]);
            big.extend(vec![0xAA; padding]);
        }
        let step = 2 * width + padding;
        prop_assert_eq!(&Image::from_bytes(width, height, step, ByteOrder::Little, &little).unwrap(), &image);
        prop_assert_eq!(&Image::from_bytes(width, height, step, ByteOrder::Big, &big).unwrap(), &image);
    }
}

#[test]
fn bytes_of_a_normal_map_are_its_floats() {
    let map = Image::filled(2, 1, [0.25_f32, -1.0, f32::INFINITY]);
    let again: Image<[f32; 3]> = Image::from_bytes(2, 1, 24, ByteOrder::NATIVE, map.as_bytes()).unwrap();
    assert_eq!(map, again);
}

#[test]
fn wrong_sizes_are_refused_with_numbers() {
    let count = Image::new(3, 2, vec![0_u8; 5]).unwrap_err();
    assert_eq!(count.to_string(), "an image of 3 x 2 needs 6 pixels, got 5");
    assert!(matches!(Image::<u8>::new(0, 2, vec![]), Err(ImagingError::Size { .. })));
    assert!(matches!(
        Image::<u8>::new(usize::MAX, 2, vec![]),
        Err(ImagingError::Size { .. })
    ));
    let short = Image::<u16>::from_bytes(4, 2, 8, ByteOrder::Little, &[0; 15]).unwrap_err();
    assert_eq!(
        short.to_string(),
        "raw image data has 15 bytes, 2 rows of 8 bytes are 16"
    );
    let step = Image::<u16>::from_bytes(4, 2, 7, ByteOrder::Little, &[0; 14]).unwrap_err();
    assert!(matches!(
        step,
        ImagingError::RowStep {
            step: 7,
            width: 4,
            pixel_bytes: 2
        }
    ));
    assert!(matches!(
        numbered(4, 4).crop(usize::MAX, 0, 2, 2),
        Err(ImagingError::CropOutside { .. })
    ));
    assert!(matches!(numbered(4, 4).enlarge(0), Err(ImagingError::Size { .. })));
    assert!(matches!(
        numbered(4, 4).enlarge(usize::MAX / 2),
        Err(ImagingError::Size { .. })
    ));
}

#[test]
fn a_stack_names_what_is_missing_double_odd_or_of_another_size() {
    let image = |value| Image::filled(4, 3, value);
    let stack = |images: Vec<(u8, Image<u16>)>| ExposureStack::new(&[1, 2], images, 65_535);
    let good = stack(vec![(2, image(2)), (0, image(0)), (1, image(1))]).unwrap();
    assert_eq!(good.channels().collect::<Vec<_>>(), [1, 2]);
    assert_eq!(good.dark().get(0, 0), Some(&0));
    assert_eq!(good.light(2).and_then(|light| light.get(0, 0)), Some(&2));
    assert!(good.light(0).is_none(), "the dark frame is no light");

    let missing = stack(vec![(1, image(1))]).unwrap_err();
    assert_eq!(
        missing.to_string(),
        "light channels [0, 2] are missing (0 is the dark frame); present are [1]"
    );
    let double = stack(vec![(0, image(0)), (1, image(1)), (1, image(1))]).unwrap_err();
    assert!(matches!(double, ImagingError::DuplicateChannel { channel: 1 }));
    let odd = stack(vec![(0, image(0)), (1, image(1)), (7, image(1)), (2, image(2))]).unwrap_err();
    assert!(matches!(odd, ImagingError::UnexpectedChannel { channel: 7, .. }));
    let size = stack(vec![(0, image(0)), (1, image(1)), (2, Image::filled(4, 4, 0))]).unwrap_err();
    assert_eq!(
        size.to_string(),
        "the image of light channel 2 is 4 x 4, expected 4 x 3"
    );
}

#[test]
fn a_mask_keeps_its_inside() {
    let mask = Mask::from_nonzero(&Image::from_fn(3, 1, |x, _| x as u8 * 100));
    assert_eq!(
        (
            mask.count(),
            mask.contains(0, 0),
            mask.contains(2, 0),
            mask.contains(3, 0)
        ),
        (2, false, true, false)
    );
    let mut image = Image::filled(3, 1, 5_u16);
    mask.fill_outside(&mut image, 0).unwrap();
    assert_eq!(image.pixels(), [0, 5, 5]);
    assert!(mask.fill_outside(&mut Image::filled(2, 1, 5_u16), 0).is_err());
}
