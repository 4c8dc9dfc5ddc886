//! What each step of the method gains: the same captures with steps left out.

use std::fmt;

use geometry::nalgebra::{Matrix3, Vector3};
use imaging::{Image, Mask};
use photometric::{
    Bounce, Capture, LeastSquaresOptions, LightRig, NearFieldOptions, PanelModel, ReferenceOptions, SolveOptions,
    least_squares_normals, near_field_normals, object_mask, reference_normals, solve_normals,
};
use serde::Serialize;

use super::directional;
use super::score::Score;
use crate::eval::scenes::{SceneArguments, Subject};
use crate::failure::Failure;

/// Where the surface is taken to be by methods that know no depth, metres over the table.
const HEIGHT: f64 = 0.015;
/// A light that gives less than this share of the brightest one is left out by thresholded least squares.
const DIM: f64 = 0.15;

/// Normals of a subject's object mask by one variant of the method.
type Solve = fn(&Subject<'_>, &Mask) -> anyhow::Result<Image<[f32; 3]>>;

/// From what everybody does to all of it; each of the middle ones adds a step to the one before.
const VARIANTS: [(&str, Solve); 9] = [
    ("least squares, distant lights", distant),
    ("published method", published),
    ("least squares, near panels, dark lights left out", near_least_squares),
    ("near panels, shadow hypotheses, robust", hypotheses),
    ("+ coupling of neighbours", coupled),
    ("+ first look: depth fed back", fed_back),
    ("+ light of the object itself: all of it", all),
    ("all, but for the coupling", all_uncoupled),
    ("all, but for the room's light", all_in_a_black_room),
];

/// One variant's mean angles, degrees.
#[derive(Debug, Serialize)]
struct Row {
    variant: &'static str,
    /// Scene by scene, in the order of `scenes`.
    means: Vec<f64>,
    mean: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    /// Name and camera.
    scenes: Vec<String>,
    variants: Vec<Row>,
}

pub(super) fn evaluate(arguments: &SceneArguments) -> Result<(), Failure> {
    let columns = arguments.open()?.rows(|subject| {
        let mask = object_mask(&subject.capture, &SolveOptions::default().mask)?;
        let score = |(_, solve): &(&str, Solve)| -> anyhow::Result<f64> {
            Ok(Score::of(&solve(subject, &mask)?, subject.truth, &subject.view.mask).mean)
        };
        let means = VARIANTS.iter().map(score).collect::<anyhow::Result<Vec<_>>>()?;
        Ok((format!("{} {}", subject.scene, subject.view.camera), means))
    })?;
    let row = |(place, (variant, _)): (usize, &(&'static str, Solve))| {
        let means: Vec<f64> = columns.iter().map(|(_, means)| means[place]).collect();
        Row {
            variant,
            mean: means.iter().sum::<f64>() / means.len() as f64,
            means,
        }
    };
    let report = Report {
        variants: VARIANTS.iter().enumerate().map(row).collect(),
        scenes: columns.iter().map(|(scene, _)| scene.clone()).collect(),
    };
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{report}");
    }
    Ok(())
}

/// A table that Markdown understands, one row for each variant.
impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = VARIANTS.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        writeln!(f, "| {:width$} | {} | mean |", "degrees", self.scenes.join(" | "))?;
        writeln!(
            f,
            "|{}|{}",
            "-".repeat(width + 2),
            "---:|".repeat(self.scenes.len() + 1)
        )?;
        for row in &self.variants {
            write!(f, "| {:width$} |", row.variant)?;
            for mean in &row.means {
                write!(f, " {mean:.2} |")?;
            }
            writeln!(f, " {:.2} |", row.mean)?;
        }
        Ok(())
    }
}

fn distant(subject: &Subject<'_>, _: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let lights = directional(&subject.lights.rig)?;
    Ok(least_squares_normals(&subject.view.stack, &lights, &LeastSquaresOptions::default())?.normals)
}

