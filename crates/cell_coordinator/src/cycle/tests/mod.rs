//! Every transition, told event by event.

mod endings;
mod execution;
mod looking;

use std::time::Duration;

use geometry::RigidTransform;
use geometry::nalgebra::{Point3, UnitQuaternion, Vector3};
use interfaces::rakelight_msgs::msg::Grasp;

use super::*;

pub(super) const CARRIED: Carried = Carried {
    radius: 0.05,
    length: 0.05,
};

pub(super) fn dry_order() -> Order {
    Order {
        dry_run: true,
        ..order()
    }
}

pub(super) fn policy() -> Policy {
    let seconds = Duration::from_secs;
    Policy {
        attempts: 3,
        verify: true,
        overtravel: 0.003,
        approach_speed: 0.05,
        carried: CARRIED,
        bin: Bin {
            position: Point3::new(0.18, 0.36, 0.0),
            rim: 0.06,
            clearance: 0.02,
        },
        lift: 0.1,
        longest_leg: seconds(20),
        limits: Limits {
            capture: seconds(20),
            solve: seconds(30),
            plan: seconds(10),
            execute: seconds(90),
            release: seconds(2),
            interrupt: seconds(3),
        },
    }
}

pub(super) fn order() -> Order {
    Order {
        modes: vec![Mode::Solid],
        target: String::new(),
        direction: Vector3::zeros(),
        dry_run: false,
        cameras: vec!["c1".into(), "c2".into()],
        at_home: true,
        held: None,
    }
}

pub(super) fn tool() -> RigidTransform {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    RigidTransform::from_parts(Vector3::new(0.35, 0.0, 0.35), down)
}

pub(super) fn report(cup: Cup) -> ArmReport {
    ArmReport {
        cup,
        tcp: Some(tool()),
        unfit: None,
    }
}

/// Within reach, contact there on the x axis (metres).
pub(super) fn grasp(x: f64) -> Grasp {
    let mut grasp = Grasp {
        pregrasp_joints: vec![0.1; 7],
        grasp_joints: vec![0.2; 7],
        ..Grasp::default()
    };
    grasp.contact.x = x;
    for pose in [&mut grasp.pregrasp, &mut grasp.grasp, &mut grasp.retreat] {
        pose.position.x = x;
        pose.orientation.x = 1.0;
        pose.orientation.w = 0.0;
    }
    grasp.pregrasp.position.z = 0.05;
    grasp.retreat.position.z = 0.1;
    grasp.approach_axis.z = -1.0;
    grasp
}

pub(super) fn planned(grasps: Vec<Grasp>, message: &str) -> Event {
    Event::Planned(Planned {
        grasps,
        looked: true,
        message: message.into(),
    })
}

pub(super) fn refused(reason: &str) -> Event {
    Event::Failed(Fault::Refused(reason.into()))
}

pub(super) fn lost(reason: &str) -> Event {
    Event::Failed(Fault::Lost(reason.into()))
}

pub(super) fn moved() -> Event {
    Event::Moved {
        held: false,
        joints: vec![0.5; 7],
        duration: Duration::from_secs(1),
    }
}

pub(super) fn held() -> Event {
    Event::Moved {
        held: true,
        joints: vec![0.5; 7],
        duration: Duration::from_secs(1),
    }
}

/// A cycle and what it wants done.
pub(super) struct Story {
    pub(super) cycle: Cycle,
    pub(super) wants: Option<Command>,
    pub(super) now: Duration,
}

impl Story {
    pub(super) fn begin(order: Order, policy: Policy, cup: Cup) -> Self {
        let (cycle, wants) = Cycle::begin(order, policy, &report(cup));
        Self {
            cycle,
            wants,
            now: Duration::ZERO,
        }
    }

    /// With an object on the table at 0.4 m, everything planned and the arm about to start.
    pub(super) fn executing() -> Self {
        let mut story = Self::begin(order(), policy(), Cup::Off);
        story.see(vec![grasp(0.4), grasp(0.43)]);
        story.dry_run();
        assert_eq!(story.wants, Some(Command::Vacuum { on: true }));
        story
    }

    /// The object hangs on the cup, and the arm lifts it.
    pub(super) fn lifting() -> Self {
        let mut story = Self::executing();
        for event in [Event::Done, moved(), held()] {
            story.tell(event);
        }
        story.hear(Cup::Held);
        assert!(story.moves().carried.is_some());
        story
    }

    /// One second later.
    pub(super) fn tell(&mut self, event: Event) -> &mut Self {
        self.now += Duration::from_secs(1);
        self.wants = self.cycle.on(event, self.now);
        self
    }

    /// The arm says so; what is under way goes on.
    pub(super) fn hear(&mut self, cup: Cup) {
        let next = self.cycle.on(Event::Arm(report(cup)), self.now);
        assert_eq!(next, None);
    }

    /// A capture of which these cameras are solved, and what the solver says of it.
    pub(super) fn solve(&mut self, cameras: &[&str], message: &str) {
        self.tell(Event::Captured { capture_id: "a".into() });
        assert_eq!(self.wants, Some(Command::Solve { capture_id: "a".into() }));
        self.tell(Event::Solved {
            cameras: cameras.iter().map(|camera| (*camera).to_owned()).collect(),
            message: message.to_owned(),
        });
    }

    /// A capture that is solved and planned to these grasps.
    pub(super) fn see(&mut self, grasps: Vec<Grasp>) {
        assert!(matches!(self.wants, Some(Command::Capture { .. })), "{:?}", self.wants);
        self.solve(&["c1", "c2"], "");
        assert!(matches!(self.wants, Some(Command::Plan { .. })));
        let message = if grasps.is_empty() { "the table is empty" } else { "" };
        self.tell(planned(grasps, message));
    }

    /// Nothing is in the way.
    pub(super) fn dry_run(&mut self) {
        for _ in 0..4 {
            assert!(self.moves().dry.is_some());
            self.tell(moved());
        }
    }

    pub(super) fn moves(&self) -> &Move {
        match &self.wants {
            Some(Command::Move(way)) => way,
            other => panic!("no motion: {other:?}"),
        }
    }

    pub(super) fn outcome(&self) -> &Outcome {
        self.cycle.outcome().expect("it has ended")
    }

    /// That it failed there and so.
    pub(super) fn assert_failed(&self, stage: Stage, texts: &[&str]) {
        let outcome = self.outcome();
        assert_eq!(
            (outcome.kind, outcome.failed_stage),
            (Kind::Failed, Some(stage)),
            "{outcome:?}"
        );
        for text in texts {
            assert!(outcome.reason.contains(text), "{text:?}: {}", outcome.reason);
        }
    }
}
