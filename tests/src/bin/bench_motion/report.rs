//! The figures, for programs and for people.

use std::fmt;

use serde::Serialize;

use crate::allocations::Allocations;
use crate::cell::Checks;
use crate::inverse::Inverse;
use crate::lateness::Micros;
use crate::realtime_stops::LiveStops;
use crate::servo::ServoFigures;
use crate::stops::Outcomes;
use crate::trajectories::Trajectories;
use crate::yardstick::Yardstick;

/// All keys lie at the top of one JSON object.
#[derive(Debug, Serialize)]
pub(crate) struct Report {
    #[serde(flatten)]
    pub(crate) inverse: Inverse,
    #[serde(flatten)]
    pub(crate) trajectories: Trajectories,
    #[serde(flatten)]
    pub(crate) collision: Checks,
    #[serde(flatten)]
    pub(crate) allocations: Allocations,
    #[serde(flatten)]
    pub(crate) stops: Outcomes,
    #[serde(flatten)]
    pub(crate) servo: ServoFigures,
    #[serde(flatten)]
    pub(crate) realtime_stops: LiveStops,
    #[serde(flatten)]
    pub(crate) yardstick: Yardstick,
}

impl fmt::Display for Report {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.inverse.tell(out)?;
        self.trajectories.tell(out)?;
        self.collision.tell(out)?;
        self.stops.tell(out)?;
        self.realtime_stops.tell(out)?;
        self.servo.tell(out)?;
        line(
            out,
            "  yardstick wakes up late by",
            &self.yardstick.yardstick_late_us.for_people(),
        )?;
        line(out, "  which is", self.yardstick.yardstick)?;
        let Allocations {
            allocs_in_loop,
            alloc_turns,
            turn_us,
        } = self.allocations;
        line(out, "  a turn by hand takes", &turn_us.for_people())?;
        line(
            out,
            "  allocations",
            &format!("{allocs_in_loop} in {alloc_turns} turns"),
        )
    }
}

fn heading(out: &mut fmt::Formatter<'_>, what: &str) -> fmt::Result {
    writeln!(out, "{what}")
}

fn line(out: &mut fmt::Formatter<'_>, what: &str, value: &str) -> fmt::Result {
    writeln!(out, "{what:<34} {value}")
}

impl Micros {
    fn for_people(self) -> String {
        format!("median {:.0}, p99 {:.0}, most {:.0} us", self.p50, self.p99, self.max)
    }
}

impl Inverse {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        heading(out, &format!("Kinematics, {} random poses, seed: home", self.ik_poses))?;
        let (success, home) = (100.0 * self.ik_success, 100.0 * self.ik_from_home);
        line(
            out,
            "  inverse solved",
            &format!("{success:.2} %, {home:.1} % from the seed itself"),
        )?;
        let (median, p99, most) = (self.ik_median_us, self.ik_p99_us, self.ik_max_us);
        line(
            out,
            "  inverse takes",
            &format!("median {median:.0}, p99 {p99:.0}, most {most:.0} us"),
        )?;
        line(out, "  tool pose and Jacobian", &format!("{:.2} us", self.fk_us))?;
        let pinocchio = self.pinocchio.as_ref().map_or_else(
            || "not there".to_owned(),
            |peer| {
                let (version, us, calls) = (&peer.version, peer.fk_us, peer.calls_us);
                format!(
                    "{us:.2} us from Python ({version}); two empty calls {calls:.2} us; tools {:.1e} m apart",
                    peer.apart_m
                )
            },
        );
        line(out, "  the same by pinocchio", &pinocchio)
    }
}

