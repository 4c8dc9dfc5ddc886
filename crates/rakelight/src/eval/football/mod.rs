//! `rakelight eval football`: real photographs, six oblique lights and no calibration, against a fitted sphere.
//!
//! The lights' directions come with the photographs and are rough, so each is fitted anew to the ball itself, whose
//! outline gives its sphere: three numbers for each light against some hundred thousand pixels. Distant lights are small
//! panels 20 m away to the solver, which then works as it does in the cell.

mod ball;
mod circle;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use geometry::Rectangle;
use geometry::nalgebra::{Unit, Vector3};
use imaging::{ExposureStack, Image, Mask, encode_png, gray_to_rgb, normal_picture};
use photometric::{
    Bounce, Capture, DirectionalLight, EdgeInput, EdgeOptions, IntegrationInput, IntegrationOptions,
    LeastSquaresOptions, LightRig, PanelModel, PixelRays, SensorNoise, SolveOptions, integrate, least_squares_normals,
    occlusion_edges, solve_normals,
};
use serde::Serialize;

use crate::demo::football::Football;
use crate::failure::Failure;
use crate::relief::relief;
use ball::Ball;

/// Where distant lights stand, and how large they are, metres.
const DISTANCE: f64 = 20.0;
const SIDE: f64 = 0.5;
/// The lights are neither distant nor even, and the photographs have eight bits with a gamma: a sample in the middle of
/// the range is predicted to 5 %.
const NOISE: SensorNoise = SensorNoise {
    electrons_per_dn: 0.02,
    read_electrons: 8.0,
    step_dn: 400.0,
};

