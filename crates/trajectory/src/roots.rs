//! Real roots of polynomials of up to fourth degree in an interval.
//!
//! Between two neighbouring extremes a polynomial has at most one root, so that its derivative's roots, found the same
//! way, part the interval into pieces for bisection: no case distinctions, and nothing is missed.

/// Halvings of a bisection: more than a double has bits.
const HALVINGS: usize = 64;
/// Most roots of a quartic, and the ends of its pieces.
const MOST: usize = 6;

/// A few numbers, ascending.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Few {
    values: [f64; MOST],
    count: usize,
}

impl Few {
    fn new() -> Self {
        Self {
            values: [0.0; MOST],
            count: 0,
        }
    }

    fn push(&mut self, value: f64) {
        if self.count < MOST {
            self.values[self.count] = value;
            self.count += 1;
        }
    }

    pub(crate) fn as_slice(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

/// Roots in `0..=end` of the polynomial with these coefficients, constant first. A double root, which only touches 0, may
/// be left out: the polynomial does not change its sign there.
pub(crate) fn roots<const N: usize>(coefficients: &[f64; N], end: f64) -> Few {
    within(coefficients, end)
}

fn within(coefficients: &[f64], end: f64) -> Few {
    let mut roots = Few::new();
    let degree = coefficients.len().saturating_sub(1);
    if degree == 0 {
        return roots;
    }
    let mut derivative = [0.0; MOST];
    for (power, slot) in derivative.iter_mut().take(degree).enumerate() {
        *slot = (power + 1) as f64 * coefficients[power + 1];
    }
    let turns = within(&derivative[..degree], end);
    let mut from = 0.0;
    for &to in turns.as_slice().iter().chain([&end]) {
        if let Some(root) = between(coefficients, from, to) {
            roots.push(root);
        }
        from = to;
    }
    roots
}

/// The root in a piece in which the polynomial only rises or only falls; none when it keeps its sign.
fn between(coefficients: &[f64], from: f64, to: f64) -> Option<f64> {
    let is_negative = |at: f64| value(coefficients, at) < 0.0;
    let (mut low, mut high) = (from, to);
    let starts_negative = is_negative(low);
    if starts_negative == is_negative(high) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if is_negative(middle) == starts_negative {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(f64::midpoint(low, high))
}

/// By Horner's rule.
pub(crate) fn value(coefficients: &[f64], at: f64) -> f64 {
    coefficients
        .iter()
        .rev()
        .fold(0.0, |sum, coefficient| sum * at + coefficient)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_four_roots_of_a_quartic_are_found() {
        // (x - 0.1)(x - 0.4)(x - 0.5)(x - 0.9)
        let found = roots(&[0.018, -0.281, 1.19, -1.9, 1.0], 1.0);
        let wanted = [0.1, 0.4, 0.5, 0.9];
        let off: Vec<f64> = found
            .as_slice()
            .iter()
            .zip(wanted)
            .map(|(a, b)| (a - b).abs())
            .collect();
        assert_eq!(off.len(), 4, "{found:?}");
        assert!(off.iter().all(|off| *off < 1e-9), "{found:?}");
    }

    #[test]
    fn constants_and_roots_beyond_the_end_give_none() {
        assert!(roots(&[1.0, 0.0, 0.0], 1.0).as_slice().is_empty());
        assert!(roots(&[-2.0, 1.0], 1.0).as_slice().is_empty());
    }
}
