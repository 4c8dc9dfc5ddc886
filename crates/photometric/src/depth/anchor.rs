//! Absolute depth from the table on which the object stands.

use geometry::nalgebra::Vector3;
use imaging::Image;

use super::IntegrationInput;
use super::links::Surface;

/// Where an object's outline is seen to stand on the table: this share of its border pixels lies lowest.
const CONTACT_SHARE: f64 = 0.05;
/// Pixels along the border that mix with the mat, at most.
const MIXED: isize = 2;
/// Parts of fewer pixels have too short a border to stand on.
const LEAST_PIXELS: usize = 50;

/// Depth in metres, and the number of parts that got one.
pub(super) fn to_table(input: &IntegrationInput<'_>, surface: &Surface, log_depth: &[f32]) -> (Image<f32>, usize) {
    let camera = &input.view.camera;
    let mut depth = Image::filled(camera.width(), camera.height(), f32::NAN);
    let mut seen = vec![false; surface.width * surface.height];
    let mut parts = 0;
    for start in 0..seen.len() {
        if seen[start] || !surface.is_inside(start) {
            continue;
        }
        let part = part_of(surface, start, &mut seen);
        if part.len() < LEAST_PIXELS {
            continue;
        }
        let Some(scale) = scale(input, surface, log_depth, &part) else {
            continue;
        };
        parts += 1;
        for &index in &part {
            depth.pixels_mut()[surface.in_view(index)] = (scale * f64::from(log_depth[index]).exp()) as f32;
        }
    }
    (depth, parts)
}

fn part_of(surface: &Surface, start: usize, seen: &mut [bool]) -> Vec<usize> {
    let mut part = vec![start];
    seen[start] = true;
    let mut next = 0;
    while next < part.len() {
        for neighbour in around(surface, part[next]).into_iter().flatten() {
            if surface.is_inside(neighbour) && !seen[neighbour] {
                seen[neighbour] = true;
                part.push(neighbour);
            }
        }
        next += 1;
    }
    part
}

fn around(surface: &Surface, index: usize) -> [Option<usize>; 4] {
    let (x, width) = (index % surface.width, surface.width);
    [
        (x > 0).then(|| index - 1),
        (x + 1 < width).then_some(index + 1),
        index.checked_sub(width),
        (index + width < width * surface.height).then_some(index + width),
    ]
}

/// Whether a pixel lies just inside the border: the outermost pixels mix with the mat, their normals mean little.
fn is_rim(surface: &Surface, index: usize) -> bool {
    let (x, y) = (index % surface.width, index / surface.width);
    let inside = |dx: isize, dy: isize| {
        let (x, y) = (x.checked_add_signed(dx), y.checked_add_signed(dy));
        let at = x.zip(y).filter(|&(x, y)| x < surface.width && y < surface.height);
        at.is_some_and(|(x, y)| surface.is_inside(y * surface.width + x))
    };
    let all_at = |d: isize| {
        [(d, 0), (-d, 0), (0, d), (0, -d)]
            .into_iter()
            .all(|(dx, dy)| inside(dx, dy))
    };
    (1..=MIXED).all(all_at) && !all_at(MIXED + 2)
}

/// What turns exp(u) into metres, so that the lowest of the part's border stands on z = 0: every border pixel has a
/// scale at which it would, and the least of them, but for outliers, is the part's.
fn scale(input: &IntegrationInput<'_>, surface: &Surface, log_depth: &[f32], part: &[usize]) -> Option<f64> {
    let camera = input.view.centre();
    let scale_of = |index: usize| {
        let [x, y] = input.rays.ideal().pixels()[surface.in_view(index)];
        let ray = input
            .view
            .base_from_camera
            .transform_direction(&Vector3::new(f64::from(x), f64::from(y), 1.0));
        let scale = -camera.z / (ray.z * f64::from(log_depth[index]).exp());
        (scale.is_finite() && scale > 0.0).then_some(scale)
    };
    let mut scales: Vec<f64> = part
        .iter()
        .copied()
        .filter(|&index| is_rim(surface, index))
        .filter_map(scale_of)
        .collect();
    if scales.is_empty() {
        scales = part.iter().copied().filter_map(scale_of).collect();
    }
    scales.sort_by(f64::total_cmp);
    scales.get((CONTACT_SHARE * scales.len() as f64) as usize).copied()
}
