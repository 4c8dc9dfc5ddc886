//! `rakelight eval edges`: which of the true depth edges are found, and how many of the found ones are true.

use std::fmt;

use imaging::{Image, Mask, gray_picture, gray_to_rgb};
use photometric::{EdgeInput, EdgeMap, EdgeOptions, ObjectMaskOptions, object_mask, occlusion_edges};
use serde::Serialize;

use super::scenes::{SceneArguments, Subject};
use crate::failure::Failure;

/// An edge this near counts as the same, pixels.
const SAME: usize = 2;
/// A step of the true depth beyond what its surfaces' slopes say is an edge from this height on, metres: a grasp does
/// not care for less, and at a grazing angle of 15 degrees its shadow is some 4 mm wide.
const LEAST_STEP: f64 = 1e-3;

/// One view's figures, per cent.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    camera: String,
    /// Of the object's true edge pixels, those within two pixels of a found one.
    recall: f64,
    /// Of the found edge pixels, those within two pixels of a true one.
    precision: f64,
    true_pixels: usize,
    found_pixels: usize,
}

#[derive(Debug, Serialize)]
struct Report {
    views: Vec<Row>,
    mean_recall: f64,
    mean_precision: f64,
}

pub(crate) async fn run(arguments: SceneArguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || evaluate(&arguments)).await?
}

fn evaluate(arguments: &SceneArguments) -> Result<(), Failure> {
    let views = arguments.open()?.rows(|subject| {
        let row = score(subject)?;
        if !arguments.json {
            println!("{row}");
        }
        Ok(row)
    })?;
    let mean = |of: fn(&Row) -> f64| {
        let known: Vec<f64> = views.iter().map(of).filter(|value| value.is_finite()).collect();
        known.iter().sum::<f64>() / known.len() as f64
    };
    let report = Report {
        mean_recall: mean(|row| row.recall),
        mean_precision: mean(|row| row.precision),
        views,
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!(
            "mean of {} views: {:.1} % of the true edges found, {:.1} % of the found ones true",
            report.views.len(),
            report.mean_recall,
            report.mean_precision
        );
    }
    Ok(())
}

fn score(subject: &Subject<'_>) -> anyhow::Result<Row> {
    let capture = &subject.capture;
    let mask = object_mask(capture, &ObjectMaskOptions::default())?;
    let input = EdgeInput {
        capture,
        mask: Some(&mask),
        depth: None,
    };
    let EdgeMap { edges, confidence, .. } = occlusion_edges(&input, &EdgeOptions::default())?;
    let found = edges;
    let truth = true_edges(subject);
    subject.picture("edges", || Ok(picture(subject, &found, &truth)))?;
    subject.picture("edge_confidence", || {
        Ok(gray_to_rgb(&gray_picture(&confidence, 0.0, 1.0)?))
    })?;
    let object = |x: usize, y: usize| u8::from(truth.contains(x, y) && subject.view.mask.contains(x, y));
    let of_object = Mask::from_nonzero(&Image::from_fn(
        truth.as_image().width(),
        truth.as_image().height(),
        object,
    ));
    let share = |these: &Mask, those: &Mask| {
        let near = pixels(these).filter(|&(x, y)| is_near(those, x, y)).count();
        100.0 * near as f64 / these.count() as f64
    };
    Ok(Row {
        scene: subject.scene.to_owned(),
        camera: subject.view.camera.clone(),
        recall: share(&of_object, &found),
        precision: share(&found, &truth),
        true_pixels: of_object.count(),
        found_pixels: found.count(),
    })
}

/// Pixels from which the depth steps to a neighbour.
fn true_edges(subject: &Subject<'_>) -> Mask {
    let (width, height) = (subject.truth.depth.width(), subject.truth.depth.height());
    Mask::from_nonzero(&Image::from_fn(width, height, |x, y| {
        let around = [(x + 1, y), (x.wrapping_sub(1), y), (x, y + 1), (x, y.wrapping_sub(1))];
        let mut inside = around.into_iter().filter(|&(x, y)| x < width && y < height);
        u8::from(inside.any(|other| is_step(subject, (x, y), other)))
    }))
}

/// Whether the surfaces of neighbouring pixels miss each other by a step: by the plane of either.
fn is_step(subject: &Subject<'_>, one: (usize, usize), other: (usize, usize)) -> bool {
    let surface = |(x, y): (usize, usize)| {
        let ideal = subject.capture.rays.ideal().row(y)[x];
        let depth = f64::from(subject.truth.depth.row(y)[x]);
        let normal = geometry::nalgebra::Vector3::from(subject.truth.normals.row(y)[x]).cast::<f64>();
        (subject.view.view.point_at_depth(ideal, depth), normal)
    };
    let ((here, normal_here), (there, normal_there)) = (surface(one), surface(other));
    let apart = there - here;
    let off = |normal: geometry::nalgebra::Vector3<f64>| normal.dot(&apart).abs();
    off(normal_here).min(off(normal_there)) > LEAST_STEP
}

fn pixels(mask: &Mask) -> impl Iterator<Item = (usize, usize)> + '_ {
    let (width, height) = (mask.as_image().width(), mask.as_image().height());
    let all = (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
    all.filter(|&(x, y)| mask.contains(x, y))
}

fn is_near(mask: &Mask, x: usize, y: usize) -> bool {
    let around = |middle: usize| middle.saturating_sub(SAME)..=middle + SAME;
    around(y).any(|y| around(x).any(|x| mask.contains(x, y)))
}

/// The overhead image in gray; edges found and true green, found alone red, missed blue.
fn picture(subject: &Subject<'_>, found: &Mask, truth: &Mask) -> Image<[u8; 3]> {
    let stack = &subject.view.stack;
    let lit = stack.channels().filter_map(|channel| stack.light(channel)).last();
    let lit = lit.unwrap_or(stack.dark());
    let most = f32::from(lit.pixels().iter().copied().max().unwrap_or(1).max(1));
    Image::from_fn(lit.width(), lit.height(), |x, y| {
        if found.contains(x, y) {
            return if is_near(truth, x, y) {
                [40, 230, 40]
            } else {
                [255, 40, 40]
            };
        }
        if truth.contains(x, y) && !is_near(found, x, y) {
            return [60, 90, 255];
        }
        [(f32::from(lit.row(y)[x]) / most * 200.0) as u8; 3]
    })
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:16} {}  {:5.1} % of {:4} true edge pixels found, {:5.1} % of {:4} found ones true",
            self.scene, self.camera, self.recall, self.true_pixels, self.precision, self.found_pixels
        )
    }
}
