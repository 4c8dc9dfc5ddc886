//! Regions of steps that hang together.

use super::padded::Padded;

/// What makes a region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Thresholds {
    /// It begins where a step is stronger.
    pub(super) strong: u8,
    /// And ends where none is stronger.
    pub(super) weak: u8,
    /// Smaller ones are dropped.
    pub(super) least_pixels: usize,
}

/// A set of pixels, as an image and as a list.
pub(super) struct Regions {
    /// 1 inside, 0 outside.
    pub(super) inside: Padded,
    /// Places of all pixels inside.
    pub(super) pixels: Vec<usize>,
}

/// Groups of pixels over the weak threshold that have one over the strong threshold (hysteresis: Canny, "A computational
/// approach to edge detection", 1986, section IX); eight neighbours connect.
pub(super) fn regions(strengths: &Padded, thresholds: Thresholds) -> Regions {
    let mut regions = Regions {
        inside: Padded::zeros(strengths.width(), strengths.height()),
        pixels: Vec::new(),
    };
    let mut dropped = Vec::new();
    for y in 0..strengths.height() {
        let row = strengths.row(y);
        if row.iter().fold(0, |most, &strength| strength.max(most)) <= thresholds.strong {
            continue;
        }
        for (x, &strength) in row.iter().enumerate() {
            let index = strengths.index(x, y);
            if strength <= thresholds.strong || regions.inside.bytes[index] != 0 {
                continue;
            }
            let before = regions.pixels.len();
            grow(strengths, thresholds.weak, index, &mut regions);
            if regions.pixels.len() - before < thresholds.least_pixels {
                dropped.extend(regions.pixels.drain(before..));
            }
        }
    }
    for index in dropped {
        regions.inside.bytes[index] = 0;
    }
    regions
}

impl Regions {
    /// Adds so many rings of neighbours to all regions.
    pub(super) fn widen(&mut self, rings: usize) {
        // A full border keeps pixels off it.
        self.inside.fill_border(1);
        let mut first = 0;
        for _ in 0..rings {
            let last = self.pixels.len();
            for at in first..last {
                for neighbour in self.inside.around(self.pixels[at]) {
                    if self.inside.bytes[neighbour] == 0 {
                        self.inside.bytes[neighbour] = 1;
                        self.pixels.push(neighbour);
                    }
                }
            }
            first = last;
        }
        self.inside.fill_border(0);
    }
}

/// Adds the group of a pixel.
fn grow(strengths: &Padded, weak: u8, start: usize, regions: &mut Regions) {
    let inside = &mut regions.inside.bytes;
    let mut next = regions.pixels.len();
    inside[start] = 1;
    regions.pixels.push(start);
    while let Some(&index) = regions.pixels.get(next) {
        next += 1;
        for neighbour in strengths.around(index) {
            // The border's strength is 0, so that it never grows into it.
            if strengths.bytes[neighbour] > weak && inside[neighbour] == 0 {
                inside[neighbour] = 1;
                regions.pixels.push(neighbour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strengths(row: &[u8]) -> Padded {
        let mut strengths = Padded::zeros(row.len(), 1);
        for (x, &strength) in row.iter().enumerate() {
            let index = strengths.index(x, 0);
            strengths.bytes[index] = strength;
        }
        strengths
    }

    #[test]
    fn weak_steps_count_beside_strong_ones_only() {
        let thresholds = Thresholds {
            strong: 40,
            weak: 20,
            least_pixels: 2,
        };
        let found = regions(&strengths(&[0, 30, 50, 30, 20, 0, 30, 30, 0, 90, 0]), thresholds);
        let columns: Vec<usize> = found.pixels.iter().map(|&index| found.inside.place(index).0).collect();
        assert_eq!(columns.len(), 3, "{columns:?}");
        assert_eq!(columns.iter().sum::<usize>(), 1 + 2 + 3);
        assert_eq!(found.inside.bytes.iter().map(|&b| usize::from(b)).sum::<usize>(), 3);
    }

    #[test]
    fn widening_leaves_the_border_empty() {
        let thresholds = Thresholds {
            strong: 40,
            weak: 20,
            least_pixels: 1,
        };
        let mut found = regions(&strengths(&[50, 50, 0, 0, 50, 0, 0, 0, 50]), thresholds);
        found.widen(1);
        assert_eq!(found.inside.row(0), [1, 1, 1, 1, 1, 1, 0, 1, 1]);
        assert_eq!(found.inside.bytes.iter().map(|&b| usize::from(b)).sum::<usize>(), 8);
        assert_eq!(found.pixels.len(), 8);
    }
}
