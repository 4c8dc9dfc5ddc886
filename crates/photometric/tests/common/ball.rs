//! A ball under the rig's panels, without noise and without cast shadows, and the solver on it.

use geometry::nalgebra::{Point2, Point3, UnitQuaternion, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::{ExposureStack, Image, Mask};
use photometric::{
    Capture, LightRig, NormalSolution, ObjectMaskOptions, PixelRays, SensorNoise, SolveOptions, View, object_mask,
    solve_normals,
};

/// A camera straight above the middle of the mat.
pub(crate) fn view(size: usize) -> View {
    let middle = (size as f64 - 1.0) / 2.0;
    let focal = size as f64 * 1.5;
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    View {
        camera: PinholeCamera::new(size, size, [focal; 2], [middle; 2]).unwrap(),
        base_from_camera: RigidTransform::from_parts(Vector3::new(0.43, 0.0, 0.3), down),
    }
}

pub(crate) const GAIN: f64 = 400_000.0;

/// The normal of a ball of 20 mm radius whose middle is 15 mm over the mat, and where it is hit.
pub(crate) fn ball(view: &View, pixel: [f64; 2]) -> Option<(Point3<f64>, Vector3<f64>)> {
    let ray = view.camera.unproject(&Point2::from(pixel)).unwrap();
    let direction = view.base_from_camera.transform_direction(&ray).normalize();
    let to_camera = view.centre() - Point3::new(0.43, 0.0, 0.015);
    let along = direction.dot(&to_camera);
    let root = along * along - to_camera.norm_squared() + 0.0004;
    let point = view.centre() + direction * (-along - root.max(0.0).sqrt());
    (root > 0.0).then(|| (point, (to_camera + direction * (-along - root.sqrt())) / 0.02))
}

/// The ball on a dark mat, without noise and without cast shadows.
pub(crate) fn ball_stack(view: &View, rig: &LightRig, scale: f64) -> ExposureStack {
    let (width, height) = (view.camera.width(), view.camera.height());
    let image = |channel: u8| {
        let panel = rig.panels().iter().find(|panel| panel.channel == channel).unwrap();
        Image::from_fn(width, height, |x, y| {
            let lit = ball(view, [x as f64, y as f64]).map_or(0.0, |(point, normal)| panel.irradiance(&point, &normal));
            let level = panel.irradiance(&Point3::new(0.43, 0.0, 0.0), &Vector3::z()) * 0.05;
            (500.0 + scale * GAIN * lit.max(level)).round().min(65_535.0) as u16
        })
    };
    let images = std::iter::once((0, Image::filled(width, height, 500_u16)));
    let images = images.chain(rig.channels().into_iter().map(|channel| (channel, image(channel))));
    ExposureStack::new(&rig.channels(), images, 65_520).unwrap()
}

pub(crate) fn solve(stack: &ExposureStack, view: &View, rig: &LightRig) -> (Mask, NormalSolution) {
    let rays = PixelRays::new(&view.camera);
    let noise = SensorNoise::RIG;
    let capture = Capture {
        stack,
        view,
        rays: &rays,
        rig,
        noise,
    };
    let mask = object_mask(
        &capture,
        &ObjectMaskOptions {
            least_pixels: 8,
            ..ObjectMaskOptions::default()
        },
    )
    .unwrap();
    let solution = solve_normals(&capture, &mask, &SolveOptions::default()).unwrap();
    (mask, solution)
}

pub(crate) fn angle(a: [f32; 3], b: &Vector3<f64>) -> f64 {
    if a[0].is_nan() {
        return 90.0;
    }
    Vector3::from(a.map(f64::from)).angle(b).to_degrees()
}
