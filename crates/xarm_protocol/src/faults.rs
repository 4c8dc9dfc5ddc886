//! What the controller's numbers mean: what happened, the likely cause, and what to do.

mod controller;
mod servo;

pub use controller::controller_errors;
pub use servo::servo_errors;

use std::fmt::Write;

/// How an arm gets out of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Recovery {
    /// Cleaning it and enabling the arm again is enough.
    Automatic,
    /// The same, but a person has to look first: the arm may stand against something.
    AfterLook,
    /// A person has to do something first.
    Person,
    /// The box has to be switched off and on, or the maker asked.
    Service,
}

/// A number and its meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// As the controller reports it.
    pub code: u8,
    /// What happened.
    pub what: &'static str,
    /// Likely cause.
    pub cause: &'static str,
    /// What to do.
    pub remedy: &'static str,
    /// How the arm gets out of it.
    pub recovery: Recovery,
}

const fn fault(code: u8, what: &'static str, cause: &'static str, remedy: &'static str, recovery: Recovery) -> Fault {
    Fault {
        code,
        what,
        cause,
        remedy,
        recovery,
    }
}

const WARNINGS: [Fault; 5] = [
    fault(
        11,
        "the controller's queue is full",
        "commands are sent faster than they are executed",
        "wait until the queue has room",
        Recovery::Automatic,
    ),
    fault(
        12,
        "a parameter is wrong",
        "a command with a number outside its range",
        "look at the command that was sent last",
        Recovery::Automatic,
    ),
    fault(
        13,
        "a command is not known",
        "the firmware is older or newer than the client expects",
        "compare the firmware's version with those supported",
        Recovery::Automatic,
    ),
    fault(
        14,
        "a command has no solution",
        "a pose out of reach",
        "choose another pose",
        Recovery::Automatic,
    ),
    fault(
        15,
        "the queue to the tool is full",
        "the tool is asked for faster than its bus carries",
        "ask less often",
        Recovery::Automatic,
    ),
];

const UNKNOWN: Fault = fault(
    0,
    "a fault that is not in the table",
    "unknown",
    "look the number up in the manual of the controller's firmware",
    Recovery::Service,
);

/// All warnings.
pub fn warnings() -> &'static [Fault] {
    &WARNINGS
}

/// The controller's error of this number; 0 is none.
pub fn controller_error(code: u8) -> Option<Fault> {
    find(controller_errors(), code)
}

/// The controller's warning of this number; 0 is none.
pub fn warning(code: u8) -> Option<Fault> {
    find(&WARNINGS, code)
}

/// A servo's error of this number; 0 is none.
pub fn servo_error(code: u8) -> Option<Fault> {
    find(servo_errors(), code)
}

fn find(table: &[Fault], code: u8) -> Option<Fault> {
    if code == 0 {
        return None;
    }
    let known = table.iter().find(|fault| fault.code == code).copied();
    Some(known.unwrap_or(Fault { code, ..UNKNOWN }))
}

impl Recovery {
    /// What `recover` does about it.
    pub fn text(self) -> &'static str {
        match self {
            Self::Automatic => "`recover`",
            Self::AfterLook => "look at the arm, then `recover`",
            Self::Person => "do this, then `recover`",
            Self::Service => "`recover` cannot help",
        }
    }
}

/// A table for a documentation page.
pub fn markdown_table(faults: &[Fault]) -> String {
    let mut table =
        String::from("| code | what happened | likely cause | what to do | way out |\n|---|---|---|---|---|\n");
    for Fault {
        code,
        what,
        cause,
        remedy,
        recovery,
    } in faults
    {
        let way_out = recovery.text();
        // Writing to a string cannot fail.
        let _ = writeln!(table, "| {code} | {what} | {cause} | {remedy} | {way_out} |");
    }
    table
}
