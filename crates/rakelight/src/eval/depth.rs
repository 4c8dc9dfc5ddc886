//! `rakelight eval depth`: how far integrated depth is from the truth of path-traced captures.

use std::fmt;

use imaging::{Image, Mask, contact_sheet, gray_to_rgb};
use photometric::{SolveOptions, solve_view};
use rig_scenes::Truth;
use serde::Serialize;

use super::pictures::{GAP, heat};
use super::scenes::{SceneArguments, Subject};
use crate::failure::Failure;
use crate::relief::relief;

/// White in the picture of errors, millimetres.
const WHITE_MM: f32 = 3.0;

/// One view's figures.
#[derive(Debug, Serialize)]
struct Row {
    scene: String,
    camera: String,
    /// None where no pixel has a depth.
    depth: Option<Score>,
}

/// Depth over the object's pixels, millimetres, after one offset is taken off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Score {
    mean: f64,
    median: f64,
    p95: f64,
    max: f64,
    /// What was taken off: the median difference. Absolute depth comes from where the object touches the table.
    offset: f64,
    /// Share of the pixels that have a depth, per cent.
    coverage: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    views: Vec<Row>,
    /// Mean of the views' means, millimetres.
    mean: f64,
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
    let scores: Vec<Score> = views.iter().filter_map(|row| row.depth).collect();
    let report = Report {
        mean: scores.iter().map(|score| score.mean).sum::<f64>() / scores.len() as f64,
        views,
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        println!(
            "mean of {} views with depth: {:.3} mm after one offset each",
            scores.len(),
            report.mean
        );
    }
    Ok(())
}

fn score(subject: &Subject<'_>) -> anyhow::Result<Row> {
    let found = solve_view(&subject.capture, &SolveOptions::default())?.depth.depth;
    let (truth, mask) = (subject.truth, &subject.view.mask);
    let score = Score::of(&found, truth, mask);
    subject.picture("depth", || {
        let offset = score.map_or(0.0, |score| score.offset);
        let errors = differences(&found, truth, mask).map(|off| (f64::from(*off) - offset) as f32);
        let errors = Image::from_fn(found.width(), found.height(), |x, y| {
            if mask.contains(x, y) { errors.row(y)[x] } else { 0.0 }
        });
        let pictures = [
            gray_to_rgb(&relief(&found)),
            gray_to_rgb(&relief(&truth.depth)),
            heat(&errors, WHITE_MM),
        ];
        Ok(contact_sheet(&pictures, pictures.len(), GAP).unwrap_or_else(|| gray_to_rgb(&relief(&found))))
    })?;
    Ok(Row {
        scene: subject.scene.to_owned(),
        camera: subject.view.camera.clone(),
        depth: score,
    })
}

/// Found less true depth, millimetres; NaN off the object and where one is missing.
fn differences(found: &Image<f32>, truth: &Truth, mask: &Mask) -> Image<f32> {
    Image::from_fn(found.width(), found.height(), |x, y| {
        if mask.contains(x, y) {
            1e3 * (found.row(y)[x] - truth.depth.row(y)[x])
        } else {
            f32::NAN
        }
    })
}

impl Score {
    /// None when no pixel has a depth.
    fn of(found: &Image<f32>, truth: &Truth, mask: &Mask) -> Option<Self> {
        let differences = differences(found, truth, mask);
        let known = differences.pixels().iter().filter(|off| off.is_finite());
        let mut off: Vec<f64> = known.copied().map(f64::from).collect();
        off.sort_by(f64::total_cmp);
        let offset = *off.get(off.len() / 2)?;
        let mut errors: Vec<f64> = off.iter().map(|off| (off - offset).abs()).collect();
        errors.sort_by(f64::total_cmp);
        let at = |share: f64| errors[((share * errors.len() as f64) as usize).min(errors.len() - 1)];
        Some(Self {
            mean: errors.iter().sum::<f64>() / errors.len() as f64,
            median: at(0.5),
            p95: at(0.95),
            max: at(1.0),
            offset,
            coverage: 100.0 * errors.len() as f64 / mask.count().max(1) as f64,
        })
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:16} {}  ", self.scene, self.camera)?;
        let Some(score) = &self.depth else {
            return write!(f, "no depth");
        };
        write!(
            f,
            "mean {:.3} mm  median {:.3}  p95 {:.2}  max {:.2}  offset {:+.2}  coverage {:.1} %",
            score.mean, score.median, score.p95, score.max, score.offset, score.coverage
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_offset_is_taken_off_and_missing_pixels_are_told() {
        let depth = [0.30_f32, 0.31, 0.32, 0.33, f32::NAN];
        let image = |shift: f32| {
            let mut image = Image::filled(5, 1, 0.0_f32);
            image.pixels_mut().copy_from_slice(&depth.map(|depth| depth + shift));
            image
        };
        let truth = Truth {
            normals: Image::filled(5, 1, [0.0; 3]),
            depth: Image::filled(5, 1, 0.30),
        };
        let score = Score::of(&image(0.002), &truth, &Mask::from_nonzero(&Image::filled(5, 1, 1))).expect("depth");
        assert!((score.offset - 22.0).abs() < 1e-3, "{score:?}");
        assert!(
            (score.mean - 10.0).abs() < 1e-3 && (score.max - 20.0).abs() < 1e-3,
            "{score:?}"
        );
        assert!((score.coverage - 80.0).abs() < 1e-9, "{score:?}");
    }
}
