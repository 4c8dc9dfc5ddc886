//! The motions of a pick: down until the cup holds, up with the object, into the bin.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::{Arc, Mutex};

use geometry::{Ray, RigidTransform, TriangleBvh};
use interfaces::rakelight_msgs::action::MoveToolGoal;
use interfaces::rakelight_msgs::msg::ArmState;
use nalgebra::{Point3, Vector3};
use ros::GoalStatus;
use sim::arm::{ArmConfig, SuctionWorld};
use sim::world::World;

use crate::scene::{HOME, Scene, down};

const OCTAGON: &str = "objects: [{shape: {kind: octagon2, width: 0.09, height: 0.029}, pose: {x: 0.43}}]";
/// Height of its top, metres.
const TOP: f64 = 0.029;
/// Of the cup's rim, and how far it gives, metres.
const RIM: [f64; 2] = [0.01, 0.003];
/// From inside the cup, metres.
const INSIDE: f64 = 0.01;
/// The tool goes on no farther than this after the seal, metres: 3 mm are what the rim gives.
const GOES_ON: f64 = 0.0025;

/// The octagon, and where the cup was last looked at: a cup that holds is looked at no more.
#[derive(Debug)]
struct OnTable {
    octagon: TriangleBvh,
    cup: Mutex<Option<RigidTransform>>,
}

impl OnTable {
    fn new() -> Arc<Self> {
        let world = World::from_yaml(OCTAGON, Path::new("")).unwrap();
        Arc::new(Self {
            octagon: TriangleBvh::new(&world.scene.bodies[0].mesh).unwrap(),
            cup: Mutex::new(None),
        })
    }

    fn config(self: &Arc<Self>) -> ArmConfig {
        ArmConfig {
            suction: Some(Arc::clone(self) as Arc<dyn SuctionWorld>),
            ..ArmConfig::default()
        }
    }

    fn height_at_seal(&self) -> f64 {
        self.cup.lock().unwrap().expect("the cup was looked at").translation().z
    }
}

impl SuctionWorld for OnTable {
    fn touched(&self, base_from_cup: &RigidTransform) -> Option<f64> {
        *self.cup.lock().unwrap() = Some(*base_from_cup);
        let is_on = (0..8).all(|place| {
            let angle = TAU * f64::from(place) / 8.0;
            let start = Point3::new(RIM[0] * angle.cos(), RIM[0] * angle.sin(), -INSIDE);
            let ray = Ray {
                origin: base_from_cup.transform_point(&start),
                direction: base_from_cup.transform_direction(&Vector3::z()),
            };
            let hit = self.octagon.closest_hit(&ray, INSIDE + RIM[1]);
            hit.is_some_and(|hit| hit.distance >= INSIDE - RIM[1])
        });
        is_on.then_some(0.1)
    }
}

fn straight(z: f64) -> MoveToolGoal {
    MoveToolGoal {
        poses: vec![down(0.43, 0.0, z)],
        straight: true,
        ..MoveToolGoal::default()
    }
}

/// Straight down from 50 mm above, as deep as the cup may press.
fn approach() -> MoveToolGoal {
    MoveToolGoal {
        contact: true,
        until_held: true,
        speed: 0.05,
        ..straight(TOP - 0.002)
    }
}

async fn done(scene: &Scene, goal: MoveToolGoal) -> Arc<interfaces::rakelight_msgs::action::MoveToolResult> {
    let (status, result) = scene.move_tool(goal).await;
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Succeeded, ""));
    result
}

async fn refused(scene: &Scene, goal: MoveToolGoal) -> String {
    let (status, result) = scene.move_tool(goal).await;
    assert_eq!(status, GoalStatus::Aborted);
    assert!(!result.success && !result.held);
    result.reason.clone()
}

fn lip_height(scene: &Scene) -> f64 {
    let base_from_flange = scene.controller.moment().base_from_flange;
    base_from_flange.transform_point(&Point3::new(0.0, 0.0, 0.126)).z
}