fn published(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let lights = &subject.lights.polynomials;
    Ok(reference_normals(&subject.capture, mask, lights, &ReferenceOptions::default())?.normals)
}

fn near_least_squares(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let capture = &subject.capture;
    let mut normals = Image::filled(capture.stack.width(), capture.stack.height(), [f32::NAN; 3]);
    let width = normals.width();
    for (index, normal) in normals.pixels_mut().iter_mut().enumerate() {
        let (x, y) = (index % width, index / width);
        if let Some(found) = mask.contains(x, y).then(|| least_squares_at(capture, x, y)).flatten() {
            *normal = found.cast::<f32>().into();
        }
    }
    mask.fill_outside(&mut normals, [f32::NAN; 3])?;
    Ok(normals)
}

/// The normal of the lights that are not dark, under the panels' light vectors at the usual height; none when fewer than
/// three are left.
fn least_squares_at(capture: &Capture<'_>, x: usize, y: usize) -> Option<Vector3<f64>> {
    let ideal = capture.rays.ideal().row(y)[x];
    let point = capture
        .view
        .point_at_depth(ideal, capture.view.depth_of_plane(ideal, HEIGHT));
    let dark = f64::from(capture.stack.dark().row(y)[x]);
    let sample = |panel: &PanelModel| {
        let signal = f64::from(capture.stack.light(panel.channel)?.row(y)[x]) - dark;
        Some((signal, panel.light_vector(&point)))
    };
    let samples: Vec<_> = capture.rig.panels().iter().filter_map(sample).collect();
    let brightest = samples.iter().map(|(signal, _)| *signal).fold(0.0, f64::max);
    let lit: Vec<_> = samples.iter().filter(|(signal, _)| *signal > DIM * brightest).collect();
    let matrix: Matrix3<f64> = lit.iter().map(|(_, light)| light * light.transpose()).sum();
    let right: Vector3<f64> = lit.iter().map(|(signal, light)| light * *signal).sum();
    let solution = (lit.len() >= 3).then(|| matrix.try_inverse())??;
    (solution * right).try_normalize(0.0)
}

/// No neighbours, no depth, no light by way of the object.
const BARE: NearFieldOptions = NearFieldOptions {
    coupling: 0.0,
    reflectance: 0.0,
};

fn hypotheses(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    Ok(near_field_normals(&subject.capture, mask, None, BARE)?.normals)
}

fn coupled(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let options = NearFieldOptions {
        reflectance: 0.0,
        ..NearFieldOptions::default()
    };
    Ok(near_field_normals(&subject.capture, mask, None, options)?.normals)
}

fn fed_back(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let normals = NearFieldOptions {
        reflectance: 0.0,
        ..NearFieldOptions::default()
    };
    by_all(&subject.capture, mask, normals)
}

fn all(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    by_all(&subject.capture, mask, NearFieldOptions::default())
}

fn all_uncoupled(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let normals = NearFieldOptions {
        coupling: 0.0,
        ..NearFieldOptions::default()
    };
    by_all(&subject.capture, mask, normals)
}

fn all_in_a_black_room(subject: &Subject<'_>, mask: &Mask) -> anyhow::Result<Image<[f32; 3]>> {
    let panels = subject.lights.rig.panels().iter().map(|panel| PanelModel {
        bounce: Bounce::NONE,
        ..*panel
    });
    let rig = LightRig::new(panels.collect())?;
    let capture = Capture {
        rig: &rig,
        ..subject.capture
    };
    by_all(&capture, mask, NearFieldOptions::default())
}

fn by_all(capture: &Capture<'_>, mask: &Mask, normals: NearFieldOptions) -> anyhow::Result<Image<[f32; 3]>> {
    let options = SolveOptions {
        normals,
        ..SolveOptions::default()
    };
    Ok(solve_normals(capture, mask, &options)?.normals)
}
