//! The tool board on the flange, and the vacuum gripper that hangs on it.

use xarm_protocol::{VacuumHardware, tool_address};

/// From the rim's contact until the pump has drawn the cup empty, seconds.
const SEALING: f64 = 0.2;
/// How long a seal holds when the pump stops and the vent stays shut, seconds.
const LEAKING: f64 = 2.0;
/// What the board answers as its version.
const VERSION: [i32; 3] = [3, 1, 2];

#[derive(Debug)]
pub(super) struct ToolBoard {
    hardware: VacuumHardware,
    outputs: u8,
    /// Kilograms that are held.
    held: Option<f64>,
    /// Seconds for which the rim lies on something while the pump runs.
    drawn: f64,
    /// Seconds since the pump stopped.
    idle: f64,
    /// The object fell; it is not taken again before the pump was off.
    lost: bool,
    pub(super) never_seals: bool,
}

impl ToolBoard {
    pub(super) fn new(hardware: VacuumHardware) -> Self {
        Self {
            hardware,
            outputs: 0,
            held: None,
            drawn: 0.0,
            idle: 0.0,
            lost: false,
            never_seals: false,
        }
    }

    /// Mask in the high byte, bits in the low one.
    pub(super) fn set_outputs(&mut self, value: u16) {
        let [mask, bits] = value.to_be_bytes();
        self.outputs = self.outputs & !mask | bits & mask;
    }

    pub(super) fn read(&self, address: u16) -> Option<i32> {
        let versions = tool_address::VERSION..tool_address::VERSION + 3;
        Some(match address {
            tool_address::INPUTS if self.held.is_some() => self.hardware.input_bit().into(),
            tool_address::OUTPUTS => self.outputs.into(),
            tool_address::INPUTS | tool_address::ANALOG => 0,
            _ if address == tool_address::ANALOG + 1 => 0,
            _ if versions.contains(&address) => VERSION[usize::from(address - tool_address::VERSION)],
            _ => return None,
        })
    }

    /// Kilograms that the cup holds.
    pub(super) fn held(&self) -> Option<f64> {
        self.held
    }

    /// Whether the pump runs and the vent is shut.
    pub(super) fn is_drawing(&self) -> bool {
        self.hardware.is_on(self.outputs.into())
    }

    pub(super) fn lose(&mut self) {
        (self.held, self.lost) = (None, true);
    }

    /// `touched` tells what mass the cup's rim lies on.
    pub(super) fn step(&mut self, seconds: f64, touched: impl FnOnce() -> Option<f64>) {
        if !self.is_drawing() {
            self.rest(seconds);
            return;
        }
        self.idle = 0.0;
        if self.held.is_some() || self.lost || self.never_seals {
            return;
        }
        let Some(mass) = touched() else {
            self.drawn = 0.0;
            return;
        };
        self.drawn += seconds;
        if self.drawn >= SEALING {
            self.held = Some(mass);
        }
    }

    fn rest(&mut self, seconds: f64) {
        (self.drawn, self.lost) = (0.0, false);
        self.idle += seconds;
        let is_vented = self.outputs & self.hardware.vent_bit() != 0;
        if is_vented || self.idle >= LEAKING {
            self.held = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(on: bool) -> ToolBoard {
        let mut board = ToolBoard::new(VacuumHardware::Contacts);
        for value in VacuumHardware::Contacts.writes(on) {
            board.set_outputs(value);
        }
        board
    }

    #[test]
    fn the_wrong_wiring_runs_no_pump() {
        let mut board = ToolBoard::new(VacuumHardware::Contacts);
        for value in VacuumHardware::Cable.writes(true) {
            board.set_outputs(value);
        }
        board.step(10.0, || Some(0.1));
        assert_eq!((board.held(), board.read(tool_address::INPUTS)), (None, Some(0)));
    }

    #[test]
    fn a_seal_needs_contact_for_a_time_and_ends_with_the_vent() {
        let mut board = board(true);
        board.step(0.1, || Some(0.3));
        assert_eq!(board.held(), None);
        board.step(0.15, || Some(0.3));
        assert_eq!((board.held(), board.read(tool_address::INPUTS)), (Some(0.3), Some(4)));
        board.set_outputs(VacuumHardware::Contacts.writes(false)[0]);
        board.step(0.1, || None);
        assert_eq!(board.held(), Some(0.3), "the vent is shut still");
        board.set_outputs(VacuumHardware::Contacts.writes(false)[1]);
        board.step(0.1, || None);
        assert_eq!(board.held(), None);
    }

    #[test]
    fn what_is_lost_is_not_taken_again_until_the_pump_was_off() {
        let mut board = board(true);
        board.step(0.3, || Some(0.3));
        board.lose();
        board.step(0.3, || Some(0.3));
        assert_eq!(board.held(), None);
        board.set_outputs(VacuumHardware::Contacts.writes(false)[0]);
        board.step(0.1, || None);
        board.set_outputs(VacuumHardware::Contacts.writes(true)[0]);
        board.step(0.3, || Some(0.3));
        assert_eq!(board.held(), Some(0.3));
    }
}
