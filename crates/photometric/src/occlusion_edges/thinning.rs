//! From regions to lines.

use imaging::{Image, Mask};

use super::trace::{Regions, around};

/// Lines up to this far outside the mask are its object's border, pixels.
const BESIDE_MASK: usize = 2;

/// The middle lines of regions, of those in the mask or right beside it.
pub(super) fn lines(mut regions: Regions, mask: Option<&Mask>) -> Mask {
    while thin(&mut regions, [0, 2, 4], [2, 4, 6]) | thin(&mut regions, [0, 2, 6], [0, 4, 6]) {}
    let mut image = Image::filled(regions.width, regions.height, 0_u8);
    for &index in &regions.pixels {
        let (x, y) = regions.place(index);
        if mask.is_none_or(|mask| is_beside(mask, x, y)) {
            image.pixels_mut()[y * regions.width + x] = 255;
        }
    }
    Mask::from_nonzero(&image)
}

fn is_beside(mask: &Mask, x: usize, y: usize) -> bool {
    let near = |middle: usize| middle.saturating_sub(BESIDE_MASK)..=middle + BESIDE_MASK;
    near(y).any(|y| near(x).any(|x| mask.contains(x, y)))
}

/// Takes off pixels of the regions' border from one side, all at once, as long as they neither end a line nor hold two
/// parts together; says whether there were any (Zhang and Suen, "A fast parallel algorithm for thinning digital
/// patterns", 1984). Of both triples of neighbours one must be outside.
fn thin(regions: &mut Regions, one: [usize; 3], other: [usize; 3]) -> bool {
    let stride = regions.stride();
    let is_off = |inside: &[u8], index: usize| {
        let ring = around(index, stride).map(|neighbour| inside[neighbour]);
        let count: u8 = ring.iter().sum();
        let starts = (0..8).filter(|&at| ring[at] == 0 && ring[(at + 1) % 8] == 1).count();
        let has_gap = |triple: [usize; 3]| triple.iter().any(|&at| ring[at] == 0);
        (2..=6).contains(&count) && starts == 1 && has_gap(one) && has_gap(other)
    };
    let pixels = std::mem::take(&mut regions.pixels);
    let (off, on): (Vec<usize>, Vec<usize>) = pixels.into_iter().partition(|&index| is_off(&regions.inside, index));
    for &index in &off {
        regions.inside[index] = 0;
    }
    regions.pixels = on;
    !off.is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(width: usize, height: usize, is_inside: impl Fn(usize, usize) -> bool) -> Regions {
        let mut regions = Regions::empty(width, height);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            if is_inside(x, y) {
                let index = (y + 1) * regions.stride() + x + 1;
                regions.inside[index] = 1;
                regions.pixels.push(index);
            }
        }
        regions
    }

    #[test]
    fn a_bar_becomes_its_middle_line() {
        let edges = lines(bar(40, 20, |x, y| (4..36).contains(&x) && (6..11).contains(&y)), None);
        assert!((8..32).all(|x| edges.contains(x, 8)), "the middle row");
        assert_eq!(edges.count(), (0..40).filter(|&x| edges.contains(x, 8)).count());
    }

    #[test]
    fn a_ring_stays_closed() {
        let distance = |x: usize, y: usize| (x as f64 - 20.0).hypot(y as f64 - 20.0);
        let edges = lines(bar(41, 41, |x, y| (10.0..15.0).contains(&distance(x, y))), None);
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
        assert!(lines(row(7), Some(&mask)).count() > 30, "right beside it");
        assert_eq!(lines(row(8), Some(&mask)).count(), 0);
    }
}
