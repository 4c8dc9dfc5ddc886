//! The printed target: a board of black and white squares with a marker in every white one (`ChArUco`).
//!
//! The pattern is OpenCV's of today (`CharucoBoard` with `DICT_4X4_100`, the top left square black), so boards printed
//! with other tools do as well. Inner corners of the squares are what is measured: where two black squares touch, the
//! image is symmetric, so that blur and perspective do not shift the corner as they shift the centre of a dot.

use calib_targets_charuco::{CharucoBoard, CharucoBoardSpec, Dictionary, builtins};
use nalgebra::Point3;

use crate::error::CameraCalibrationError;

/// Markers of 4 x 4 bits, 100 of them.
const DICTIONARY: Dictionary = builtins::DICT_4X4_100;
/// Bits of a marker's side with the black border around it.
pub(crate) const SIDE: usize = 6;
/// Squares of a side.
const SQUARES: [usize; 2] = [3, 60];
/// Sides of a square, metres.
const SQUARE: [f64; 2] = [0.001, 0.5];
/// Side of a marker as part of its square's.
const MARKER: [f64; 2] = [0.4, 0.85];

/// A board, `columns` x `rows` squares.
///
/// Its frame: origin at the top left corner of the pattern, x to the right, y down, z into the board, metres. A camera
/// that looks straight at it has the same directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharucoTarget {
    columns: usize,
    rows: usize,
    square: f64,
    marker: f64,
}

impl CharucoTarget {
    /// What `rakelight calibrate target` prints: 13 x 9 squares of 15 mm with markers of 9 mm, for A4 across.
    pub const A4: Self = Self {
        columns: 13,
        rows: 9,
        square: 0.015,
        marker: 0.009,
    };

    /// A board of `columns` x `rows` squares (3 to 60 each, 200 in all at most); sides of squares and markers in metres.
    pub fn new(columns: usize, rows: usize, square: f64, marker: f64) -> Result<Self, CameraCalibrationError> {
        let refuse = |what, value, allowed: [f64; 2]| {
            Err(CameraCalibrationError::Target {
                what,
                value,
                allowed: format!("{} to {}", allowed[0], allowed[1]),
            })
        };
        for (what, count) in [("columns", columns), ("rows", rows)] {
            if !(SQUARES[0]..=SQUARES[1]).contains(&count) {
                return refuse(what, count as f64, SQUARES.map(|count| count as f64));
            }
        }
        if !(SQUARE[0]..=SQUARE[1]).contains(&square) {
            return refuse("side of a square (m)", square, SQUARE);
        }
        if !(MARKER[0]..=MARKER[1]).contains(&(marker / square)) {
            return refuse("side of a marker (m)", marker, MARKER.map(|part| part * square));
        }
        let markers = columns * rows / 2;
        let most = DICTIONARY.codes().len();
        if markers > most {
            return refuse("number of markers", markers as f64, [1.0, most as f64]);
        }
        Ok(Self {
            columns,
            rows,
            square,
            marker,
        })
    }

    /// Squares side by side.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Squares one below the other.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Side of a square, metres.
    pub fn square(&self) -> f64 {
        self.square
    }

    /// Side of a marker with its black border, metres.
    pub fn marker(&self) -> f64 {
        self.marker
    }

    /// Width and height of the pattern, metres.
    pub fn size(&self) -> [f64; 2] {
        [self.columns as f64 * self.square, self.rows as f64 * self.square]
    }

    /// Inner corners, counted row by row from the top left.
    pub fn corner_count(&self) -> usize {
        (self.columns - 1) * (self.rows - 1)
    }

    /// Where an inner corner is, in the target's frame.
    pub fn corner(&self, id: usize) -> Option<Point3<f64>> {
        let across = self.columns - 1;
        let at = |count: usize| (count + 1) as f64 * self.square;
        (id < self.corner_count()).then(|| Point3::new(at(id % across), at(id / across), 0.0))
    }

