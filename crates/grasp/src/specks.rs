//! Holes in a surface that are none.

/// A hole of less than this does not close the surface, square metres: under dark print noise takes the normal from a
/// pixel here and there, or turns it. A real bore of less than two millimetres is left to the test of the edges.
pub(crate) const SPECK: f64 = 3.2e-6;

/// Opens what is closed in a square of cells with this pitch (metres) where it hangs together, corners included, over
/// less than a speck's area (square metres) and does not reach the square's border.
pub(crate) fn open_specks(open: &mut [bool], side: usize, pitch: f64, speck: f64) {
    let most = (speck / (pitch * pitch)) as usize;
    let mut seen = open.to_vec();
    let mut hole = Vec::new();
    for start in 0..open.len() {
        if seen[start] {
            continue;
        }
        hole.clear();
        hole.push(start);
        seen[start] = true;
        let mut at_border = false;
        let mut next = 0;
        while let Some(&at) = hole.get(next) {
            next += 1;
            let (x, y) = (at % side, at / side);
            at_border |= x == 0 || y == 0 || x + 1 == side || y + 1 == side;
            for y in y.saturating_sub(1)..(y + 2).min(side) {
                for x in x.saturating_sub(1)..(x + 2).min(side) {
                    if !std::mem::replace(&mut seen[y * side + x], true) {
                        hole.push(y * side + x);
                    }
                }
            }
        }
        if hole.len() <= most && !at_border {
            for &at in &hole {
                open[at] = true;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Cells of 1 mm, `#` closed.
    fn opened(rows: [&str; 7]) -> Vec<String> {
        let mut open: Vec<bool> = rows
            .iter()
            .flat_map(|row| row.chars().map(|cell| cell == '.'))
            .collect();
        open_specks(&mut open, 7, 0.001, SPECK);
        let text = |row: &[bool]| row.iter().map(|open| if *open { '.' } else { '#' }).collect();
        open.chunks(7).map(text).collect()
    }

    #[test]
    fn specks_are_opened_and_bores_notches_and_borders_are_not() {
        let rows = [
            "#......", ".......", "..#..##", "...#.##", ".......", ".##..#.", ".##....",
        ];
        let expected = [
            "#......", ".......", ".....##", ".....##", ".......", ".##....", ".##....",
        ];
        assert_eq!(opened(rows), expected);
    }
}
