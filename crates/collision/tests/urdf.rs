//! What is read from URDFs, and what is refused.

mod common;

use collision::{ArmModel, CollisionError, Scene, SelfCollision};
use common::{arm, cell};
use kinematics::Chain;

/// An arm of one joint whose second link has the given collision elements.
fn robot(collisions: &str) -> urdf_rs::Robot {
    let text = format!(
        r#"<robot name="r">
            <link name="base"/>
            <link name="arm">{collisions}</link>
            <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
              <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
        </robot>"#
    );
    urdf_rs::read_from_string(&text).expect("a URDF")
}

fn model(robot: &urdf_rs::Robot) -> Result<ArmModel<1>, CollisionError> {
    let chain = Chain::from_urdf(robot, "base", "arm")?;
    ArmModel::from_urdf(robot, "base", chain, &SelfCollision::default())
}

fn collision(xyz: &str, geometry: &str) -> String {
    format!(r#"<collision><origin xyz="{xyz}"/><geometry>{geometry}</geometry></collision>"#)
}

#[test]
fn cylinder_with_two_spheres_is_one_capsule() {
    let cylinder = collision("0 0 0.1", r#"<cylinder radius="0.05" length="0.2"/>"#);
    let sphere = |z: &str, radius: &str| collision(&format!("0 0 {z}"), &format!(r#"<sphere radius="{radius}"/>"#));
    let triple = format!("{}{cylinder}{}", sphere("0", "0.05"), sphere("0.2", "0.05"));
    let count = |collisions: &str| model(&robot(collisions)).unwrap().shapes("arm").map(<[_]>::len);
    assert_eq!(count(&triple), Some(1));
    assert_eq!(count(&format!("{triple}{triple}")), Some(2));
    assert_eq!(count(&format!("{triple}{}", sphere("0.2", "0.05"))), Some(2));
    assert_eq!(
        count(&format!("{}{cylinder}{}", sphere("0", "0.05"), sphere("0.2", "0.06"))),
        Some(3)
    );
    assert_eq!(count(&cylinder), Some(1));
    assert_eq!(count(&collision("0 0 0", r#"<box size="1 1 1"/>"#)), Some(1));
}

#[test]
fn malformed_shapes_are_refused_with_their_place() {
    let sphere = collision("0 0 0", r#"<sphere radius="0.1"/>"#);
    let cases = [
        (r#"<mesh filename="arm.stl"/>"#, "shape 2 is a mesh (arm.stl)"),
        (r#"<sphere radius="-0.1"/>"#, "shape 2: radius = -0.1"),
        (r#"<sphere radius="nan"/>"#, "shape 2: radius = NaN"),
        (r#"<cylinder radius="0.1" length="0"/>"#, "shape 2: length = 0"),
        (r#"<box size="1 0 1"/>"#, "shape 2: size = 0"),
    ];
    for (geometry, message) in cases {
        let error = model(&robot(&format!("{sphere}{}", collision("0 0 0", geometry)))).unwrap_err();
        let text = error.to_string();
        assert!(text.contains("link `arm`") && text.contains(message), "{text}");
    }
    let error = model(&robot(&collision("0 inf 0", r#"<sphere radius="0.1"/>"#))).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("link `arm`, collision shape 1: origin = inf"),
        "{error}"
    );
}

#[test]
fn base_and_joints_must_be_there() {
    let robot = robot("");
    let chain: Chain<1> = Chain::from_urdf(&robot, "base", "arm").unwrap();
    let error = ArmModel::from_urdf(&robot, "root", chain, &SelfCollision::default()).unwrap_err();
    assert_eq!(error.to_string(), "there is no link `root`");
    assert!(Scene::from_urdf(&robot, "root").is_err());

    let finger = r#"<robot name="r">
        <link name="base"/><link name="arm"/>
        <link name="finger"><collision><geometry><sphere radius="0.01"/></geometry></collision></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
          <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
        <joint name="grip" type="prismatic"><parent link="arm"/><child link="finger"/><axis xyz="0 0 1"/>
          <limit lower="0" upper="1" velocity="1" effort="1"/></joint>
    </robot>"#;
    let error = model(&urdf_rs::read_from_string(finger).unwrap()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "link `finger` hangs on joint `grip`, which moves but is no joint of the chain"
    );
}

#[test]
fn a_loop_of_joints_is_refused() {
    let text = r#"<robot name="r">
        <link name="base"/><link name="a"><collision><geometry><sphere radius="0.01"/></geometry></collision></link><link name="b"/>
        <joint name="j1" type="fixed"><parent link="a"/><child link="b"/></joint>
        <joint name="j2" type="fixed"><parent link="b"/><child link="a"/></joint>
    </robot>"#;
    let error = Scene::from_urdf(&urdf_rs::read_from_string(text).unwrap(), "base").unwrap_err();
    assert_eq!(error, CollisionError::Loop { link: "a".to_owned() });
}

#[test]
fn cell_has_table_mat_seven_panels_and_a_bin() {
    let scene = cell();
    let names: Vec<&str> = scene.names().collect();
    assert_eq!(names.len(), 10);
    assert_eq!(names[..3], ["table", "mat", "panel_l1"]);
    assert_eq!(names.last(), Some(&"bin"));
}

#[test]
fn pairs_leave_out_neighbours_rigid_bodies_and_what_the_maker_says() {
    let arm = arm();
    let has = |a: &str, b: &str| arm.pairs().any(|pair| pair == [a, b] || pair == [b, a]);
    for [a, b] in [
        ["link_base", "link1"],
        ["link4", "link5"],
        ["link6", "link7"],
        ["link7", "vacuum_gripper"],
        ["wrist_camera", "vacuum_gripper"],
        ["vacuum_gripper", "vacuum_cup"],
        ["link6", "vacuum_cup"],
        ["link3", "link5"],
    ] {
        assert!(!has(a, b), "{a} {b}");
    }
    // Their capsules overlap by some millimetres when all angles are 0, where the arm is free.
    assert!(!has("link2", "link4"));
    for [a, b] in [
        ["link_base", "link5"],
        ["link1", "vacuum_gripper"],
        ["link1", "vacuum_cup"],
        ["link2", "link6"],
        ["link6", "wrist_camera"],
        ["link4", "wrist_camera"],
    ] {
        assert!(has(a, b), "{a} {b}");
    }
}
