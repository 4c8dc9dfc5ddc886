//! What is asked of `plan_grasp`.

use geometry::nalgebra::Vector3;
use interfaces::rakelight_msgs::msg::Grasp;
use interfaces::rakelight_msgs::srv::PlanGraspRequest;

use crate::error::Refusal;

/// Shorter is no direction.
const SHORTEST: f64 = 1e-6;
/// The cup may rise this much on its way, as a share of it.
const RISING: f64 = 0.1;

/// A request that makes sense.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Ask {
    /// Empty: the last one.
    pub(crate) capture_id: String,
    pub(crate) mode: Mode,
    /// In which the cup is to move, unit, base frame; none: as configured.
    pub(crate) direction: Option<Vector3<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mode {
    Solid,
    Thin,
}

impl Mode {
    /// As messages have it.
    pub(crate) fn number(self) -> u8 {
        match self {
            Self::Solid => Grasp::SOLID,
            Self::Thin => Grasp::THIN,
        }
    }
}

impl Ask {
    /// `cone` is the largest angle between approach and direction, radians.
    pub(crate) fn read(request: &PlanGraspRequest, cone: f64) -> Result<Self, Refusal> {
        if !request.target.is_empty() {
            return Err(Refusal::Target {
                name: request.target.clone(),
            });
        }
        let mode = match request.mode {
            Grasp::SOLID => Mode::Solid,
            Grasp::THIN => Mode::Thin,
            found => return Err(Refusal::Mode { found }),
        };
        let wanted = &request.direction;
        let direction = direction(Vector3::new(wanted.x, wanted.y, wanted.z))?;
        if mode == Mode::Thin {
            require_downward(direction.as_ref(), cone)?;
        }
        Ok(Self {
            capture_id: request.capture_id.clone(),
            mode,
            direction,
        })
    }
}

fn direction(wanted: Vector3<f64>) -> Result<Option<Vector3<f64>>, Refusal> {
    let [x, y, z] = wanted.into();
    if wanted == Vector3::zeros() {
        return Ok(None);
    }
    let unit = wanted
        .try_normalize(SHORTEST)
        .filter(|unit| unit.iter().all(|number| number.is_finite()));
    let unit = unit
        .filter(|unit| unit.norm() > 0.5)
        .ok_or(Refusal::Direction { x, y, z })?;
    if unit.z > RISING {
        return Err(Refusal::FromBelow { x, y, z });
    }
    Ok(Some(unit))
}

/// The cup comes to thin objects along the table's normal only.
fn require_downward(direction: Option<&Vector3<f64>>, cone: f64) -> Result<(), Refusal> {
    let off = direction.map_or(0.0, |direction| direction.angle(&-Vector3::z()));
    if off <= cone {
        return Ok(());
    }
    Err(Refusal::Sideways {
        degrees: off.to_degrees(),
        allowed: cone.to_degrees(),
    })
}

#[cfg(test)]
mod tests {
    use interfaces::geometry_msgs::msg::Vector3 as Vector3Message;

    use super::*;

    const CONE: f64 = 0.8;

    fn along(x: f64, y: f64, z: f64) -> PlanGraspRequest {
        PlanGraspRequest {
            direction: Vector3Message { x, y, z },
            ..PlanGraspRequest::default()
        }
    }

    #[test]
    fn an_empty_request_asks_for_whatever_can_be_picked() {
        let ask = Ask::read(&PlanGraspRequest::default(), CONE).expect("an ask");
        assert_eq!(
            (ask.mode, ask.direction, ask.capture_id.as_str()),
            (Mode::Solid, None, "")
        );
    }

    #[test]
    fn a_direction_may_have_any_length() {
        let ask = Ask::read(&along(0.0, -300.0, 0.0), CONE).expect("an ask");
        assert_eq!(ask.direction, Some(-Vector3::y()));
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_what_was_asked() {
        let target = PlanGraspRequest {
            target: "mug".into(),
            ..PlanGraspRequest::default()
        };
        let mode = PlanGraspRequest {
            mode: 7,
            ..PlanGraspRequest::default()
        };
        let sideways = PlanGraspRequest {
            mode: Grasp::THIN,
            ..along(1.0, 0.0, 0.0)
        };
        for (request, expected) in [
            (sideways, "90 degrees off straight down, but thin objects"),
            (target, "\"mug\", but named objects cannot be looked for"),
            (mode, "mode is 7"),
            (along(0.0, f64::NAN, 0.0), "direction is (0, NaN, 0)"),
            (along(f64::INFINITY, 0.0, 0.0), "direction is (inf, 0, 0)"),
            (along(0.0, 1e-9, 0.0), "longer than 1e-6"),
            (along(0.0, 0.0, 1.0), "from below the table"),
        ] {
            let text = Ask::read(&request, CONE).expect_err("refused").to_string();
            assert!(text.contains(expected), "{text}");
        }
    }
}
