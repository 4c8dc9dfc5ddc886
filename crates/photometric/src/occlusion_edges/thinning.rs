//! From regions to lines.

use imaging::{Image, Mask};

use super::trace::Regions;

/// Lines up to this far outside the mask are its object's border, pixels.
const BESIDE_MASK: usize = 2;

/// The middle lines of regions, of those in the mask or right beside it. Gaps of up to twice `bridge` pixels in a line
/// are closed.
pub(super) fn lines(mut regions: Regions, bridge: usize, mask: Option<&Mask>) -> Mask {
    thin(&mut regions);
    regions.widen(bridge);
    thin(&mut regions);
    let inside = &regions.inside;
    let mut image = Image::filled(inside.width(), inside.height(), 0_u8);
    for &index in &regions.pixels {
        let (x, y) = inside.place(index);
        if mask.is_none_or(|mask| is_beside(mask, x, y)) {
            image.pixels_mut()[y * inside.width() + x] = 255;
        }
    }
    Mask::from_nonzero(&image)
}

fn is_beside(mask: &Mask, x: usize, y: usize) -> bool {
    let near = |middle: usize| middle.saturating_sub(BESIDE_MASK)..=middle + BESIDE_MASK;
    near(y).any(|y| near(x).any(|x| mask.contains(x, y)))
}

/// For each pattern of neighbours (bit i: the i-th clockwise from above is inside) whether its pixel is taken off: it
/// neither ends a line nor holds two parts together, and of both triples of neighbours one is outside.
fn rule(one: [usize; 3], other: [usize; 3]) -> [bool; 256] {
    std::array::from_fn(|pattern| {
        let is_inside = |at: usize| pattern >> (at % 8) & 1 == 1;
        let starts = (0..8).filter(|&at| !is_inside(at) && is_inside(at + 1)).count();
        let has_gap = |triple: [usize; 3]| triple.into_iter().any(|at| !is_inside(at));
        (2..=6).contains(&pattern.count_ones()) && starts == 1 && has_gap(one) && has_gap(other)
    })
}

/// Takes pixels off from the south-east and the north-west by turns until lines are left (Zhang and Suen, "A fast
/// parallel algorithm for thinning digital patterns", 1984).
fn thin(regions: &mut Regions) {
    let (south_east, north_west) = (rule([0, 2, 4], [2, 4, 6]), rule([0, 2, 6], [0, 4, 6]));
    let mut off = Vec::new();
    while take_off(regions, &south_east, &mut off) | take_off(regions, &north_west, &mut off) {}
}

/// Takes pixels off, all at once; says whether there were any.
fn take_off(regions: &mut Regions, rule: &[bool; 256], off: &mut Vec<usize>) -> bool {
    let inside = &regions.inside;
    off.clear();
    regions.pixels.retain(|&index| {
        let is_off = rule[inside.pattern(index)];
        if is_off {
            off.push(index);
        }
        !is_off
    });
    for &index in off.iter() {
        regions.inside.bytes[index] = 0;
    }
    !off.is_empty()
}

#[cfg(test)]
mod tests {
    use super::super::padded::Padded;
    use super::*;

    fn bar(width: usize, height: usize, is_inside: impl Fn(usize, usize) -> bool) -> Regions {
        let mut inside = Padded::zeros(width, height);
        let all = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let wanted = all.filter(|&(x, y)| is_inside(x, y));
        let pixels: Vec<usize> = wanted.map(|(x, y)| inside.index(x, y)).collect();
        for &index in &pixels {
            inside.bytes[index] = 1;
        }
        Regions { inside, pixels }
    }

    #[test]
    fn a_bar_becomes_its_middle_line() {
        let edges = lines(
            bar(40, 20, |x, y| (4..36).contains(&x) && (6..11).contains(&y)),
            0,
            None,
        );
        assert!((8..32).all(|x| edges.contains(x, 8)), "the middle row");
        assert_eq!(edges.count(), (0..40).filter(|&x| edges.contains(x, 8)).count());
    }

    #[test]
    fn a_ring_stays_closed() {
        let distance = |x: usize, y: usize| (x as f64 - 20.0).hypot(y as f64 - 20.0);
        let edges = lines(bar(41, 41, |x, y| (10.0..15.0).contains(&distance(x, y))), 0, None);
        // Every pixel of a closed line has two neighbours or more.
        for (x, y) in (0..41).flat_map(|y| (0..41).map(move |x| (x, y))) {
            let near = |middle: usize| middle.saturating_sub(1)..=middle + 1;
            let count = near(y)
                .flat_map(|y| near(x).map(move |x| (x, y)))
                .filter(|&(x, y)| edges.contains(x, y))
                .count();
            assert!(!edges.contains(x, y) || count >= 3, "the line ends at {x}, {y}");
        }
        assert!(edges.count() > 60);
    }

    #[test]
    fn lines_off_the_mask_go() {
        let mask = Mask::from_nonzero(&Image::from_fn(40, 20, |_, y| u8::from(y < 6)));
        let row = |row: usize| bar(40, 20, move |_, y| y == row);
        assert!(lines(row(7), 0, Some(&mask)).count() > 30, "right beside it");
        assert_eq!(lines(row(8), 0, Some(&mask)).count(), 0);
    }

    #[test]
    fn gaps_are_bridged() {
        let dashes = || bar(40, 20, |x, y| y == 9 && x % 10 < 7);
        assert!((3..33).all(|x| lines(dashes(), 2, None).contains(x, 9)));
        assert!(!lines(dashes(), 1, None).contains(8, 9));
    }
}
