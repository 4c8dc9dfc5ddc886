//! Which parts of the image the target was seen in.

use nalgebra::Point2;

/// Cells of each side.
pub const CELLS: usize = 8;
/// Parts of each side that have names.
const PARTS: usize = 3;
const NAMES: [[&str; PARTS]; PARTS] = [
    ["upper left", "top", "upper right"],
    ["left", "middle", "right"],
    ["lower left", "bottom", "lower right"],
];

/// Corners in each of [`CELLS`] x [`CELLS`] cells of the image, rows from the top.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coverage {
    /// Row, column.
    pub counts: [[usize; CELLS]; CELLS],
}

impl Coverage {
    /// Counts pixels of an image of this width and height; what is outside does not count.
    pub fn of(pixels: impl Iterator<Item = Point2<f64>>, size: [usize; 2]) -> Self {
        let mut counts = [[0; CELLS]; CELLS];
        for pixel in pixels {
            let cell = |place: f64, side: usize| ((place + 0.5) / side as f64 * CELLS as f64).floor();
            let (column, row) = (cell(pixel.x, size[0]), cell(pixel.y, size[1]));
            let inside = 0.0..CELLS as f64;
            if inside.contains(&column) && inside.contains(&row) {
                counts[row as usize][column as usize] += 1;
            }
        }
        Self { counts }
    }

    /// Share of the cells that have corners, 0 to 1.
    pub fn share(&self) -> f64 {
        let filled = self.counts.iter().flatten().filter(|&&count| count > 0).count();
        filled as f64 / (CELLS * CELLS) as f64
    }

    /// The part of the image with the smallest share of cells seen, in words; none when all are.
    pub fn emptiest(&self) -> Option<&'static str> {
        let mut cells = [[(0, 0); PARTS]; PARTS];
        for (row, counts) in self.counts.iter().enumerate() {
            for (column, &count) in counts.iter().enumerate() {
                let part = &mut cells[row * PARTS / CELLS][column * PARTS / CELLS];
                *part = (part.0 + usize::from(count == 0), part.1 + 1);
            }
        }
        let parts = cells.as_flattened().iter().zip(NAMES.as_flattened());
        let share = |&(empty, all): &(usize, usize)| empty as f64 / all as f64;
        let worst = parts.max_by(|a, b| share(a.0).total_cmp(&share(b.0)))?;
        (worst.0.0 > 0).then_some(*worst.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_that_was_not_seen_is_named() {
        let grid = (0..60).flat_map(|x| (0..40).map(move |y| Point2::new(10.0 * f64::from(x), 10.0 * f64::from(y))));
        let whole = Coverage::of(grid.clone(), [600, 400]);
        assert_eq!((whole.share(), whole.emptiest()), (1.0, None));
        let part = Coverage::of(grid.filter(|pixel| pixel.x > 240.0 || pixel.y < 210.0), [600, 400]);
        assert_eq!(part.emptiest(), Some("lower left"));
        assert!(part.share() > 0.7 && part.share() < 0.9, "{}", part.share());
        let none = Coverage::of(
            [Point2::new(-3.0, 7.0), Point2::new(f64::NAN, 7.0)].into_iter(),
            [600, 400],
        );
        assert_eq!(none.counts, [[0; CELLS]; CELLS]);
    }
}
