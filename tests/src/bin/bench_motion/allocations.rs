//! Whether the servo loop allocates: while it holds, follows, stops, and is refused, with a counting allocator.

use std::time::{Duration, Instant};

use anyhow::ensure;
use devices::{JointValues, StreamFault};
use serde::Serialize;
use trajectory::Trajectory;
use trajectory_executor::servo::{ServoEvent, StopCause};

use crate::arm::{Arm, HOME};
use crate::lateness::Micros;
use crate::stepped::Stepped;

/// Turns after which an event must have come.
const PATIENCE: usize = 5000;
const ROOM: usize = 50_000;

#[derive(Debug, Serialize)]
pub(crate) struct Allocations {
    /// Over all turns.
    pub(crate) allocs_in_loop: u64,
    pub(crate) alloc_turns: u64,
    /// What a turn of the loop takes, all of its mathematics included.
    pub(crate) turn_us: Micros,
}

/// A loop whose turns are counted.
struct Counted {
    stepped: Stepped,
    allocations: u64,
    /// Of each turn, seconds.
    times: Vec<f64>,
}

pub(crate) fn measure(arm: &Arm) -> anyhow::Result<Allocations> {
    let mut far = HOME;
    (far[0], far[3]) = (1.5, 1.2);
    let planner = arm.planner(0.95)?;
    let mut counted = Counted {
        stepped: Stepped::holding(arm.servo(&HOME)?, HOME, ROOM)?,
        allocations: 0,
        times: Vec::new(),
    };
    counted.turn(100);
    counted.follow_to_the_end(planner.joint_motion(&HOME, &far)?)?;
    counted.stop_on_the_way(&planner.joint_motion(&far, &HOME)?)?;
    counted.be_refused(&far)?;
    counted.lose_the_stream()?;
    Ok(Allocations {
        allocs_in_loop: counted.allocations,
        alloc_turns: counted.times.len() as u64,
        turn_us: Micros::of(&counted.times),
    })
}

impl Counted {
    fn turn(&mut self, turns: usize) {
        for _ in 0..turns {
            self.turn_late(Duration::ZERO);
        }
    }

    fn turn_late(&mut self, late: Duration) {
        let started = Instant::now();
        let counted = allocation_counter::measure(|| self.stepped.turn_late(late));
        self.times.push(started.elapsed().as_secs_f64());
        self.allocations += counted.count_total;
    }

    fn wait(&mut self) -> anyhow::Result<ServoEvent> {
        for _ in 0..PATIENCE {
            self.turn(1);
            if let Some(event) = self.stepped.take_event() {
                return Ok(event);
            }
        }
        anyhow::bail!("nothing has happened in {PATIENCE} periods")
    }

    /// Another trajectory meanwhile is refused.
    fn follow_to_the_end(&mut self, trajectory: Trajectory<7>) -> anyhow::Result<()> {
        self.stepped.follow(trajectory.clone())?;
        self.turn(20);
        self.stepped.follow(trajectory)?;
        let events = [self.wait()?, self.wait()?];
        let expected = [ServoEvent::Refused { id: 1 }, ServoEvent::Finished { id: 1 }];
        ensure!(events == expected, "{events:?} while a trajectory was followed");
        Ok(())
    }

    /// By request, by a late wake-up, and because nobody vouches for the arm.
    fn stop_on_the_way(&mut self, trajectory: &Trajectory<7>) -> anyhow::Result<()> {
        for way in 0..3 {
            let at = self.held()?;
            let planned = if way == 0 {
                trajectory.clone()
            } else {
                back(trajectory, &at)?
            };
            self.stepped.follow(planned)?;
            self.turn(60);
            match way {
                0 => self.stepped.remote().stop(),
                1 => self.turn_late(Duration::from_millis(30)),
                _ => self.stepped.remote().forbid(),
            }
            let event = self.wait()?;
            ensure!(matches!(event, ServoEvent::Stopped { .. }), "{event:?}, not a stop");
            let permitted_until = Instant::now() + Duration::from_hours(1);
            self.stepped.remote().permit_until(permitted_until);
            self.turn(20);
        }
        Ok(())
    }

    /// A trajectory that jumps: the last gate stops it.
    fn be_refused(&mut self, far: &JointValues) -> anyhow::Result<()> {
        self.stepped.follow(Trajectory::hold(far, 1.0)?)?;
        let event = self.wait()?;
        let is_refused = matches!(
            event,
            ServoEvent::Stopped {
                cause: StopCause::Guard(_),
                ..
            }
        );
        ensure!(is_refused, "{event:?}, not a refusal");
        self.turn(20);
        Ok(())
    }

    fn lose_the_stream(&mut self) -> anyhow::Result<()> {
        let at = self.held()?;
        self.stepped.engage(at, Some(30))?;
        let events = [self.wait()?, self.wait()?];
        let lost = ServoEvent::Lost {
            id: None,
            fault: StreamFault::Disconnected,
        };
        ensure!(events == [ServoEvent::Engaged, lost], "{events:?}, not a lost stream");
        self.turn(20);
        Ok(())
    }

    fn held(&self) -> anyhow::Result<JointValues> {
        let states = self.stepped.remote().commanded();
        let states = states.ok_or_else(|| anyhow::anyhow!("nothing is held"))?;
        Ok(states.map(|state| state.position))
    }
}

/// From where a stop ended to the trajectory's end, slowly enough for any limit.
fn back(trajectory: &Trajectory<7>, at: &JointValues) -> anyhow::Result<Trajectory<7>> {
    let points = [(0.0, *at), (8.0, trajectory.end().map(|state| state.position))];
    let points = points.map(|(time_from_start, positions)| trajectory::TimedPoint {
        time_from_start,
        positions,
        velocities: Some([0.0; 7]),
        accelerations: Some([0.0; 7]),
    });
    Ok(Trajectory::through_points(&points)?)
}