#[tokio::test(flavor = "multi_thread")]
async fn the_way_down_ends_when_the_cup_holds_and_the_object_is_lifted() {
    let table = OnTable::new();
    let mut scene = Scene::ready(table.config()).await;
    let over = MoveToolGoal {
        straight: false,
        ..straight(TOP + 0.048)
    };
    done(&scene, over).await;
    assert!(scene.vacuum(true).await.success);

    let result = done(&scene, approach()).await;
    assert!(result.held, "the octagon is in the way");
    assert!(scene.controller.moment().held.is_some());
    scene.assert_at(&result.joints, "where it ended");
    let (sealed, rests) = (table.height_at_seal(), lip_height(&scene));
    println!(
        "sealed {:.2} mm above the end of the way, went on for {:.2} mm",
        1e3 * (sealed - TOP + 0.002),
        1e3 * (sealed - rests)
    );
    assert!(rests > TOP - 0.002 + 1e-4, "it did not go to the end: {rests}");
    assert!(sealed - rests < GOES_ON, "{sealed} {rests}");
    scene
        .state("the hold at rest", |state| {
            state.vacuum == ArmState::VACUUM_HELD && state.mode == ArmState::READY
        })
        .await;

    let lift = MoveToolGoal {
        contact: true,
        carried_radius: 0.05,
        carried_length: TOP,
        ..straight(TOP + 0.1)
    };
    let reason = refused(
        &scene,
        MoveToolGoal {
            contact: false,
            ..lift.clone()
        },
    )
    .await;
    assert!(reason.contains("carried object with"), "{reason}");
    done(&scene, lift).await;
    assert!(scene.controller.moment().held.is_some(), "it is carried");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cup_that_cannot_hold_anything_is_no_success_of_holding() {
    let scene = Scene::ready(ArmConfig::default()).await;
    done(
        &scene,
        MoveToolGoal {
            straight: false,
            ..straight(TOP + 0.048)
        },
    )
    .await;
    let before = scene.angles();
    let reason = refused(&scene, approach()).await;
    assert!(reason.contains("the pump is off"), "{reason}");
    let sideways = MoveToolGoal {
        straight: false,
        ..approach()
    };
    let reason = refused(&scene, sideways).await;
    assert!(reason.contains("contact is allowed on straight lines only"), "{reason}");
    scene.assert_at(&before, "what is refused moves nothing");

    assert!(scene.vacuum(true).await.success);
    let result = done(&scene, approach()).await;
    assert!(!result.held, "there is nothing");
    assert!(
        (lip_height(&scene) - TOP + 0.002).abs() < 1e-3,
        "{}",
        lip_height(&scene)
    );
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn dry_runs_from_end_to_end_see_the_carried_object_hit_the_bin() {
    let scene = Scene::ready(ArmConfig::default()).await;
    let beside = MoveToolGoal {
        poses: vec![down(0.33, 0.28, 0.09)],
        dry_run: true,
        ..MoveToolGoal::default()
    };
    let there = done(&scene, beside).await;
    let into = |carried_length: f64| MoveToolGoal {
        poses: vec![down(0.18, 0.36, 0.09)],
        straight: true,
        dry_run: true,
        carried_radius: 0.04,
        carried_length,
        start_joints: there.joints.clone(),
        ..MoveToolGoal::default()
    };
    let reason = refused(&scene, into(0.05)).await;
    assert!(reason.contains("carried object with bin"), "{reason}");
    done(&scene, into(0.015)).await;
    // The joints find a way over the wall.
    let over = MoveToolGoal {
        straight: false,
        ..into(0.05)
    };
    done(&scene, over).await;
    let reason = refused(
        &scene,
        MoveToolGoal {
            dry_run: false,
            ..into(0.015)
        },
    )
    .await;
    assert!(reason.contains("start_joints is given"), "{reason}");
    scene.assert_at(&HOME, "dry runs move nothing");
    scene.end().await;
}