impl Trajectories {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (checked, blends, lines) = (self.traj_checked, self.traj_blends, self.traj_lines);
        heading(
            out,
            &format!("Trajectories, {checked} random ones ({blends} blends, {lines} lines)"),
        )?;
        line(out, "  that break a limit", &self.traj_violations.to_string())?;
        line(out, "  sampled from outside as well", &self.traj_sampled.to_string())?;
        line(out, "  lines out of reach", &self.lines_refused.to_string())?;
        line(
            out,
            "  fastest tool, share of its limit",
            &format!("{:.9}", self.tool_speed_share),
        )?;
        let (motion, blend, of_line) = (self.plan_us, self.plan_blend_us, self.plan_line_us);
        let planning = format!("motion {motion:.0}, blend {blend:.0}, line {of_line:.0} us (medians)");
        line(out, "  planning takes", &planning)?;
        line(
            out,
            "  all took",
            &format!("{:.0} s on {} threads", self.traj_seconds, self.threads),
        )
    }
}

impl Checks {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        heading(out, "Collision, full cell")?;
        line(
            out,
            "  one configuration",
            &format!("median {:.2} us", self.collision_us),
        )?;
        let cloud = format!("median {:.2} us, {} points", self.collision_cloud_us, self.cloud_points);
        line(out, "  with a cloud", &cloud)?;
        line(out, "  building the cloud", &format!("{:.1} ms", self.cloud_build_ms))?;
        let (seconds, median, most) = (self.pick_seconds, self.pick_collision_ms, self.pick_collision_max_ms);
        line(
            out,
            &format!("  a pick of {seconds:.1} s"),
            &format!("median {median:.2}, most {most:.2} ms"),
        )
    }
}

impl Outcomes {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        heading(out, &format!("Stops, {} random ones", self.stops))?;
        line(out, "  not in the next period or to rest", &self.stop_late.to_string())?;
        line(out, "  that break a joint's limit", &self.stop_limit_breaks.to_string())?;
        line(
            out,
            "  that end at a joint's limit",
            &self.stop_at_joint_limit.to_string(),
        )?;
        line(
            out,
            "  with a joint faster than before",
            &self.stop_faster_joints.to_string(),
        )?;
        line(out, "  longest", &format!("{:.0} ms", self.stop_max_ms))?;
        let share = 100.0 * self.stop_tool_share;
        let fast = format!("{} (at most {share:.1} % of its limit)", self.stop_fast_tools);
        line(out, "  with a tool that is too fast", &fast)
    }
}

impl LiveStops {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        heading(out, &format!("Stops in real time, {}", self.count))?;
        line(out, "  request to first deceleration", &self.delay.for_people())?;
        let between = self.between.to_string();
        line(out, "  most set-points between", &between)?;
        let rest = self.rest_ms.unwrap_or(f64::NAN);
        line(out, "  request to rest, longest", &format!("{rest:.0} ms"))
    }
}

impl ServoFigures {
    fn tell(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (seconds, motions) = (self.servo_seconds, self.motions);
        heading(out, &format!("Servo loop, {seconds:.0} s, {motions} motions"))?;
        line(
            out,
            "  real-time",
            &format!("{}; memory {}", self.realtime_scheduling, self.realtime_memory),
        )?;
        let (median, p99, most) = (self.servo_p50_us, self.servo_p99_us, self.servo_max_us);
        line(
            out,
            "  wakes up late by",
            &format!("median {median:.0}, p99 {p99:.0}, most {most:.0} us"),
        )?;
        line(out, "  set-points leave late by", &self.sent_late_us.for_people())?;
        line(out, "  are read late by", &self.received_late_us.for_people())?;
        line(out, "  late periods", &self.servo_late_periods.to_string())?;
        let (sent, lost) = (self.setpoints_sent, self.setpoints_lost);
        let others = format!("{} unknown, {} refused", self.setpoints_unknown, self.setpoints_refused);
        line(out, "  set-points", &format!("{sent} sent, {lost} lost, {others}"))?;
        line(out, "  motions stopped", &self.motions_stopped.to_string())?;
        line(out, "  error at the end", &format!("{:.1e} rad", self.end_error))
    }
}
