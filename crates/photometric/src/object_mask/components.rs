//! Groups of connected pixels.

/// Turns groups of fewer than `least` pixels that have the value `of` into the opposite; four neighbours connect.
pub(super) fn drop_small(pixels: &mut [bool], width: usize, least: usize, of: bool) {
    let mut seen = vec![false; pixels.len()];
    let mut group = Vec::new();
    for start in 0..pixels.len() {
        if seen[start] || pixels[start] != of {
            continue;
        }
        grow(pixels, width, start, &mut seen, &mut group);
        if group.len() < least {
            for &index in &group {
                pixels[index] = !of;
            }
        }
    }
}

/// Collects the group of a pixel and marks it as seen.
fn grow(pixels: &[bool], width: usize, start: usize, seen: &mut [bool], group: &mut Vec<usize>) {
    let of = pixels[start];
    group.clear();
    group.push(start);
    seen[start] = true;
    let mut next = 0;
    while next < group.len() {
        let index = group[next];
        next += 1;
        let x = index % width;
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
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn specks_go_and_groups_stay() {
        let mut pixels = [
            true, true, false, true, true, false, false, false, false, false, true, false,
        ]
        .to_vec();
        drop_small(&mut pixels, 4, 3, true);
        let expected = [
            true, true, false, false, true, false, false, false, false, false, false, false,
        ];
        assert_eq!(pixels, expected);
        drop_small(&mut pixels, 4, 20, false);
        assert!(pixels.iter().all(|&inside| inside));
    }
}
