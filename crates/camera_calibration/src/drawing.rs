//! The target to print.

use std::fmt::Write;

use crate::target::{CharucoTarget, SIDE};

impl CharucoTarget {
    /// The pattern to scale with a white margin of one square around it, for printing at 100 %.
    pub fn to_svg(&self) -> String {
        let [width, height] = self.size().map(|side| 1e3 * (side + 2.0 * self.square()));
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.3}mm\" height=\"{height:.3}mm\" \
             viewBox=\"0 0 {width:.3} {height:.3}\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<path \
             shape-rendering=\"crispEdges\" d=\""
        );
        for [x, y, side_x, side_y] in self.black_rectangles() {
            let [x, y] = [x, y].map(|place| 1e3 * (place + self.square()));
            let [side_x, side_y] = [side_x, side_y].map(|side| 1e3 * side);
            // `String` never fails to take text.
            let _ = writeln!(text, "M{x:.4} {y:.4}h{side_x:.4}v{side_y:.4}h-{side_x:.4}z");
        }
        text.push_str("\"/>\n</svg>\n");
        text
    }

    /// Left, top, width and height of everything black, metres; bits of a row that touch are one.
    fn black_rectangles(&self) -> Vec<[f64; 4]> {
        let mut found = Vec::new();
        for (row, column) in (0..self.rows()).flat_map(|row| (0..self.columns()).map(move |column| (row, column))) {
            let [left, top] = [column as f64 * self.square(), row as f64 * self.square()];
            if (column + row).is_multiple_of(2) {
                found.push([left, top, self.square(), self.square()]);
                continue;
            }
            let (margin, bit) = (0.5 * (self.square() - self.marker()), self.marker() / SIDE as f64);
            for bit_y in 0..SIDE {
                let mut from = 0;
                while from < SIDE {
                    let run = (from..SIDE)
                        .take_while(|&bit_x| self.is_bit_black(column, row, bit_x, bit_y))
                        .count();
                    if run > 0 {
                        let (x, y) = (left + margin + from as f64 * bit, top + margin + bit_y as f64 * bit);
                        found.push([x, y, run as f64 * bit, bit]);
                    }
                    from += run.max(1);
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drawing_is_black_where_the_pattern_is() {
        let target = CharucoTarget::A4;
        let rectangles = target.black_rectangles();
        let mut random = fastrand::Rng::with_seed(4);
        for _ in 0..20_000 {
            let [x, y] = target.size().map(|side| random.f64() * side);
            let drawn = rectangles.iter().any(|[left, top, width, height]| {
                (0.0..*width).contains(&(x - left)) && (0.0..*height).contains(&(y - top))
            });
            assert_eq!(drawn, target.is_black(x, y), "({x}, {y})");
        }
        let svg = target.to_svg();
        assert!(
            svg.starts_with("<svg") && svg.contains("width=\"225.000mm\" height=\"165.000mm\""),
            "{svg:.200}"
        );
        assert_eq!(svg.matches('M').count(), rectangles.len());
    }
}
