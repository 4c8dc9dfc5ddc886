//! Finds the hemisphere: a bright blob on a dark mat.

use geometry::nalgebra::{Matrix2, Point3, Vector2, Vector3};

use super::{CalibrationOptions, PlacementReport, TargetView};
use crate::error::PhotometricError;

/// Where the target is: only it is brighter than this share of the brightest pixels; the table is a third as bright.
const GUESS_SHARE: f64 = 0.6;
/// What belongs to it, once its place is nearly known: its side far from all panels is dim, the mat dimmer still.
const BRIGHT_SHARE: f64 = 0.1;
/// Bright pixels further out than this many radii are the table's.
const SEARCH_RADII: f64 = 1.15;
/// Fewer bright pixels are no target.
const LEAST_PIXELS: usize = 400;
/// Every so many pixels are looked at in each direction.
const STRIDE: usize = 2;
/// Newton steps towards the centre.
const STEPS: usize = 15;
/// Centroids that stay further from the fitted sphere's than this belong to something else, pixels.
const LARGEST_MISFIT_PX: f64 = 4.0;

/// Where each placement's target stands; its centre lies on the mat's plane, z = 0.
pub(super) fn locate(
    views: &[TargetView<'_>],
    options: &CalibrationOptions,
) -> Result<Vec<PlacementReport>, PhotometricError> {
    let mut reports: Vec<PlacementReport> = Vec::new();
    for first in views {
        first.view.require_rays(first.rays)?;
        if reports.iter().any(|report| report.placement == first.placement) {
            continue;
        }
        let own: Vec<&TargetView<'_>> = views.iter().filter(|view| view.placement == first.placement).collect();
        reports.push(locate_one(first.placement, &own, options));
    }
    Ok(reports)
}

fn locate_one(name: &str, views: &[&TargetView<'_>], options: &CalibrationOptions) -> PlacementReport {
    let bright: Option<Vec<BrightPixels>> = views.iter().map(|view| BrightPixels::of(view)).collect();
    let fitted = bright
        .ok_or_else(|| "no bright target is seen".to_owned())
        .and_then(|bright| fit_centre(views, &bright, options.radius));
    let (centre, dropped) = match fitted {
        Ok(centre) => (Some([centre.x, centre.y]), None),
        Err(reason) => (None, Some(reason)),
    };
    PlacementReport {
        placement: name.to_owned(),
        centre,
        median_sigmas: None,
        dropped,
    }
}

/// Brightest over all lights, less the dark image.
fn brightest(view: &TargetView<'_>, index: usize) -> u16 {
    let dark = view.stack.dark().pixels()[index];
    let lit = view.stack.channels().filter_map(|channel| view.stack.light(channel));
    lit.map(|image| image.pixels()[index].saturating_sub(dark))
        .max()
        .unwrap_or(0)
}

fn grid(view: &TargetView<'_>) -> impl Iterator<Item = (usize, Vector2<f64>)> {
    let (width, height) = (view.stack.width(), view.stack.height());
    (0..height).step_by(STRIDE).flat_map(move |y| {
        (0..width)
            .step_by(STRIDE)
            .map(move |x| (y * width + x, Vector2::new(x as f64, y as f64)))
    })
}

/// The bright part of a view.
struct BrightPixels {
    /// Middle of the brightest ones.
    guess: Vector2<f64>,
    pixels: Vec<(usize, Vector2<f64>)>,
}

impl BrightPixels {
    fn of(view: &TargetView<'_>) -> Option<Self> {
        let values: Vec<(u16, usize, Vector2<f64>)> = grid(view)
            .map(|(index, at)| (brightest(view, index), index, at))
            .collect();
        let mut sorted: Vec<u16> = values.iter().map(|(value, ..)| *value).collect();
        let high = sorted.len() - 1 - (LEAST_PIXELS / (STRIDE * STRIDE)).min(sorted.len() - 1);
        let bright = f64::from(*sorted.select_nth_unstable(high).1);
        let above = |share: f64| {
            values
                .iter()
                .filter(move |(value, ..)| f64::from(*value) > share * bright)
        };
        Some(Self {
            guess: centroid(above(GUESS_SHARE).map(|(.., at)| *at))?,
            pixels: above(BRIGHT_SHARE).map(|&(_, index, at)| (index, at)).collect(),
        })
    }

    /// Middle of those that may be the target's if it stands here.
    fn near(&self, view: &TargetView<'_>, centre: &Point3<f64>, radius: f64) -> Option<Vector2<f64>> {
        let inside = |(index, _): &&(usize, Vector2<f64>)| hit(view, *index, centre, radius * SEARCH_RADII).is_some();
        centroid(self.pixels.iter().filter(inside).map(|(_, at)| *at))
    }
}

fn centroid(points: impl Iterator<Item = Vector2<f64>>) -> Option<Vector2<f64>> {
    let (sum, count) = points.fold((Vector2::zeros(), 0_usize), |(sum, count), at| (sum + at, count + 1));
    (count * STRIDE * STRIDE >= LEAST_PIXELS).then(|| sum / count as f64)
}

/// Where the ray of a pixel first meets the hemisphere, and the normal there; base frame.
pub(super) fn hit(
    view: &TargetView<'_>,
    index: usize,
    centre: &Point3<f64>,
    radius: f64,
) -> Option<(Point3<f64>, Vector3<f64>)> {
    let ideal = view.rays.ideal().pixels()[index];
    let ray = Vector3::new(f64::from(ideal[0]), f64::from(ideal[1]), 1.0);
    let direction = view.view.base_from_camera.transform_direction(&ray).normalize();
    let origin = view.view.centre();
    let to_origin = origin - centre;
    let along = direction.dot(&to_origin);
    let under_root = along * along - to_origin.norm_squared() + radius * radius;
    let distance = -along - under_root.max(0.0).sqrt();
    let point = origin + direction * distance;
    (under_root > 0.0 && point.z > 0.0).then(|| (point, (point - centre) / radius))
}

/// Newton's method on the centroids of the bright pixels against those of the sphere as it would be seen.
fn fit_centre(views: &[&TargetView<'_>], bright: &[BrightPixels], radius: f64) -> Result<Point3<f64>, String> {
    let seen = |view: &TargetView<'_>, centre: &Point3<f64>| {
        centroid(
            grid(view)
                .filter(|(index, _)| hit(view, *index, centre, radius).is_some())
                .map(|(_, at)| at),
        )
    };
    let lost = || "the target leaves the image".to_owned();
    let mut centre = first_guess(views[0], &bright[0].guess, radius);
    let mut misfit = f64::INFINITY;
    for _ in 0..STEPS {
        let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
        misfit = 0.0;
        for (view, bright) in views.iter().zip(bright) {
            let here = seen(view, &centre).ok_or_else(lost)?;
            let off = bright.near(view, &centre, radius).ok_or_else(lost)? - here;
            misfit = f64::max(misfit, off.norm());
            let step = radius / 10.0;
            let slope = |axis: Vector3<f64>| -> Result<Vector2<f64>, String> {
                Ok((seen(view, &(centre + axis * step)).ok_or_else(lost)? - here) / step)
            };
            let (by_x, by_y) = (slope(Vector3::x())?, slope(Vector3::y())?);
            let jacobian = Matrix2::from_columns(&[by_x, by_y]);
            matrix += jacobian.transpose() * jacobian;
            right += jacobian.transpose() * off;
        }
        let step = matrix.try_inverse().ok_or_else(lost)? * right;
        centre += Vector3::new(step.x, step.y, 0.0);
    }
    if misfit > LARGEST_MISFIT_PX {
        return Err(format!(
            "the bright region lies {misfit:.1} px off the target as it should be seen, allowed are {LARGEST_MISFIT_PX} px"
        ));
    }
    Ok(centre)
}

fn first_guess(view: &TargetView<'_>, centroid: &Vector2<f64>, radius: f64) -> Point3<f64> {
    let index = centroid.y.round() as usize * view.stack.width() + centroid.x.round() as usize;
    let ideal = view.rays.ideal().pixels()[index];
    let depth = view.view.depth_of_plane(ideal, radius / 2.0);
    let point = view.view.point_at_depth(ideal, depth);
    Point3::new(point.x, point.y, 0.0)
}