#[derive(Args)]
pub(crate) struct Arguments {
    /// Folder of the photographs.
    #[arg(long, value_name = "DIR", default_value = "../shared/data/white_football")]
    photographs: PathBuf,
    /// Write pictures of normals, edges and relief into this folder.
    #[arg(long, value_name = "DIR")]
    png: Option<PathBuf>,
    /// Tell the figures as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Angles to the fitted sphere, degrees; pixels without a normal count as 90. Seams are not a sphere's.
#[derive(Debug, Clone, Copy, Serialize)]
struct Score {
    mean: f64,
    median: f64,
}

#[derive(Debug, Serialize)]
struct Report {
    /// Least squares under the lights that come with the photographs.
    rough_least_squares: Score,
    /// Least squares under the fitted lights.
    least_squares: Score,
    /// The solver under the fitted lights.
    normals: Score,
    /// Mean distance of the integrated depth to the sphere after one offset, as a share of the radius.
    depth_share: f64,
    edge_pixels: usize,
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    tokio::task::spawn_blocking(move || evaluate(&arguments)).await?
}

fn evaluate(arguments: &Arguments) -> Result<(), Failure> {
    let football = Football::read(&arguments.photographs).map_err(Failure::usage)?;
    let stack = football.stack()?;
    let ball = Ball::of(&football.mask, football.focal)?;
    let lights = ball.lights(&stack)?;
    let rig = far_panels(&lights)?;
    let rays = PixelRays::new(&ball.view.camera);
    let capture = Capture {
        stack: &stack,
        view: &ball.view,
        rays: &rays,
        rig: &rig,
        noise: NOISE,
    };
    let report = measure(&football, &ball, &capture, arguments.png.as_deref())?;
    if arguments.json {
        println!(
            "{}",
            serde_json::to_string_pretty(&report).context("cannot write the figures")?
        );
    } else {
        print!("{}", report.for_people());
    }
    Ok(())
}

fn measure(football: &Football, ball: &Ball, capture: &Capture<'_>, png: Option<&Path>) -> anyhow::Result<Report> {
    let mask = &ball.mask(&football.mask);
    let rough = football.light_directions_in_camera.iter().zip(1_u8..);
    let rough = rough.map(|(light, channel)| (channel, Vector3::new(light[0], -light[1], -light[2])));
    let solution = solve_normals(capture, mask, &SolveOptions::default())?;
    let depth = integrate(
        &IntegrationInput {
            normals: &solution.normals,
            confidence: &solution.confidence,
            mask,
            view: capture.view,
            rays: capture.rays,
        },
        &IntegrationOptions::default(),
    )?;
    let input = EdgeInput {
        capture,
        mask: Some(mask),
        depth: Some(&depth.depth),
    };
    let edges = occlusion_edges(&input, &EdgeOptions::default())?.edges;
    if let Some(folder) = png {
        write_pictures(folder, capture.stack, &solution.normals, &depth.depth, &edges)?;
    }
    Ok(Report {
        rough_least_squares: Score::of(&plain(capture.stack, rough)?, ball),
        least_squares: Score::of(&plain(capture.stack, fitted(capture.rig))?, ball),
        normals: Score::of(&solution.normals, ball),
        depth_share: depth_share(&depth.depth, ball, capture),
        edge_pixels: edges.count(),
    })
}

fn plain(stack: &ExposureStack, lights: impl Iterator<Item = (u8, Vector3<f64>)>) -> anyhow::Result<Image<[f32; 3]>> {
    let light = |(channel, vector): (u8, Vector3<f64>)| DirectionalLight::new(channel, vector.into(), vector.norm());
    let lights = lights.map(light).collect::<Result<Vec<_>, _>>()?;
    Ok(least_squares_normals(stack, &lights, &LeastSquaresOptions::default())?.normals)
}

/// The rig's lights at the ball.
fn fitted(rig: &LightRig) -> impl Iterator<Item = (u8, Vector3<f64>)> {
    rig.panels()
        .iter()
        .map(|panel| (panel.channel, panel.light_vector(&ball::CENTRE)))
}

/// A panel far away for each light vector.
fn far_panels(lights: &[(u8, Vector3<f64>)]) -> anyhow::Result<LightRig> {
    let strongest = lights.iter().map(|(_, light)| light.norm()).fold(0.0, f64::max);
    let panel = |&(channel, light): &(u8, Vector3<f64>)| {
        let towards = Unit::new_normalize(light);
        let rectangle = Rectangle {
            centre: ball::CENTRE + towards.into_inner() * DISTANCE,
            facing: -towards,
            right: Unit::new_normalize(Vector3::z().cross(&towards)),
            size: [SIDE; 2],
        };
        PanelModel {
            channel,
            rectangle,
            radiance: light.norm() / strongest / rectangle.vector_form_factor(&ball::CENTRE).norm(),
            bounce: Bounce::NONE,
        }
    };
    Ok(LightRig::new(lights.iter().map(panel).collect())?)
}

impl Score {
    fn of(normals: &Image<[f32; 3]>, ball: &Ball) -> Self {
        let angle = |(at, truth): &(usize, Vector3<f64>)| {
            let found = Vector3::from(normals.pixels()[*at]).cast::<f64>();
            let cosine = found.dot(truth);
            if cosine.is_nan() {
                90.0
            } else {
                cosine.clamp(-1.0, 1.0).acos().to_degrees()
            }
        };
        let mut angles: Vec<f64> = ball.normals.iter().map(angle).collect();
        angles.sort_by(f64::total_cmp);
        Self {
            mean: angles.iter().sum::<f64>() / angles.len() as f64,
            median: angles[angles.len() / 2],
        }
    }
}

/// Mean distance between the depth and the sphere's, as a share of the sphere's radius.
fn depth_share(depth: &Image<f32>, ball: &Ball, capture: &Capture<'_>) -> f64 {
    let above = |(at, normal): &(usize, Vector3<f64>)| {
        let ideal = capture.rays.ideal().pixels()[*at];
        let point = capture.view.point_at_depth(ideal, f64::from(depth.pixels()[*at]));
        point.z / ball::RADIUS - (1.0 + normal.z)
    };
    let mut off: Vec<f64> = ball.normals.iter().map(above).filter(|off| off.is_finite()).collect();
    off.sort_by(f64::total_cmp);
    let offset = off.get(off.len() / 2).copied().unwrap_or(f64::NAN);
    off.iter().map(|off| (off - offset).abs()).sum::<f64>() / off.len() as f64
}

fn write_pictures(
    folder: &Path,
    stack: &ExposureStack,
    normals: &Image<[f32; 3]>,
    depth: &Image<f32>,
    edges: &Mask,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let lit = stack.light(1).unwrap_or(stack.dark());
    let overlay = Image::from_fn(lit.width(), lit.height(), |x, y| {
        let gray = (f32::from(lit.row(y)[x]) / f32::from(u16::MAX)).sqrt() * 200.0;
        if edges.contains(x, y) {
            [255, 40, 40]
        } else {
            [gray as u8; 3]
        }
    });
    for (what, picture) in [
        ("normals", normal_picture(normals)),
        ("relief", gray_to_rgb(&relief(depth))),
        ("edges", overlay),
    ] {
        let path = folder.join(format!("football_{what}.png"));
        std::fs::write(&path, encode_png(&picture)?).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

impl Report {
    fn for_people(&self) -> String {
        let row = |what: &str, score: &Score| {
            format!(
                "{what:44} mean {:5.2}  median {:5.2} degrees to the fitted sphere\n",
                score.mean, score.median
            )
        };
        row("least squares, lights as they come", &self.rough_least_squares)
            + &row("least squares, lights fitted to the ball", &self.least_squares)
            + &row("near-field solver, lights fitted to the ball", &self.normals)
            + &format!(
                "depth: {:.2} % of the radius from the sphere after one offset; {} edge pixels\n",
                100.0 * self.depth_share,
                self.edge_pixels
            )
    }
}
