//! Five panels over time.

use std::f64::consts::TAU;

use anyhow::{Context, anyhow};
use imaging::Image;
use plotters::backend::{BitMapBackend, RGBPixel};
use plotters::drawing::IntoDrawingArea;
use plotters::style::{FontStyle, RGBColor, WHITE, register_font};
use trajectory::{JointLimits, Planner, Snapshot};

use super::panel::{Limit, NAMES_HEIGHT, Panel, Series, draw_names};
use super::pick::Pick;

const WIDTH: usize = 1600;
const HEIGHT: usize = 2320;
/// Between samples, seconds.
const STEP: f64 = 2e-3;
/// Okabe and Ito's colours, which people with colour-blindness can tell apart, yellow replaced by a brown.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(213, 94, 0),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(120, 80, 40),
];
const TOOL: RGBColor = RGBColor(40, 40, 40);
const LIMIT: RGBColor = RGBColor(200, 0, 0);

/// The motion's samples.
struct Samples {
    times: Vec<f64>,
    snapshots: Vec<Snapshot<7>>,
}

pub(super) fn draw(planner: &Planner<7>, pick: &Pick) -> anyhow::Result<Image<[u8; 3]>> {
    register_font("sans-serif", FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
        .map_err(|_| anyhow!("the built-in font cannot be read"))?;
    let samples = Samples::of(planner, pick)?;
    let panels = panels(planner, pick, &samples);
    let mut bytes = vec![0; WIDTH * HEIGHT * 3];
    {
        let backend = BitMapBackend::<RGBPixel>::with_buffer(&mut bytes, (WIDTH as u32, HEIGHT as u32));
        let root = backend.into_drawing_area();
        root.fill(&WHITE)?;
        let (names, charts) = root.split_vertically(NAMES_HEIGHT);
        draw_names(&names, &pick.parts, pick.trajectory.duration())?;
        let areas = charts.split_evenly((panels.len(), 1));
        for (panel, area) in panels.iter().zip(&areas) {
            panel.draw(area, &pick.parts)?;
        }
        root.present()?;
    }
    let pixels = bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]);
    Image::new(WIDTH, HEIGHT, pixels.collect()).context("the picture has all of its pixels")
}

impl Samples {
    fn of(planner: &Planner<7>, pick: &Pick) -> anyhow::Result<Self> {
        let duration = pick.trajectory.duration();
        let count = (duration / STEP).ceil() as usize;
        let times: Vec<f64> = (0..=count).map(|index| (index as f64 * STEP).min(duration)).collect();
        let snapshots = times.iter().map(|time| planner.snapshot(&pick.trajectory, *time));
        Ok(Self {
            snapshots: snapshots.collect::<Result<_, _>>()?,
            times,
        })
    }

    fn joints(&self, value: impl Fn(&Snapshot<7>, usize) -> f64) -> Vec<Series> {
        let series = |joint: usize| Series {
            name: format!("J{}", joint + 1),
            colour: COLOURS[joint],
            points: self.points(|snapshot| value(snapshot, joint)),
        };
        (0..7).map(series).collect()
    }

    fn points(&self, value: impl Fn(&Snapshot<7>) -> f64) -> Vec<(f64, f64)> {
        let values = self.snapshots.iter().map(value);
        self.times.iter().copied().zip(values).collect()
    }
}

fn panels(planner: &Planner<7>, pick: &Pick, samples: &Samples) -> Vec<Panel> {
    let limits = planner.limits();
    let joint = &limits.joints[0];
    let panel = |title: &str, series: Vec<Series>, limits: Vec<Limit>, notes: Vec<String>| Panel {
        title: title.to_owned(),
        duration: pick.trajectory.duration(),
        series,
        limits,
        notes,
    };
    let of_joints = |title: &str, value: &dyn Fn(&Snapshot<7>, usize) -> f64, most: f64| {
        let both = [most, -most].map(|at| Limit::new(at, LIMIT));
        panel(title, samples.joints(value), both.into(), vec![limit_note(most)])
    };
    let tool = Series {
        name: "tool".to_owned(),
        colour: TOOL,
        points: samples.points(|now| now.tool_speed),
    };
    let (position_limits, notes) = position_limits(&limits.joints);
    let positions = samples.joints(|now, joint| now.states[joint].position);
    vec![
        panel("position, rad", positions, position_limits, notes),
        of_joints("speed, rad/s", &|now, joint| now.states[joint].velocity, joint.velocity),
        of_joints(
            "acceleration, rad/s²",
            &|now, joint| now.states[joint].acceleration,
            joint.acceleration,
        ),
        of_joints("jerk, rad/s³", &|now, joint| now.jerk[joint], joint.jerk),
        panel(
            "tool speed, m/s",
            vec![tool],
            vec![Limit::new(limits.tool_speed, LIMIT)],
            vec![limit_note(limits.tool_speed)],
        ),
    ]
}

/// To two places.
fn limit_note(most: f64) -> String {
    format!("limit {}", (100.0 * most).round() / 100.0)
}

/// Lines in the joints' colours; those of joints that turn all the way round, which are far away, in words.
fn position_limits(joints: &[JointLimits; 7]) -> (Vec<Limit>, Vec<String>) {
    let turns_round = |limits: &JointLimits| limits.upper - limits.lower > TAU;
    let lines = joints.iter().zip(COLOURS).filter(|(limits, _)| !turns_round(limits));
    let lines = lines.flat_map(|(limits, colour)| [limits.lower, limits.upper].map(|at| Limit::new(at, colour)));
    let others = joints.iter().enumerate().filter(|(_, limits)| turns_round(limits));
    let names: Vec<String> = others.map(|(joint, _)| (joint + 1).to_string()).collect();
    let most = joints.iter().map(|limits| limits.upper).fold(0.0, f64::max);
    let mut notes = vec!["dashed: limits".to_owned()];
    if !names.is_empty() {
        notes.push(format!("J{}: {most:.2}", names.join(", ")));
    }
    (lines.collect(), notes)
}
