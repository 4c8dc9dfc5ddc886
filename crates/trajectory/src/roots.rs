//! Real roots of polynomials of up to fourth degree in an interval.
//!
//! Between two neighbouring extremes a polynomial has at most one root, so that its derivative's roots part the interval
//! into pieces for a bracketed search: no case distinctions, and nothing is missed.

/// Most steps of a search; some ten are needed.
const MOST_STEPS: usize = 64;
/// Share of the interval to which roots are found.
const SHARE: f64 = 1e-14;
/// Most roots of a quartic.
const MOST: usize = 4;

/// A few numbers, ascending.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Few {
    values: [f64; MOST],
    count: usize,
}

impl Few {
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

/// Roots in `0..=end` of the polynomial with these coefficients, constant first, given those of its derivative. A double
/// root, which only touches 0, may be left out: the polynomial does not change its sign there.
pub(crate) fn roots(coefficients: &[f64], turns: &Few, end: f64) -> Few {
    let mut roots = Few::default();
    let mut from = 0.0;
    for &to in turns.as_slice().iter().chain(&[end]) {
        if let Some(root) = between(coefficients, from, to, SHARE * end) {
            roots.push(root);
        }
        from = to;
    }
    roots
}

/// The root in a piece in which the polynomial only rises or only falls; none when it keeps its sign. False position in
/// the Illinois form: the end that stays counts half the next time.
fn between(coefficients: &[f64], from: f64, to: f64, precision: f64) -> Option<f64> {
    let (mut low, mut high) = (from, to);
    let (mut at_low, mut at_high) = (value(coefficients, low), value(coefficients, high));
    if (at_low < 0.0) == (at_high < 0.0) {
        return None;
    }
    let mut kept = 0.0_f64;
    for step in 0..MOST_STEPS {
        if high - low <= precision {
            break;
        }
        let guess = if step % 8 == 7 {
            f64::midpoint(low, high)
        } else {
            (low - at_low * (high - low) / (at_high - at_low)).clamp(low, high)
        };
        let found = value(coefficients, guess);
        if found == 0.0 {
            return Some(guess);
        }
        if (found < 0.0) == (at_low < 0.0) {
            (low, at_low) = (guess, found);
            at_high *= if kept > 0.0 { 0.5 } else { 1.0 };
            kept = 1.0;
        } else {
            (high, at_high) = (guess, found);
            at_low *= if kept < 0.0 { 0.5 } else { 1.0 };
            kept = -1.0;
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

    fn all(coefficients: &[f64], end: f64) -> Few {
        if coefficients.len() < 2 {
            return Few::default();
        }
        let powers = coefficients.iter().enumerate().skip(1);
        let derivative: Vec<f64> = powers.map(|(power, by)| power as f64 * by).collect();
        roots(coefficients, &all(&derivative, end), end)
    }

    #[test]
    fn all_four_roots_of_a_quartic_are_found() {
        // (x - 0.1)(x - 0.4)(x - 0.5)(x - 0.9)
        let found = all(&[0.018, -0.281, 1.19, -1.9, 1.0], 1.0);
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
        assert!(all(&[1.0, 0.0, 0.0], 1.0).as_slice().is_empty());
        assert!(all(&[-2.0, 1.0], 1.0).as_slice().is_empty());
    }
}
