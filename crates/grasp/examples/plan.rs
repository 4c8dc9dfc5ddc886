//! Plans grasps on captures with truth: `cargo run --release -p grasp --example plan -- SCENE_DIR OUT_DIR`.
//!
//! Writes what each view shows with the grasps in green (footprint, normal and rank) and what was refused in red, and
//! tells how far contacts and normals are from the truth: for solid objects, and once more for thin ones by their
//! outlines. The first folder may hold several scenes; the cup's diameter in millimetres can follow.

mod common;

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use common::{Solved, inputs, lights, solve_scene};
use geometry::nalgebra::{Point2, Point3, Vector3};
use grasp::{Cup, Grasp, GraspError, Overlay, Plan, PlanOptions, Source, ViewInput, plan, plan_thin};
use imaging::{encode_png, gray_picture, gray_to_rgb};

/// How far grasps are from the truth.
#[derive(Default)]
struct Errors {
    millimetres: Vec<f64>,
    degrees: Vec<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (scenes, out, cup) = match arguments.as_slice() {
        [scenes, out] => (scenes, out, Cup::default()),
        [scenes, out, diameter] => (scenes, out, cup_of(1e-3 * diameter.parse::<f64>()?)),
        _ => return Err("usage: plan SCENE_DIR OUT_DIR [CUP_MM]".into()),
    };
    std::fs::create_dir_all(out)?;
    let rig = lights()?;
    let mut errors = [Errors::default(), Errors::default(), Errors::default()];
    for folder in rig_scenes::find_scenes(Path::new(scenes))? {
        let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let solved = solve_scene(&folder, &rig)?;
        for (mode, plan) in [("solid", plan as Planner), ("thin", plan_thin)] {
            let started = Instant::now();
            let found = plan(&inputs(&solved), &cup, &PlanOptions::default())?;
            let milliseconds = 1e3 * started.elapsed().as_secs_f64();
            println!("{name}, {mode}: {} grasps in {milliseconds:.0} ms", found.grasps.len());
            for (rank, grasp) in found.grasps.iter().enumerate() {
                tell(rank, grasp, &solved, &mut errors[kind(grasp)]);
            }
            for refused in &found.refused {
                println!("   refused: {refused}");
            }
            draw(&found, &solved, &cup, &format!("{out}/{name}_{mode}"))?;
        }
    }
    for (what, errors) in ["both views", "one view", "outlines"].into_iter().zip(errors) {
        println!("{what}: {}", errors.summary());
    }
    Ok(())
}

type Planner = fn(&[ViewInput<'_>], &Cup, &PlanOptions) -> Result<Plan, GraspError>;

fn cup_of(diameter: f64) -> Cup {
    let usual = Cup::default();
    Cup {
        diameter,
        compliance: usual.compliance.min(diameter / 2.0),
        ..usual
    }
}

fn kind(grasp: &Grasp) -> usize {
    match grasp.source {
        Source::BothViews { .. } => 0,
        Source::OneView { .. } => 1,
        Source::Outline { .. } => 2,
    }
}

fn tell(rank: usize, grasp: &Grasp, solved: &[Solved], errors: &mut Errors) {
    let view = match &grasp.source {
        Source::OneView { view, .. } => *view,
        _ => 0,
    };
    let (m, source) = (&grasp.measured, &grasp.source);
    let truth = truth(&grasp.contact, &solved[view]);
    let (off, angle) = truth.map_or((f64::NAN, f64::NAN), |(point, normal)| {
        let angle = normal.dot(&grasp.normal).clamp(-1.0, 1.0).acos().to_degrees();
        (1e3 * (grasp.contact - point).dot(&normal), angle)
    });
    if off.is_finite() {
        errors.millimetres.push(off.abs());
        errors.degrees.push(angle);
    }
    println!(
        "  {rank}: total {:.2}, off {off:+.2} mm (sigma {:.2}), {angle:.1} deg; normal {:.2?}; edges {:.3} {:.3}, gap {:.2} mm, \
         confidence {:.2}, border {:.1} mm, centre {:.0} mm",
        grasp.total,
        1e3 * m.sigma,
        grasp.normal.as_slice(),
        m.edge_share,
        m.edge_moment,
        1e3 * m.gap,
        m.confidence,
        1e3 * m.border,
        1e3 * m.from_centre
    );
    if let Source::BothViews {
        epipolar_px,
        normal_angle,
        mismatch,
        ..
    } = source
    {
        println!(
            "     epipolar {epipolar_px:.1} px, between normals {:.1} deg, mismatch {mismatch:.3}",
            normal_angle.to_degrees()
        );
    }
}

/// True point and normal on a view's ray through a contact.
fn truth(contact: &Point3<f64>, solved: &Solved) -> Option<(Point3<f64>, Vector3<f64>)> {
    let view = &solved.captured.view;
    let truth = solved.captured.truth.as_ref()?;
    let pixel = view
        .camera
        .project(&view.base_from_camera.inverse().transform_point(contact))?;
    let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
    let (depth, normal) = (*truth.depth.get(x, y)?, *truth.normals.get(x, y)?);
    let ray = view.camera.unproject(&Point2::new(x as f64, y as f64)).ok()?;
    let point = view
        .base_from_camera
        .transform_point(&Point3::from(ray * f64::from(depth)));
    // Off the pixel's middle the true surface goes on along its normal.
    (depth.is_finite() && normal[0].is_finite()).then(|| (point, Vector3::from(normal.map(f64::from))))
}

impl Errors {
    fn summary(&self) -> String {
        let at = |values: &[f64], share: f64| {
            let mut values = values.to_vec();
            values.sort_by(f64::total_cmp);
            values
                .get(((values.len().max(1) - 1) as f64 * share).round() as usize)
                .copied()
                .unwrap_or(f64::NAN)
        };
        format!(
            "{} grasps, along the normal {:.2} mm at the median, {:.2} at 95 %; normals {:.1} and {:.1} degrees",
            self.degrees.len(),
            at(&self.millimetres, 0.5),
            at(&self.millimetres, 0.95),
            at(&self.degrees, 0.5),
            at(&self.degrees, 0.95)
        )
    }
}

fn draw(plan: &Plan, solved: &[Solved], cup: &Cup, path: &str) -> Result<(), Box<dyn Error>> {
    for solved in solved {
        let captured = &solved.captured;
        let image = captured.stack.light(7).ok_or("no image of the overhead light")?;
        let brightest = image.pixels().iter().copied().max().unwrap_or(u16::MAX);
        let gray = gray_to_rgb(&gray_picture(image, 0.0, 1.5 * f32::from(brightest))?);
        let mut overlay = Overlay::new(gray, captured.view.camera, &captured.view.base_from_camera);
        overlay.plan(plan, cup);
        std::fs::write(
            format!("{path}_{}.png", captured.camera),
            encode_png(overlay.picture())?,
        )?;
    }
    Ok(())
}
