//! The arm's node.

use std::time::Duration;

use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion};
use interfaces::rakelight_msgs::action::{MoveTool, MoveToolGoal, MoveToolResult};
use interfaces::rakelight_msgs::msg::ArmState;
use interfaces::sensor_msgs::msg::JointState;
use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, SetBoolResponse, Trigger, TriggerRequest, TriggerResponse};
use ros::parameters::Parameter;
use ros::{ActionServer, ActiveGoal, Node, Qos};
use tokio::task::JoinSet;
use tokio::time::{interval, sleep};

use super::vision;
use super::world::{HOME, Reply, World};

/// Of a motion.
const MOTION: Duration = Duration::from_millis(60);
/// Of what the arm tells, between changes.
const PERIOD: Duration = Duration::from_millis(100);

pub(super) fn serve(node: &Node, world: &World, tasks: &mut JoinSet<()>) {
    node.parameters()
        .declare(Parameter::floats("home", HOME))
        .expect("a parameter");
    tasks.spawn(tell(node.clone(), world.clone()));
    let server = node.action_server("move_tool").expect("an action");
    tasks.spawn(moves(server, world.clone()));
    vision::serve::<SetBool>(node, "vacuum/set", world, tasks, |request, refused, world| {
        vacuum(*request, refused, world)
    });
    vision::serve::<Trigger>(node, "home", world, tasks, |_, refused, world| {
        world.change(|world| match (&refused, world.mode) {
            (Some(reason), _) => no(reason),
            (None, ArmState::READY) => {
                world.joints = HOME;
                yes("the arm is at home")
            }
            (None, _) => no("the arm is not ready"),
        })
    });
    vision::serve::<Trigger>(node, "stop", world, tasks, |_: &TriggerRequest, _, world| {
        world.change(|world| {
            world.mode = ArmState::STOPPED;
            world.fault = "by the service `stop`".into();
        });
        yes("the arm is at rest")
    });
    vision::serve::<Trigger>(node, "recover", world, tasks, |_, _, world| {
        world.change(|world| {
            world.mode = ArmState::READY;
            world.fault.clear();
        });
        yes("the arm is ready")
    });
}

fn yes(message: &str) -> TriggerResponse {
    TriggerResponse {
        success: true,
        message: message.into(),
    }
}

fn no(message: &str) -> TriggerResponse {
    TriggerResponse {
        success: false,
        message: message.into(),
    }
}

fn vacuum(request: SetBoolRequest, refused: Option<String>, world: &World) -> SetBoolResponse {
    if refused.is_none() {
        world.change(|world| {
            world.pump = request.data;
            if !request.data {
                let over_bin = world.motions.last().is_some_and(|goal| leg(goal) == "bin");
                world.let_go(over_bin);
            }
        });
    }
    SetBoolResponse {
        success: refused.is_none(),
        message: refused.unwrap_or_default(),
    }
}

/// `arm/state` and `joint_states`, on every change and in between.
async fn tell(node: Node, world: World) {
    let states = node.publisher::<ArmState>("arm/state", Qos::STREAM).expect("a topic");
    let joints = node
        .publisher::<JointState>("joint_states", Qos::STREAM)
        .expect("a topic");
    let (mut ticks, mut changes) = (interval(PERIOD), world.changes());
    loop {
        let (state, position) = {
            let world = world.look();
            (state(world.mode, world.vacuum(), &world.fault), world.joints.to_vec())
        };
        states.publish(state).expect("a state is told");
        joints
            .publish(JointState {
                position,
                ..JointState::default()
            })
            .expect("angles are told");
        tokio::select! {
            _ = ticks.tick() => {}
            _ = changes.changed() => {}
        }
    }
}

fn state(mode: u8, vacuum: u8, fault: &str) -> ArmState {
    ArmState {
        mode,
        vacuum,
        fault: fault.into(),
        tcp: Pose {
            position: Point {
                x: 0.35,
                y: 0.0,
                z: 0.35,
            },
            orientation: Quaternion {
                x: 1.0,
                y: 0.0,
                z: 0.0,
                w: 0.0,
            },
        },
        ..ArmState::default()
    }
}

