//! Cameras, solver, planner and recorder.

use interfaces::Service;
use interfaces::geometry_msgs::msg::{Point, Pose, Quaternion, Vector3};
use interfaces::rakelight_msgs::msg::{Grasp, GraspArray};
use interfaces::rakelight_msgs::srv::{
    Capture, CaptureRequest, CaptureResponse, PlanGrasp, PlanGraspRequest, PlanGraspResponse, Solve, SolveRequest,
    SolveResponse, StartRecording, StartRecordingRequest, StartRecordingResponse,
};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest, TriggerResponse};
use ros::{Node, ServiceServer};
use tokio::task::JoinSet;

use super::world::{HOME, Reply, World};

pub(super) fn capture(node: &Node, world: &World, tasks: &mut JoinSet<()>) {
    let answer = |request: &CaptureRequest, refused: Option<String>, world: &World| {
        let world = world.look();
        let gone = request.cameras.iter().find(|camera| world.gone.contains(camera));
        let refused = refused.or(gone.map(|camera| format!("{camera}: the camera does not answer")));
        CaptureResponse {
            success: refused.is_none(),
            message: refused.unwrap_or_default(),
            capture_id: format!("capture {} of {}", world.count("capture"), request.cameras.join("+")),
            ..CaptureResponse::default()
        }
    };
    serve::<Capture>(node, "capture", world, tasks, answer);
}

pub(super) fn solve(node: &Node, world: &World, tasks: &mut JoinSet<()>) {
    // The capture's id names its cameras.
    let answer = |request: &SolveRequest, refused: Option<String>, _: &World| SolveResponse {
        success: refused.is_none(),
        message: refused.unwrap_or_default(),
        capture_id: request.capture_id.clone(),
        cameras: ["c1", "c2"]
            .into_iter()
            .filter(|camera| request.capture_id.contains(camera))
            .map(str::to_owned)
            .collect(),
        ..SolveResponse::default()
    };
    serve::<Solve>(node, "solve", world, tasks, answer);
}

pub(super) fn plan(node: &Node, world: &World, tasks: &mut JoinSet<()>) {
    let answer = |request: &PlanGraspRequest, refused: Option<String>, world: &World| {
        let world = world.look();
        let grasps = world.objects.iter().map(|at| grasp(*at, !world.out_of_reach)).collect();
        let success = refused.is_none() && !world.objects.is_empty() && !world.out_of_reach;
        let why_not = match (world.objects.is_empty(), world.out_of_reach) {
            (true, _) => "c1: 0 object pixels, a cup needs 90".to_owned(),
            (false, true) => "the arm reaches none of the grasps".to_owned(),
            (false, false) => world.note.clone(),
        };
        PlanGraspResponse {
            success,
            grasps: GraspArray {
                capture_id: request.capture_id.clone(),
                grasps: if refused.is_some() { Vec::new() } else { grasps },
                ..GraspArray::default()
            },
            message: refused.unwrap_or(why_not),
            ..PlanGraspResponse::default()
        }
    };
    serve::<PlanGrasp>(node, "plan_grasp", world, tasks, answer);
}

pub(super) fn record(node: &Node, world: &World, tasks: &mut JoinSet<()>) {
    let start = |request: &StartRecordingRequest, refused: Option<String>, _: &World| StartRecordingResponse {
        success: refused.is_none(),
        message: refused.unwrap_or_default(),
        path: request.path.clone(),
    };
    serve::<StartRecording>(node, "record/start", world, tasks, start);
    let stop = |_: &TriggerRequest, refused: Option<String>, _: &World| TriggerResponse {
        success: refused.is_none(),
        message: refused.unwrap_or_default(),
    };
    serve::<Trigger>(node, "record/stop", world, tasks, stop);
}

/// Answers one service as the world says.
pub(super) fn serve<S: Service>(
    node: &Node,
    name: &'static str,
    world: &World,
    tasks: &mut JoinSet<()>,
    answer: impl Fn(&S::Request, Option<String>, &World) -> S::Response + Send + 'static,
) {
    let mut server: ServiceServer<S> = node.service_server(name).expect("a service");
    let world = world.clone();
    tasks.spawn(async move {
        while let Some(call) = server.next().await {
            let refused = match world.asked(name) {
                Reply::Hang => continue,
                Reply::Refuse(reason) => Some(reason),
                Reply::Well => None,
            };
            let response = answer(call.request(), refused, &world);
            call.respond(response).await.expect("an answer is sent");
        }
    });
}

/// From above, on an object there.
fn grasp(x: f64, is_reached: bool) -> Grasp {
    let above = |height| Pose {
        position: Point { x, y: 0.0, z: height },
        orientation: Quaternion {
            x: 1.0,
            y: 0.0,
            z: 0.0,
            w: 0.0,
        },
    };
    let joints = if is_reached { HOME.to_vec() } else { Vec::new() };
    Grasp {
        contact: Point { x, y: 0.0, z: 0.03 },
        normal: Vector3 { x: 0.0, y: 0.0, z: 1.0 },
        approach_axis: Vector3 {
            x: 0.0,
            y: 0.0,
            z: -1.0,
        },
        pregrasp: above(0.08),
        grasp: above(0.03),
        retreat: above(0.13),
        pregrasp_joints: joints.clone(),
        grasp_joints: joints,
        cameras: vec!["c1".into(), "c2".into()],
        ..Grasp::default()
    }
}
