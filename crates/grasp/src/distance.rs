//! Distance of every cell to the nearest closed one.

/// Squared distances in cells, exact; the outside of the grid is closed.
///
/// Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012, algorithm 1,
/// along the rows and then along the columns.
pub(crate) fn squared_distances(side: usize, is_open: impl Fn(usize) -> bool) -> Vec<f32> {
    let far = (4 * side * side) as f32;
    let mut image: Vec<f32> = (0..side * side)
        .map(|index| if is_open(index) { far } else { 0.0 })
        .collect();
    let mut line = Envelope::new(side);
    for row in image.chunks_exact_mut(side) {
        let values: Vec<f32> = row.to_vec();
        line.transform(|at| values[at], |at, value| row[at] = value);
    }
    for x in 0..side {
        let values: Vec<f32> = (0..side).map(|y| image[y * side + x]).collect();
        line.transform(|y| values[y], |y, value| image[y * side + x] = value);
    }
    image
}

/// Scratch for the lower envelope of parabolas.
struct Envelope {
    length: usize,
    apex: Vec<i64>,
    start: Vec<f32>,
}

impl Envelope {
    fn new(length: usize) -> Self {
        Self {
            length,
            apex: Vec::with_capacity(length + 2),
            start: Vec::with_capacity(length + 2),
        }
    }

    fn transform(&mut self, value: impl Fn(usize) -> f32, mut put: impl FnMut(usize, f32)) {
        let last = self.length as i64;
        // Closed cells stand just outside of both ends.
        let value = |at: i64| {
            if (0..last).contains(&at) {
                value(at as usize)
            } else {
                0.0
            }
        };
        self.apex.clear();
        self.start.clear();
        for at in -1..=last {
            let mut start = f32::NEG_INFINITY;
            while let Some(&other) = self.apex.last() {
                let (p, q) = (other as f32, at as f32);
                start = (value(at) + q * q - value(other) - p * p) / (2.0 * (q - p));
                if start > self.start[self.apex.len() - 1] {
                    break;
                }
                self.apex.pop();
                self.start.pop();
                start = f32::NEG_INFINITY;
            }
            self.apex.push(at);
            self.start.push(start);
        }
        let mut piece = 0;
        for at in 0..last {
            while piece + 1 < self.apex.len() && self.start[piece + 1] < at as f32 {
                piece += 1;
            }
            let apex = self.apex[piece];
            put(at as usize, ((at - apex) * (at - apex)) as f32 + value(apex));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_a_search_over_all_cells() {
        let mut random = fastrand::Rng::with_seed(11);
        for side in [1, 2, 7, 20] {
            let open: Vec<bool> = (0..side * side).map(|_| random.f32() < 0.9).collect();
            let found = squared_distances(side, |index| open[index]);
            let last = side as i64;
            for (index, &found) in found.iter().enumerate() {
                let (x, y) = ((index % side) as i64, (index / side) as i64);
                let closed = |x: i64, y: i64| {
                    !(0..last).contains(&x) || !(0..last).contains(&y) || !open[(y * last + x) as usize]
                };
                let cells = (-1..=last).flat_map(|v| (-1..=last).map(move |u| (u, v)));
                let nearest = cells
                    .filter(|&(u, v)| closed(u, v))
                    .map(|(u, v)| (u - x).pow(2) + (v - y).pow(2))
                    .min();
                let apart = (found - nearest.unwrap() as f32).abs();
                assert!(apart < 1e-3, "side {side}, cell {x} {y}: {apart}");
            }
        }
    }
}
