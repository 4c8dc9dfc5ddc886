//! Faults in the cell's words.

use std::fmt::Write;

use devices::{ARM_JOINTS, ArmFault, FaultRecovery};
use xarm_protocol::{Fault, Recovery, controller_error, servo_error};

/// Status and code of each servo.
pub(crate) type Servos = [[u8; 2]; ARM_JOINTS];

/// A fault that the controller has, as it was last told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct KnownError {
    pub(crate) code: u8,
    pub(crate) servos: Option<Servos>,
}

/// Errors of servos have their detail in the servos' own codes.
pub(crate) fn is_of_servo(code: u8) -> bool {
    (10..=17).contains(&code)
}

impl KnownError {
    pub(crate) const NONE: Self = Self { code: 0, servos: None };

    /// None for code 0.
    pub(crate) fn fault(self) -> Option<ArmFault> {
        let fault = controller_error(self.code)?;
        let mut description = text(&fault);
        let mut worst = fault.recovery;
        if is_of_servo(self.code) {
            for (joint, servo) in self.servo_errors() {
                // Writing to a string cannot fail.
                let _ = write!(
                    description,
                    ". Servo of joint {joint}, code {}: {}",
                    servo.code,
                    text(&servo)
                );
                worst = graver(worst, servo.recovery);
            }
        }
        Some(ArmFault {
            code: self.code,
            description,
            recovery: recovery(worst),
        })
    }

    fn servo_errors(&self) -> impl Iterator<Item = (usize, Fault)> {
        let servos = self.servos.into_iter().flatten().enumerate();
        servos.filter_map(|(joint, [_, code])| Some((joint + 1, servo_error(code)?)))
    }
}

fn text(fault: &Fault) -> String {
    let Fault {
        what, cause, remedy, ..
    } = fault;
    format!("{what}; likely cause: {cause}; what to do: {remedy}")
}

fn graver(one: Recovery, other: Recovery) -> Recovery {
    let rank = |recovery| match recovery {
        Recovery::Automatic => 0,
        Recovery::AfterLook => 1,
        Recovery::Person => 2,
        Recovery::Service => 3,
    };
    if rank(one) >= rank(other) { one } else { other }
}

fn recovery(recovery: Recovery) -> FaultRecovery {
    match recovery {
        Recovery::Automatic => FaultRecovery::Automatic,
        Recovery::AfterLook => FaultRecovery::AfterLook,
        Recovery::Person => FaultRecovery::Person,
        Recovery::Service => FaultRecovery::Service,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_servos_own_code_says_more_and_may_be_graver() {
        let mut servos = [[0; 2]; ARM_JOINTS];
        servos[2] = [1, 19];
        let fault = KnownError {
            code: 13,
            servos: Some(servos),
        };
        let fault = fault.fault().expect("13 is one");
        assert!(
            fault
                .description
                .contains("Servo of joint 3, code 19: the encoder's battery"),
            "{}",
            fault.description
        );
        assert_eq!(fault.recovery, FaultRecovery::Service);
    }

    #[test]
    fn other_faults_have_nothing_to_do_with_servos() {
        let servos = Some([[1, 19]; ARM_JOINTS]);
        let fault = KnownError { code: 31, servos }.fault().expect("31 is one");
        assert_eq!(fault.recovery, FaultRecovery::AfterLook);
        assert!(!fault.description.contains("Servo"));
        assert_eq!(KnownError { code: 0, servos }.fault(), None);
    }
}
