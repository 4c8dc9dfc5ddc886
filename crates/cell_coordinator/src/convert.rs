//! Between messages and what the cycle takes.

use std::time::Duration;

use geometry::RigidTransform;
use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::rakelight_msgs::action::MoveToolGoal;
use interfaces::rakelight_msgs::msg::{ArmState, CellState, Grasp, StageTiming};

use crate::cycle::{ArmReport, Cup, Mode, Move, Stage, Timing};

pub(crate) fn report(state: &ArmState) -> ArmReport {
    let (at, q) = (&state.tcp.position, &state.tcp.orientation);
    ArmReport {
        cup: match state.vacuum {
            ArmState::VACUUM_OFF => Cup::Off,
            ArmState::VACUUM_HELD => Cup::Held,
            _ => Cup::On,
        },
        // Before anything was measured it is all zeros, which is no pose.
        tcp: RigidTransform::from_quaternion_xyzw([at.x, at.y, at.z], [q.x, q.y, q.z, q.w]).ok(),
        unfit: unfit(state),
    }
}

/// Why the arm cannot move until somebody does something about it.
pub(crate) fn unfit(state: &ArmState) -> Option<String> {
    let because = match state.fault.as_str() {
        "" => String::new(),
        fault => format!(": {fault}"),
    };
    match state.mode {
        ArmState::READY | ArmState::MOVING | ArmState::STOPPING => None,
        ArmState::DISCONNECTED => Some(format!("the arm's controller does not answer{because}")),
        ArmState::DISABLED => Some(format!("the arm is not armed{because}; the service `recover` arms it")),
        ArmState::STOPPED => Some(format!(
            "the arm is stopped{because}; the service `recover` makes it ready"
        )),
        ArmState::FAULT => Some(format!("the arm has a fault{because}; the service `recover` clears it")),
        mode => Some(format!("the arm is in mode {mode}, which is unknown")),
    }
}

/// What the cell is while no cycle runs.
pub(crate) fn idle_stage(state: &ArmState) -> u8 {
    match state.mode {
        ArmState::DISCONNECTED | ArmState::FAULT => CellState::FAULT,
        ArmState::DISABLED | ArmState::STOPPED => CellState::STOPPED,
        _ => CellState::IDLE,
    }
}

pub(crate) fn stage(stage: Stage) -> u8 {
    match stage {
        Stage::Capture => CellState::CAPTURE,
        Stage::Solve => CellState::SOLVE,
        Stage::Plan => CellState::PLAN,
        Stage::Execute => CellState::EXECUTE,
    }
}

pub(crate) fn mode(mode: Mode) -> u8 {
    match mode {
        Mode::Solid => Grasp::SOLID,
        Mode::Thin => Grasp::THIN,
    }
}

/// `begin` is the cycle's, nanoseconds of the node's clock; `now` the time since.
pub(crate) fn timings(timings: &[Timing], begin: i64, now: Duration) -> Vec<StageTiming> {
    let convert = |timing: &Timing| StageTiming {
        stage: stage(timing.stage),
        succeeded: timing.succeeded,
        started_at: Time::from_nanos(begin.saturating_add(timing.began.as_nanos() as i64)).unwrap_or_default(),
        duration: duration(timing.ended.unwrap_or(now).saturating_sub(timing.began)),
    };
    timings.iter().map(convert).collect()
}

/// Longer ones than a message holds (68 years) are zero.
fn duration(duration: Duration) -> DurationMessage {
    DurationMessage::try_from(duration).unwrap_or_default()
}

pub(crate) fn goal(way: Move) -> MoveToolGoal {
    let dry_run = way.dry.is_some();
    MoveToolGoal {
        poses: vec![way.to],
        straight: way.straight,
        blend: 0.0,
        speed: way.speed,
        contact: way.contact,
        until_held: way.until_held,
        carried_radius: way.carried.map_or(0.0, |carried| carried.radius),
        carried_length: way.carried.map_or(0.0, |carried| carried.length),
        dry_run,
        start_joints: way.dry.unwrap_or_default().start_joints,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cycle::DryRun;

    #[test]
    fn an_arm_that_cannot_move_says_why_and_what_helps() {
        let mut state = ArmState {
            mode: ArmState::STOPPED,
            fault: "by the service `stop`".into(),
            ..ArmState::default()
        };
        let expected = "the arm is stopped: by the service `stop`; the service `recover` makes it ready";
        assert_eq!(unfit(&state).as_deref(), Some(expected));
        assert_eq!(idle_stage(&state), CellState::STOPPED);
        state.mode = ArmState::MOVING;
        assert_eq!((unfit(&state), idle_stage(&state)), (None, CellState::IDLE));
        state.mode = 77;
        assert!(unfit(&state).expect("unknown").contains("mode 77"));
    }

    #[test]
    fn a_pose_that_was_never_measured_is_none() {
        let mut state = ArmState::default();
        state.tcp.orientation.w = 0.0;
        assert_eq!(report(&state).tcp, None);
        state.tcp.orientation.x = 1.0;
        state.vacuum = ArmState::VACUUM_HELD;
        assert!(report(&state).tcp.is_some() && report(&state).cup == Cup::Held);
    }

    #[test]
    fn a_dry_run_begins_where_it_is_told() {
        let way = Move {
            dry: Some(DryRun {
                start_joints: vec![0.1; 7],
            }),
            ..Move::default()
        };
        let goal = goal(way);
        assert!(goal.dry_run && goal.start_joints == [0.1; 7]);
        assert!(!super::goal(Move::default()).dry_run);
    }

    #[test]
    fn a_stage_that_runs_has_lasted_until_now() {
        let seconds = Duration::from_secs;
        let timing = Timing {
            stage: Stage::Plan,
            began: seconds(2),
            ended: None,
            succeeded: false,
        };
        let told = timings(&[timing], 1_500_000_000, seconds(5));
        assert_eq!((told[0].stage, told[0].duration.sec), (CellState::PLAN, 3));
        assert_eq!(told[0].started_at, Time::from_nanos(3_500_000_000).expect("a time"));
    }
}
