//! Where dark ends and light begins.

const CLASSES: usize = 256;
/// Pixels looked at; two levels are told apart by far fewer.
const MOST_PIXELS: usize = 20_000;
/// Levels further apart than this factor are two classes; noise and falloff of one surface stay below.
const LEAST_RATIO: f32 = 3.0;

/// The level above which a pixel is an object's: `over_dark` times the darker class' mean level. Pixels of one class
/// alone are all object when `is_lit` and else all mat.
pub(super) fn threshold(values: &[f32], over_dark: f32, is_lit: bool) -> f32 {
    let mut logs: Vec<f32> = values
        .iter()
        .step_by(values.len() / MOST_PIXELS + 1)
        .filter(|value| **value > 0.0)
        .map(|value| value.ln())
        .collect();
    if !is_lit || logs.is_empty() {
        return f32::INFINITY;
    }
    logs.sort_by(f32::total_cmp);
    let (low, high) = (logs[logs.len() / 200], logs[logs.len() - 1 - logs.len() / 200]);
    let Some((below, above)) = otsu(&logs, low, high) else {
        return 0.0;
    };
    if (above - below).exp() < LEAST_RATIO {
        return 0.0;
    }
    over_dark * below.exp()
}

/// Means of the two classes that differ most, weighted by their sizes (Otsu, "A threshold selection method from
/// gray-level histograms", 1979).
fn otsu(logs: &[f32], low: f32, high: f32) -> Option<(f32, f32)> {
    if high <= low {
        return None;
    }
    let width = (high - low) / CLASSES as f32;
    let mut counts = [0.0_f64; CLASSES];
    for log in logs {
        counts[(((log - low) / width).max(0.0) as usize).min(CLASSES - 1)] += 1.0;
    }
    let level = |class: usize| f64::from(low + (class as f32 + 0.5) * width);
    let total: f64 = counts.iter().sum();
    let sum: f64 = (0..CLASSES).map(|class| counts[class] * level(class)).sum();
    let (mut weight, mut part) = (0.0, 0.0);
    let mut best = (0.0, None);
    for (class, count) in counts.iter().enumerate() {
        weight += count;
        part += count * level(class);
        if weight <= 0.0 || total - weight <= 0.0 {
            continue;
        }
        let (below, above) = (part / weight, (sum - part) / (total - weight));
        let between = weight * (total - weight) * (above - below).powi(2);
        if between > best.0 {
            best = (between, Some((below as f32, above as f32)));
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_levels_are_split_just_above_the_dark_one() {
        let values: Vec<f32> = (0..1000)
            .map(|i| if i % 3 == 0 { 20.0 } else { 1.0 } + (i % 7) as f32 * 0.01)
            .collect();
        let threshold = threshold(&values, 1.9, true);
        assert!((1.8..2.2).contains(&threshold), "{threshold}");
    }

    #[test]
    fn one_level_is_all_object_when_lit_and_nothing_when_not() {
        let values = [5.0; 100];
        assert!(threshold(&values, 1.9, true) < 5.0);
        assert!(threshold(&values, 1.9, false) > 5.0);
        assert!(threshold(&[], 1.9, true) > 5.0);
    }
}
