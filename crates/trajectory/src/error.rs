//! Why a motion was refused.

use kinematics::KinematicsError;

/// What is wrong, with which joint, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrajectoryError {
    /// A number that is none.
    #[error("joint {joint}: {what} is {value}, expected a finite number")]
    NotFinite {
        /// Its number, 1 for the first.
        joint: usize,
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
    },
    /// A limit that cannot be.
    #[error("joint {joint}: the limit of {what} is {value}, allowed: {allowed}")]
    Limit {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of what.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// A motion that leaves its limits.
    #[error("joint {joint}: {what} reaches {value:.6}, allowed are {least:.6} to {most:.6}")]
    Outside {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of what.
        what: &'static str,
        /// The extreme.
        value: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A duration that cannot be.
    #[error("a duration is {value} s, expected finite and more than 0")]
    Duration {
        /// As given, seconds.
        value: f64,
    },
    /// Something chosen that cannot be.
    #[error("the {what} is {value}, allowed: {allowed}")]
    Argument {
        /// What was chosen.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// Nothing to go through.
    #[error("there are no {what}, expected at least one")]
    Empty {
        /// Of what there is none.
        what: &'static str,
    },
    /// Pieces that do not fit together.
    #[error("joint {joint}: {what} jumps from {before:.9} to {after:.9} at {time:.6} s")]
    Jump {
        /// Its number, 1 for the first.
        joint: usize,
        /// Of what.
        what: &'static str,
        /// Seconds from the trajectory's begin.
        time: f64,
        /// At the end of the piece before.
        before: f64,
        /// At the begin of the piece after.
        after: f64,
    },
    /// A trajectory that begins or ends while it moves.
    #[error("joint {joint}: {what} is {value:.6} at the {end}, expected 0")]
    NotAtRest {
        /// Its number, 1 for the first.
        joint: usize,
        /// Speed or acceleration.
        what: &'static str,
        /// Which end.
        end: &'static str,
        /// Found there.
        value: f64,
    },
    /// Points whose times do not follow each other.
    #[error("point {point} is due {time} s from the start, allowed: {allowed}")]
    PointTime {
        /// Its number, 1 for the first.
        point: usize,
        /// As given, seconds.
        time: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// A number of a point that is none.
    #[error("point {point}, joint {joint}: {what} is {value}, expected a finite number")]
    PointNotFinite {
        /// Its number, 1 for the first.
        point: usize,
        /// The joint's number, 1 for the first.
        joint: usize,
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
    },
    /// A tool that is too fast.
    #[error("the tool reaches {value:.4} m/s at {time:.3} s, allowed are {most:.4}")]
    ToolSpeed {
        /// Seconds from the trajectory's begin.
        time: f64,
        /// Metres per second.
        value: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A pose on a line that the arm cannot give.
    #[error(
        "line {line}: the arm does not reach beyond {percent:.1} % ({millimetres:.1} mm) of it, {off_mm:.3} mm and {off_mrad:.3} mrad are left"
    )]
    Unreachable {
        /// Its number, 1 for the first.
        line: usize,
        /// Last place that it reaches.
        percent: f64,
        /// From the line's begin.
        millimetres: f64,
        /// How far the best angles are away from the next pose.
        off_mm: f64,
        /// Their angle to it.
        off_mrad: f64,
    },
    /// A joint that comes to its limit on a line.
    #[error(
        "line {line}: joint {joint} reaches {value:.4} at {percent:.1} % ({millimetres:.1} mm), allowed are {least:.4} to {most:.4}"
    )]
    LimitOnLine {
        /// Its number, 1 for the first.
        line: usize,
        /// The joint's number, 1 for the first.
        joint: usize,
        /// Where on the line.
        percent: f64,
        /// From the line's begin.
        millimetres: f64,
        /// Radians.
        value: f64,
        /// Smallest value allowed.
        least: f64,
        /// Largest value allowed.
        most: f64,
    },
    /// A line that passes so near to a singularity that the arm would swing to another branch.
    #[error(
        "line {line}: joint {joint} would swing by {swing:.3} rad at {percent:.1} % ({millimetres:.1} mm): the arm is near a singularity there"
    )]
    Swing {
        /// Its number, 1 for the first.
        line: usize,
        /// The joint's number, 1 for the first.
        joint: usize,
        /// Where on the line.
        percent: f64,
        /// From the line's begin.
        millimetres: f64,
        /// Within a step of a few millimetres, radians.
        swing: f64,
    },
    /// A line that could not be followed closely enough: the arm turns fast near a singularity.
    #[error(
        "line {line}: the tool is off by {off_mm:.3} mm and {off_mrad:.3} mrad at {percent:.1} % ({millimetres:.1} mm), allowed are {most_mm} mm and {most_mrad} mrad"
    )]
    OffLine {
        /// Its number, 1 for the first.
        line: usize,
        /// Where on the line it is furthest off.
        percent: f64,
        /// From the line's begin.
        millimetres: f64,
        /// Distance there.
        off_mm: f64,
        /// Angle there.
        off_mrad: f64,
        /// Allowed.
        most_mm: f64,
        /// Allowed.
        most_mrad: f64,
    },
    /// From the arm's kinematics.
    #[error(transparent)]
    Kinematics(#[from] KinematicsError),
}
