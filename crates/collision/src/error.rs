//! Why there is no model, no scene or no answer.

use kinematics::KinematicsError;

/// What is wrong, where, with what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CollisionError {
    /// Joints of the chain, or angles that are no numbers.
    #[error(transparent)]
    Kinematics(#[from] KinematicsError),
    /// A link, an obstacle or a carried object that was asked for.
    #[error("there is no {what} `{name}`")]
    Unknown {
        /// What kind of thing.
        what: &'static str,
        /// As given.
        name: String,
    },
    /// Two obstacles cannot have one name.
    #[error("there is already an obstacle `{name}`")]
    NameTaken {
        /// As given.
        name: String,
    },
    /// A shape in a URDF that is not understood.
    #[error(
        "link `{link}`: collision shape {shape} is a {kind}; understood are boxes, cylinders, spheres and capsules"
    )]
    ShapeKind {
        /// Which link.
        link: String,
        /// Which of its collision elements, 1 for the first.
        shape: usize,
        /// As the URDF says.
        kind: String,
    },
    /// A number, with its place.
    #[error("{place}: {what} = {value}, allowed: {allowed}")]
    Number {
        /// Whose number.
        place: String,
        /// Which number.
        what: &'static str,
        /// As given.
        value: f64,
        /// The range in words.
        allowed: &'static str,
    },
    /// Points or triangles that make no body.
    #[error("{place}: {reason}")]
    Body {
        /// Which shape.
        place: String,
        /// Why not.
        reason: String,
    },
    /// A joint of the URDF that moves but is not one of the chain's.
    #[error("link `{link}` hangs on joint `{joint}`, which moves but is no joint of the chain")]
    ForeignJoint {
        /// Which link.
        link: String,
        /// Which joint.
        joint: String,
    },
    /// Joints that lead back to where they came from.
    #[error("the joints above link `{link}` form a loop")]
    Loop {
        /// Which link.
        link: String,
    },
    /// A path that moves faster than it says could pass through things between two looks.
    #[error(
        "at {time:.4} s joint {joint} moved {moved:.6} rad since the look before, its stated speed allows {allowed:.6}"
    )]
    FasterThanStated {
        /// 1 for the first.
        joint: usize,
        /// Seconds.
        time: f64,
        /// Radians.
        moved: f64,
        /// Radians.
        allowed: f64,
    },
}

/// Refuses a number outside its range.
pub(crate) fn require(
    place: &str,
    what: &'static str,
    value: f64,
    is_allowed: bool,
    allowed: &'static str,
) -> Result<(), CollisionError> {
    if is_allowed {
        return Ok(());
    }
    Err(CollisionError::Number {
        place: place.to_owned(),
        what,
        value,
        allowed,
    })
}

/// Refuses lengths that are no lengths.
pub(crate) fn require_length(place: &str, what: &'static str, value: f64) -> Result<(), CollisionError> {
    require(
        place,
        what,
        value,
        value.is_finite() && value > 0.0,
        "finite metres, more than 0",
    )
}

/// Refuses coordinates that are no numbers.
pub(crate) fn require_finite(place: &str, what: &'static str, values: &[f64]) -> Result<(), CollisionError> {
    values
        .iter()
        .try_for_each(|&value| require(place, what, value, value.is_finite(), "finite numbers"))
}
