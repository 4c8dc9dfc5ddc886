//! Groups of connected pixels, found by joining runs of equal pixels from row to row.

/// Pixels of one value, side by side in a row.
struct Run {
    start: usize,
    end: usize,
    /// Position of a run of the same group; its own for the group's first.
    parent: usize,
    /// Pixels of the group, kept at its first run.
    size: usize,
}

/// Turns groups of fewer than `least` pixels that have the value `of` into the opposite; four neighbours connect.
pub(super) fn drop_small(pixels: &mut [bool], width: usize, least: usize, of: bool) {
    let mut runs: Vec<Run> = Vec::new();
    let mut above = 0..0;
    for row in 0..pixels.len() / width {
        let first = runs.len();
        append_runs(&pixels[row * width..(row + 1) * width], row * width, of, &mut runs);
        join_rows(&mut runs, above, first, width);
        above = first..runs.len();
    }
    for position in 0..runs.len() {
        let group = root(&runs, position);
        if runs[group].size < least {
            pixels[runs[position].start..runs[position].end].fill(!of);
        }
    }
}

fn append_runs(row: &[bool], offset: usize, of: bool, runs: &mut Vec<Run>) {
    let mut x = 0;
    while let Some(skip) = row[x..].iter().position(|&pixel| pixel == of) {
        let start = x + skip;
        let length = row[start..]
            .iter()
            .position(|&pixel| pixel != of)
            .unwrap_or(row.len() - start);
        x = start + length;
        runs.push(Run {
            start: offset + start,
            end: offset + x,
            parent: runs.len(),
            size: length,
        });
    }
}

/// Joins the runs of a row with those of the row above that they touch.
fn join_rows(runs: &mut [Run], above: std::ops::Range<usize>, first: usize, width: usize) {
    let (mut upper, mut lower) = (above.start, first);
    while upper < above.end && lower < runs.len() {
        let (up_start, up_end) = (runs[upper].start + width, runs[upper].end + width);
        let (start, end) = (runs[lower].start, runs[lower].end);
        if up_start < end && start < up_end {
            join(runs, upper, lower);
        }
        if up_end < end {
            upper += 1;
        } else {
            lower += 1;
        }
    }
}

fn join(runs: &mut [Run], a: usize, b: usize) {
    let (a, b) = (root(runs, a), root(runs, b));
    let (first, second) = (a.min(b), a.max(b));
    if first != second {
        runs[second].parent = first;
        runs[first].size += runs[second].size;
    }
}

fn root(runs: &[Run], mut position: usize) -> usize {
    while runs[position].parent != position {
        position = runs[position].parent;
    }
    position
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The same by growing each group pixel by pixel.
    fn plainly(pixels: &mut [bool], width: usize, least: usize, of: bool) {
        let mut seen = vec![false; pixels.len()];
        for start in 0..pixels.len() {
            if seen[start] || pixels[start] != of {
                continue;
            }
            let mut group = vec![start];
            seen[start] = true;
            let mut next = 0;
            while next < group.len() {
                let (index, x) = (group[next], group[next] % width);
                let around = [
                    (x > 0).then(|| index - 1),
                    (x + 1 < width).then_some(index + 1),
                    index.checked_sub(width),
                    (index + width < pixels.len()).then_some(index + width),
                ];
                for neighbour in around.into_iter().flatten() {
                    if pixels[neighbour] == of && !seen[neighbour] {
                        seen[neighbour] = true;
                        group.push(neighbour);
                    }
                }
                next += 1;
            }
            if group.len() < least {
                for index in group {
                    pixels[index] = !of;
                }
            }
        }
    }

    #[test]
    fn specks_go_and_groups_stay() {
        let mut pixels = [
            true, true, false, true, true, false, false, false, false, false, true, false,
        ];
        drop_small(&mut pixels, 4, 3, true);
        let expected = [
            true, true, false, false, true, false, false, false, false, false, false, false,
        ];
        assert_eq!(pixels, expected);
        drop_small(&mut pixels, 4, 20, false);
        assert!(pixels.iter().all(|&inside| inside));
    }

    proptest! {
        #[test]
        fn runs_and_pixels_find_the_same_groups(
            pixels in prop::collection::vec(any::<bool>(), 12 * 9),
            least in 1..20_usize,
            of in any::<bool>(),
        ) {
            let (mut fast, mut plain) = (pixels.clone(), pixels);
            drop_small(&mut fast, 12, least, of);
            plainly(&mut plain, 12, least, of);
            prop_assert_eq!(fast, plain);
        }
    }
}
