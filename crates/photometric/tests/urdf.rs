//! The cell's URDF against the rig's dimensions.

use std::path::Path;

use photometric::nominal_panels;
use urdf_rs::{Geometry, JointType, Robot};

/// Six decimals are written in the file.
const TOLERANCE: f64 = 2e-6;

fn cell() -> Robot {
    urdf_rs::read_file(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../urdf/cell.urdf")).expect("cell.urdf is a URDF")
}

/// Axis z of a frame with these URDF angles (fixed axes: roll about x, then pitch about y, then yaw about z).
fn z_axis([roll, pitch, yaw]: [f64; 3]) -> [f64; 3] {
    let (sr, cr) = roll.sin_cos();
    let (sp, cp) = pitch.sin_cos();
    let (sy, cy) = yaw.sin_cos();
    [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

fn pose(robot: &Robot, link: &str) -> ([f64; 3], [f64; 3]) {
    let joint = robot
        .joints
        .iter()
        .find(|joint| joint.child.link == link)
        .unwrap_or_else(|| panic!("no {link}"));
    assert_eq!(
        (joint.parent.link.as_str(), &joint.joint_type),
        ("link_base", &JointType::Fixed),
        "{link}"
    );
    (joint.origin.xyz.0, joint.origin.rpy.0)
}

fn box_size(robot: &Robot, link: &str) -> [f64; 3] {
    let link = robot
        .links
        .iter()
        .find(|candidate| candidate.name == link)
        .unwrap_or_else(|| panic!("no {link}"));
    assert_eq!((link.visual.len(), link.collision.len()), (1, 1), "{}", link.name);
    let (Geometry::Box { size: seen }, Geometry::Box { size: hit }) =
        (&link.visual[0].geometry, &link.collision[0].geometry)
    else {
        panic!("{} is no box", link.name)
    };
    // What lies in the table may reach deeper into it than it is thick.
    let [x, y, _] = hit.0;
    assert!(distance(seen.0, [x, y, seen.0[2]]) < TOLERANCE, "{}", link.name);
    assert!(hit.0[2] >= seen.0[2] - TOLERANCE, "{}", link.name);
    seen.0
}

#[test]
fn panels_stand_where_the_rig_says_and_face_the_workspace() {
    let robot = cell();
    let workspace = [0.43, 0.0, 0.0];
    for channel in 1..=6_u8 {
        let (centre, angles) = pose(&robot, &format!("panel_l{channel}"));
        let azimuth = (f64::from(channel) * 60.0 - 30.0).to_radians();
        let expected = [workspace[0] + 0.5 * azimuth.cos(), 0.5 * azimuth.sin(), 0.15];
        assert!(
            distance(centre, expected) < TOLERANCE,
            "L{channel} at {centre:?}, expected {expected:?}"
        );
        let reach = f64::hypot(0.5, 0.13);
        let z = z_axis(angles);
        let aim = [
            centre[0] + reach * z[0],
            centre[1] + reach * z[1],
            centre[2] + reach * z[2],
        ];
        assert!(
            distance(aim, [0.43, 0.0, 0.02]) < TOLERANCE,
            "L{channel} aims at {aim:?}"
        );
        assert!(angles[0].abs() < TOLERANCE, "L{channel}: the long side is level");
    }
    let (centre, angles) = pose(&robot, "panel_l7");
    assert!(distance(centre, [0.43, 0.0, 0.9]) < TOLERANCE);
    assert!(distance(z_axis(angles), [0.0, 0.0, -1.0]) < TOLERANCE);
}

#[test]
fn the_solver_starts_from_the_same_panels() {
    let robot = cell();
    for panel in nominal_panels() {
        let (centre, angles) = pose(&robot, &format!("panel_l{}", panel.channel));
        assert!(distance(centre, panel.centre.into()) < TOLERANCE, "L{}", panel.channel);
        assert!(
            distance(z_axis(angles), panel.facing.into_inner().into()) < TOLERANCE,
            "L{}",
            panel.channel
        );
    }
}

#[test]
fn parts_have_their_sizes_and_hang_together() {
    let robot = cell();
    for channel in 1..=7 {
        assert!(distance(box_size(&robot, &format!("panel_l{channel}")), [0.1, 0.25, 0.02]) < TOLERANCE);
    }
    let mat = box_size(&robot, "mat");
    assert!((mat[0] - 0.46).abs() < TOLERANCE && (mat[1] - 0.61).abs() < TOLERANCE);
    assert!(distance(pose(&robot, "mat").0, [0.43, 0.0, 0.0]) < TOLERANCE);
    // Every link but the root is the child of exactly one joint.
    for link in robot.links.iter().filter(|link| link.name != "link_base") {
        assert_eq!(
            robot
                .joints
                .iter()
                .filter(|joint| joint.child.link == link.name)
                .count(),
            1,
            "{}",
            link.name
        );
    }
    assert_eq!((robot.links.len(), robot.joints.len()), (11, 10));
}