    /// Whether the pattern is black at a place in its frame; outside it is white.
    pub fn is_black(&self, x: f64, y: f64) -> bool {
        let (column, row) = ((x / self.square).floor(), (y / self.square).floor());
        if column < 0.0 || row < 0.0 || column >= self.columns as f64 || row >= self.rows as f64 {
            return false;
        }
        let (column, row) = (column as usize, row as usize);
        if (column + row).is_multiple_of(2) {
            return true;
        }
        let within = |place: f64, count: usize| {
            let from_edge = place - count as f64 * self.square - 0.5 * (self.square - self.marker);
            (from_edge / self.marker * SIDE as f64).floor()
        };
        let (bit_x, bit_y) = (within(x, column), within(y, row));
        let sides = 0.0..SIDE as f64;
        if !sides.contains(&bit_x) || !sides.contains(&bit_y) {
            return false;
        }
        self.is_bit_black(column, row, bit_x as usize, bit_y as usize)
    }

    /// A bit of the marker in a white square; the outermost are its border.
    pub(crate) fn is_bit_black(&self, column: usize, row: usize, bit_x: usize, bit_y: usize) -> bool {
        let inner = 1..SIDE - 1;
        if !inner.contains(&bit_x) || !inner.contains(&bit_y) {
            return true;
        }
        // Every second square before this one has a marker.
        let square = row * self.columns + column;
        let code = DICTIONARY.codes()[square / 2];
        (code >> ((bit_y - 1) * (SIDE - 2) + bit_x - 1)) & 1 == 1
    }

    pub(crate) fn board(&self) -> CharucoBoardSpec {
        let part = (self.marker / self.square) as f32;
        CharucoBoardSpec::new(
            self.rows as u32,
            self.columns as u32,
            1e3 * self.square as f32,
            part,
            DICTIONARY,
        )
    }

    pub(crate) fn checked_board(&self) -> Result<CharucoBoard, CameraCalibrationError> {
        CharucoBoard::new(self.board()).map_err(|error| CameraCalibrationError::Board {
            reason: error.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_markers_are_those_of_the_board_that_is_looked_for() {
        for target in [CharucoTarget::A4, CharucoTarget::new(8, 5, 0.02, 0.014).unwrap()] {
            let board = target.checked_board().unwrap();
            assert_eq!(board.marker_count(), target.columns * target.rows / 2);
            for (id, place) in board.iter_marker_positions() {
                let (column, row) = (place.u as usize, place.v as usize);
                let square = row * target.columns + column;
                assert_eq!(square / 2, id as usize, "{target:?}");
                assert_eq!((row + column) % 2, 1);
            }
            for id in 0..target.corner_count() {
                let drawn = target.corner(id).unwrap();
                let looked_for = board.charuco_object_xy(id as u32).unwrap();
                assert!((1e3 * drawn.x - f64::from(looked_for.x)).abs() < 1e-3, "{id}");
                assert!((1e3 * drawn.y - f64::from(looked_for.y)).abs() < 1e-3, "{id}");
            }
            assert_eq!(target.corner(target.corner_count()), None);
        }
    }

    #[test]
    fn boards_that_cannot_be_are_refused_with_what_can() {
        let said = |columns, rows, square, marker| {
            CharucoTarget::new(columns, rows, square, marker)
                .unwrap_err()
                .to_string()
        };
        assert_eq!(said(2, 9, 0.015, 0.009), "target: columns is 2, allowed are 3 to 60");
        assert!(said(13, 9, 0.0, 0.009).contains("side of a square (m) is 0, allowed are 0.001 to 0.5"));
        assert!(said(13, 9, f64::NAN, 0.009).contains("side of a square (m) is NaN"));
        assert!(said(13, 9, 0.015, 0.014).contains("side of a marker (m) is 0.014"));
        assert!(said(60, 60, 0.015, 0.009).contains("number of markers is 1800, allowed are 1 to 100"));
    }
}