async fn moves(mut server: ActionServer<MoveTool>, world: World) {
    let mut goals = JoinSet::new();
    while let Some(offer) = server.next().await {
        let world = world.clone();
        goals.spawn(async move {
            sleep(world.look().acceptance).await;
            let goal = offer.accept().await.expect("a goal is taken");
            run(goal, world).await;
        });
    }
}

fn leg(goal: &MoveToolGoal) -> &'static str {
    match (goal.straight, goal.until_held, goal.carried_radius > 0.0) {
        (true, true, _) => "approach",
        (true, false, true) => "lift",
        (true, false, false) => "back",
        (false, _, true) => "bin",
        (false, _, false) => "pregrasp",
    }
}

async fn run(goal: ActiveGoal<MoveTool>, world: World) {
    let leg = leg(goal.goal());
    if goal.goal().dry_run {
        let result = match world.asked(&format!("dry {leg}")) {
            Reply::Refuse(reason) => refused(&reason),
            Reply::Hang => {
                goal.cancel_requested().await;
                refused("cancelled")
            }
            Reply::Well => arrived(false),
        };
        return end(goal, result);
    }
    let reply = world.asked(leg);
    if let Reply::Refuse(reason) = &reply {
        return end(goal, refused(reason));
    }
    let begun = world.change(|world| {
        let is_ready = world.mode == ArmState::READY;
        if is_ready {
            world.mode = ArmState::MOVING;
            world.moving += 1;
            world.motions.push(goal.goal().clone());
            world.joints = [0.5; 7];
        }
        is_ready
    });
    if !begun {
        return end(goal, refused("the arm is not ready"));
    }
    let drops = leg == "bin" && world.look().drops;
    if drops {
        // It falls while the arm is on its way.
        world.change(|world| {
            world.drops = false;
            world.let_go(false);
        });
    }
    let ending = in_motion(&goal, &world, drops || reply == Reply::Hang).await;
    let result = world.change(|world| {
        world.moving -= 1;
        if world.mode == ArmState::MOVING {
            world.mode = ArmState::READY;
        }
        match ending {
            Some(reason) => refused(reason),
            None => arrived(leg == "approach" && seals(world, goal.goal())),
        }
    });
    end(goal, result);
}

/// Why it did not come to its end.
async fn in_motion(goal: &ActiveGoal<MoveTool>, world: &World, hangs: bool) -> Option<&'static str> {
    let mut changes = world.changes();
    let stopped = changes.wait_for(|_| world.look().mode != ArmState::MOVING);
    tokio::select! {
        () = sleep(MOTION), if !hangs => None,
        () = goal.cancel_requested() => Some("cancelled"),
        _ = stopped => Some("the motion did not go to its end: it was stopped"),
    }
}

/// Whether the cup holds the object there from now on.
fn seals(world: &mut super::world::Inner, goal: &MoveToolGoal) -> bool {
    if world.leaks > 0 {
        world.leaks -= 1;
        return false;
    }
    let at = goal.poses[0].position.x;
    let found = world.objects.iter().position(|object| (object - at).abs() < 0.005);
    world.held = found.filter(|_| world.pump).map(|index| world.objects.remove(index));
    world.held.is_some()
}

fn refused(reason: &str) -> MoveToolResult {
    MoveToolResult {
        reason: reason.into(),
        ..MoveToolResult::default()
    }
}

fn arrived(held: bool) -> MoveToolResult {
    MoveToolResult {
        success: true,
        held,
        joints: vec![0.5; 7],
        ..MoveToolResult::default()
    }
}

fn end(goal: ActiveGoal<MoveTool>, result: MoveToolResult) {
    let told = match (result.success, goal.is_cancel_requested()) {
        (true, _) => goal.succeed(result),
        (false, true) => goal.canceled(result),
        (false, false) => goal.abort(result),
    };
    told.expect("a result is told");
}
