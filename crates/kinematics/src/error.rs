//! Why there is no chain, no pose or no solution.

/// What is wrong, where, with what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KinematicsError {
    /// A link that was asked for.
    #[error("the URDF has no link `{link}`")]
    NoLink {
        /// Its name.
        link: String,
    },
    /// The tip does not hang on the base.
    #[error("no way leads from link `{tip}` up to link `{base}`; it ends at `{root}`")]
    NotConnected {
        /// Where the way should begin.
        base: String,
        /// Where it should end.
        tip: String,
        /// Where it ends on the way up.
        root: String,
    },
    /// Only joints that turn are understood.
    #[error("joint `{joint}` is {kind}; understood are fixed, revolute and continuous joints")]
    JointKind {
        /// Its name.
        joint: String,
        /// As the URDF says.
        kind: String,
    },
    /// A number in the URDF or in a calibration.
    #[error("joint `{joint}`: {what} = {value}, allowed: {allowed}")]
    JointNumber {
        /// Its name.
        joint: String,
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// The chain has another number of joints than the type that was asked for.
    #[error("the way from `{base}` to `{tip}` has {found} joints that turn, expected {expected}")]
    JointCount {
        /// Where the way begins.
        base: String,
        /// Where it ends.
        tip: String,
        /// Joints on it.
        found: usize,
        /// Joints of the type.
        expected: usize,
    },
    /// An angle that is not a number.
    #[error("angle of joint `{joint}` is {value}, expected a finite number of radians")]
    NotFinite {
        /// Its name.
        joint: String,
        /// As given.
        value: f64,
    },
    /// An angle that the joint cannot have.
    #[error("angle of joint `{joint}` is {value:.4} rad, its limits are {lower:.4} to {upper:.4}")]
    OutsideLimits {
        /// Its name.
        joint: String,
        /// As given, radians.
        value: f64,
        /// Radians.
        lower: f64,
        /// Radians.
        upper: f64,
    },
    /// A pose with numbers that are none.
    #[error("the pose asked for holds numbers that are not finite")]
    PoseNotFinite,
    /// No joint angles give the pose.
    #[error(
        "no joint angles within the limits give the pose: after {attempts} attempts the best one is {position_mm:.3} mm and {rotation_deg:.3} degrees away"
    )]
    Unreachable {
        /// Starts that were tried.
        attempts: usize,
        /// Distance of the best attempt, millimetres.
        position_mm: f64,
        /// Its angle, degrees.
        rotation_deg: f64,
    },
}
