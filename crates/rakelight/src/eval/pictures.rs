//! Pictures of differences.

use imaging::Image;

/// White pixels between the pictures of a sheet.
pub(super) const GAP: usize = 6;

/// Black at 0, by red and yellow to white at `white` and beyond; blue where there is no value.
pub(super) fn heat(values: &Image<f32>, white: f32) -> Image<[u8; 3]> {
    values.map(|&value| {
        if value.is_nan() {
            return [0, 60, 200];
        }
        let share = 3.0 * value.abs() / white;
        [share, share - 1.0, share - 2.0].map(|part| (part.clamp(0.0, 1.0) * 255.0) as u8)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_differences_are_brighter_and_missing_ones_blue() {
        let mut values = Image::filled(4, 1, 0.0_f32);
        values.pixels_mut().copy_from_slice(&[0.0, -1.0, 30.0, f32::NAN]);
        assert_eq!(
            heat(&values, 3.0).pixels(),
            [[0; 3], [255, 0, 0], [255; 3], [0, 60, 200]]
        );
    }
}
