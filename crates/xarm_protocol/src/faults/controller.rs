//! Errors of the controller.

use super::Recovery::{AfterLook, Automatic, Person, Service};
use super::{Fault, fault};

const SERVO_CAUSE: &str = "overload, a blocked joint, or a fault of its drive";
const SERVO_REMEDY: &str = "look at the servo's own code; free the joint";

/// All of them, by number.
pub fn controller_errors() -> &'static [Fault] {
    &ERRORS
}

#[rustfmt::skip]
const ERRORS: [Fault; 43] = [
    fault(1, "the emergency stop button of the box is pressed", "somebody pressed it", "make sure that the arm may move, release the button", Person),
    fault(2, "the emergency input of the box is open", "an external emergency stop or its cable", "close the circuit", Person),
    fault(3, "the three-state switch of the teach pendant is open", "the switch was let go or pressed through", "hold the switch in its middle, or unplug the pendant", Person),
    fault(10, "a servo has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(11, "the servo of joint 1 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(12, "the servo of joint 2 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(13, "the servo of joint 3 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(14, "the servo of joint 4 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(15, "the servo of joint 5 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(16, "the servo of joint 6 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(17, "the servo of joint 7 has an error", SERVO_CAUSE, SERVO_REMEDY, AfterLook),
    fault(18, "the force sensor does not answer", "its cable", "check the cable", Person),
    fault(19, "the tool does not answer", "its cable, or the wrong baud rate", "check the cable and the rate", Person),
    fault(21, "the kinematics have no solution", "a target out of reach or at a singularity", "choose another target", Automatic),
    fault(22, "the arm would touch itself", "a target, or a way to it, through the arm", "choose another way", Automatic),
    fault(23, "a joint is beyond its limit", "a target outside the limits", "turn the joint back by hand if it stands outside, choose another target", Automatic),
    fault(24, "a joint is too fast", "set-points too far from each other, or a motion near a singularity", "move slower", Automatic),
    fault(25, "the controller cannot plan the motion", "targets too close to each other for the speed", "move slower, or with targets further apart", Automatic),
    fault(26, "the controller's real-time thread was late", "an overloaded box", "switch the box off and on if it comes again", Automatic),
    fault(27, "a command was answered wrongly inside the box", "a fault of the box", "switch the box off and on", Service),
    fault(28, "the tool's board does not answer", "its cable", "check the cable", Person),
    fault(29, "another error of the controller", "unknown", "switch the box off and on", Service),
    fault(30, "the measured speed is beyond its limit", "an external force, or a wrong load", "set the load that hangs on the flange", AfterLook),
    fault(31, "collision: the joints take more current than the motion needs", "the arm touched something, or carries more than it was told", "free the arm, set the load", AfterLook),
    fault(32, "the circle cannot be computed", "three points on a line", "choose other points", Automatic),
    fault(33, "the inputs and outputs of the box have an error", "a short circuit", "check what is wired to the box", Person),
    fault(34, "a recording took too long", "more than five minutes", "record less", Automatic),
    fault(35, "the tool reached the safety boundary", "a target beyond it", "choose another target, or widen the boundary", Automatic),
    fault(36, "too many delayed commands", "outputs set with long delays", "wait for them", Automatic),
    fault(37, "the arm moves by itself in free drive", "a wrong load or direction of gravity", "set load and gravity", AfterLook),
    fault(38, "a joint's angle and its encoder differ", "a slipped encoder, or a push while it was off", "calibrate the arm's zero", Service),
    fault(39, "the power board does not answer", "a fault of the box", "switch the box off and on", Service),
    fault(40, "there are no joint angles for the pose", "a pose out of reach", "choose another pose", Automatic),
    fault(41, "the friction file cannot be read", "a fault of the box", "ask the maker", Service),
    fault(42, "the calibration file cannot be read", "a fault of the box", "ask the maker", Service),
    fault(50, "the force sensor has an error", "its supply, its cable, or more load than it bears", "unload it, check the cable", Person),
    fault(51, "the force sensor has an error", "its supply, its cable, or more load than it bears", "unload it, check the cable", Person),
    fault(52, "the force sensor has an error", "its supply, its cable, or more load than it bears", "unload it, check the cable", Person),
    fault(53, "the force sensor has an error", "its supply, its cable, or more load than it bears", "unload it, check the cable", Person),
    fault(54, "collision: the force sensor feels more than allowed", "the arm touched something", "free the arm", AfterLook),
    fault(60, "the tool is too fast in servo mode", "set-points more than 4 mm from each other", "move slower: below 1 m/s at the tool", Automatic),
    fault(110, "the arm's base board does not answer", "the cable between box and arm", "check the cable, switch the box off and on", Service),
    fault(111, "the external serial bus does not answer", "its cable, or the wrong baud rate", "check the cable and the rate", Person),
];
