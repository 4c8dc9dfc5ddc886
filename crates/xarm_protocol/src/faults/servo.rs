//! Errors of the servos, behind the controller's errors 10 to 17.

use super::Recovery::{AfterLook, Person, Service};
use super::{Fault, fault};

/// Those worth naming, by number.
pub fn servo_errors() -> &'static [Fault] {
    &ERRORS
}

#[rustfmt::skip]
const ERRORS: [Fault; 12] = [
    fault(10, "the measured current is wrong", "a fault of the drive", "switch the box off and on", Service),
    fault(11, "over-current", "a blocked joint", "free the joint", AfterLook),
    fault(12, "over-speed", "an external force", "look at the arm", AfterLook),
    fault(14, "the commanded position is beyond the joint's limit", "a wrong zero", "turn the joint back", AfterLook),
    fault(15, "too hot", "heavy work without pause", "let the joint cool down", Person),
    fault(19, "the encoder's battery is empty", "age", "change the battery, calibrate the zero", Service),
    fault(23, "the joint is far from its commanded position", "overload, or a blocked joint", "free the joint, take load off", AfterLook),
    fault(26, "beyond the upper end", "turned by hand while it was off", "turn the joint back", Person),
    fault(27, "beyond the lower end", "turned by hand while it was off", "turn the joint back", Person),
    fault(33, "overload", "more load than allowed", "take load off", AfterLook),
    fault(39, "over-voltage", "the supply, or hard braking", "check the supply, brake softer", AfterLook),
    fault(40, "under-voltage", "the supply", "check the supply", Person),
];
