//! What must not change the normals: the lights' numbers, where base axes point, where in the image the object is.

mod common;

use common::ball::{GAIN, ball_stack, solve, view};
use geometry::RigidTransform;
use geometry::nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use imaging::{ExposureStack, Image};
use photometric::{Bounce, LightRig, NormalSolution, PanelModel, View};
use proptest::prelude::*;

const SIZE: usize = 192;
/// Median and 98th percentile of angles that rounding explains, degrees.
const ROUNDING: [f64; 2] = [0.01, 0.1];

/// The rig as drawn in a room that gives some light back.
fn rig() -> LightRig {
    let in_room = |panel: &PanelModel| {
        let strength = panel.light_vector(&Point3::new(0.43, 0.0, 0.0)).norm();
        PanelModel {
            bounce: Bounce {
                constant: 0.05 * strength,
                linear: Vector3::new(0.01, -0.02, 0.02) * strength,
            },
            ..*panel
        }
    };
    LightRig::new(LightRig::nominal().panels().iter().map(in_room).collect()).unwrap()
}

/// Angles between two solutions, after one is turned, of the pixels that three lights explain in both; and how many have
/// a normal in one only. With fewer lights a normal is a guess, and marked so.
fn angles(one: &NormalSolution, other: &NormalSolution, turn: &UnitQuaternion<f64>) -> (Vec<f64>, usize) {
    let vector = |n: &[f32; 3]| Vector3::from(n.map(f64::from));
    let of = |solution: &NormalSolution| {
        let used = solution.lights_used.pixels().iter().copied();
        solution.normals.pixels().iter().copied().zip(used).collect::<Vec<_>>()
    };
    let (mut angles, mut single) = (Vec::new(), 0);
    for ((a, lights), (b, others)) in of(one).into_iter().zip(of(other)) {
        if a[0].is_nan() != b[0].is_nan() {
            single += 1;
        } else if lights >= 3 && others >= 3 {
            angles.push((turn * vector(&a)).angle(&vector(&b)).to_degrees());
        }
    }
    angles.sort_by(f64::total_cmp);
    (angles, single)
}

/// The same but for rounding: median and 98th percentile of the angle are below `most`, degrees.
fn assert_same(one: &NormalSolution, other: &NormalSolution, turn: &UnitQuaternion<f64>, most: [f64; 2]) {
    let (angles, single) = angles(one, other, turn);
    let count = angles.len();
    assert!(
        count > 1000 && single <= count / 100,
        "{count} pixels, {single} in one only"
    );
    let found = [angles[count / 2], angles[count * 98 / 100]];
    assert!(
        found[0] < most[0] && found[1] < most[1],
        "{found:?} degrees, allowed {most:?}"
    );
}

/// The images with other numbers: light i becomes `order[i - 1]`.
fn renumbered(stack: &ExposureStack, rig: &LightRig, order: &[u8]) -> (ExposureStack, LightRig) {
    let number = |channel: u8| order[usize::from(channel) - 1];
    let panels = rig.panels().iter().map(|panel| PanelModel {
        channel: number(panel.channel),
        ..*panel
    });
    let lit = stack
        .channels()
        .map(|channel| (number(channel), stack.light(channel).unwrap().clone()));
    let images = std::iter::once((0, stack.dark().clone())).chain(lit);
    (
        ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, stack.saturation()).unwrap(),
        LightRig::new(panels.collect()).unwrap(),
    )
}

fn moved(rig: &LightRig, motion: &RigidTransform) -> LightRig {
    let turned = |direction: &Unit<Vector3<f64>>| Unit::new_normalize(motion.transform_direction(direction));
    let panel = |panel: &PanelModel| {
        let mut panel = *panel;
        panel.rectangle.centre = motion.transform_point(&panel.rectangle.centre);
        panel.rectangle.facing = turned(&panel.rectangle.facing);
        panel.rectangle.right = turned(&panel.rectangle.right);
        panel.bounce.linear = motion.transform_direction(&panel.bounce.linear);
        panel
    };
    LightRig::new(rig.panels().iter().map(panel).collect()).unwrap()
}

fn cropped(stack: &ExposureStack, [left, top]: [usize; 2], size: usize) -> ExposureStack {
    let part = |image: &Image<u16>| image.crop(left, top, size, size).unwrap();
    let lit = stack
        .channels()
        .map(|channel| (channel, part(stack.light(channel).unwrap())));
    let images = std::iter::once((0, part(stack.dark()))).chain(lit);
    ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, stack.saturation()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(8) })]

    #[test]
    fn the_lights_numbers_do_not_matter(order in Just(vec![1_u8, 2, 3, 4, 5, 6, 7]).prop_shuffle()) {
        let (view, rig) = (view(SIZE), rig());
        let stack = ball_stack(&view, &rig, 1.0);
        let (_, found) = solve(&stack, &view, &rig);
        let (stack, rig) = renumbered(&stack, &rig, &order);
        let (_, renumbered) = solve(&stack, &view, &rig);
        assert_same(&found, &renumbered, &UnitQuaternion::identity(), ROUNDING);
    }

    #[test]
    fn normals_turn_with_the_world(turn in -3.1_f64..3.1) {
        let (view, rig) = (view(SIZE), rig());
        let stack = ball_stack(&view, &rig, 1.0);
        let (_, found) = solve(&stack, &view, &rig);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn);
        // About the middle of the mat: what lies beside it is no object.
        let middle = Vector3::new(0.43, 0.0, 0.0);
        let motion = RigidTransform::from_parts(middle - turn * middle, turn);
        let there = View { base_from_camera: motion * view.base_from_camera, ..view };
        let (_, turned) = solve(&stack, &there, &moved(&rig, &motion));
        assert_same(&found, &turned, &turn, ROUNDING);
    }

    #[test]
    fn a_shift_in_the_image_does_not_matter(left in 0_usize..8, top in 0_usize..8) {
        let (view, rig) = (view(SIZE), rig());
        let stack = ball_stack(&view, &rig, 1.0);
        let size = SIZE - 8;
        let at = |corner: [usize; 2]| {
            let camera = view.camera.crop(corner[0], corner[1], size, size).unwrap();
            solve(&cropped(&stack, corner, size), &View { camera, ..view }, &rig).1
        };
        let (first, second) = (at([0, 0]), at([left, top]));
        let part = |solution: &NormalSolution, [left, top]: [usize; 2]| {
            let mut solution = solution.clone();
            solution.normals = solution.normals.crop(left, top, size - 8, size - 8).unwrap();
            solution.lights_used = solution.lights_used.crop(left, top, size - 8, size - 8).unwrap();
            solution
        };
        // Where the shift is odd the first look sees other pixels together.
        let (first, second) = (part(&first, [left, top]), part(&second, [0, 0]));
        assert_same(&first, &second, &UnitQuaternion::identity(), [0.06, 1.5]);
    }

    #[test]
    fn brightness_goes_into_the_gain_alone(scale in 0.25_f64..1.2) {
        let (view, rig) = (view(SIZE), rig());
        let (_, found) = solve(&ball_stack(&view, &rig, 1.0), &view, &rig);
        let (_, scaled) = solve(&ball_stack(&view, &rig, scale), &view, &rig);
        prop_assert!((scaled.gain / (scale * GAIN) - 1.0).abs() < 0.04, "{}", scaled.gain);
        // Darker images are rounded more coarsely and held less firmly against their neighbours.
        let (angles, _) = angles(&found, &scaled, &UnitQuaternion::identity());
        prop_assert!(angles[angles.len() / 2] < 0.3, "{}", angles[angles.len() / 2]);
    }
}
