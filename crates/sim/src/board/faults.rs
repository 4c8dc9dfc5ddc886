//! What can go wrong with a board, on request.

use std::fmt::Write;
use std::time::Duration;

use super::LightBoard;
use crate::SimError;

impl LightBoard {
    /// Resets the board, as DTR does; its boot loader is silent for so long.
    pub fn reset(&self, silence: Duration) -> Result<(), SimError> {
        self.order(&format!("reset {}", silence.as_micros()))
    }

    /// Takes the terminal away: whoever has it open sees a hang-up, and the link is gone. The board stays powered.
    pub fn unplug(&self) -> Result<(), SimError> {
        self.order("unplug")?;
        self.wait_for_port(false)
    }

    /// Gives a new terminal, and lets the link lead to it.
    pub fn plug(&self) -> Result<(), SimError> {
        self.order("plug")?;
        self.wait_for_port(true)
    }

    /// Sends bytes to the host, between those of the firmware.
    pub fn inject(&self, bytes: &[u8]) -> Result<(), SimError> {
        let mut order = String::from("inject ");
        for byte in bytes {
            // Writing to a string does not fail.
            let _ = write!(order, "{byte:02x}");
        }
        self.order(&order)
    }

    /// Loses the next bytes on their way to the firmware.
    pub fn drop_bytes_to_firmware(&self, count: usize) -> Result<(), SimError> {
        self.order(&format!("drop {count}"))
    }

    /// Changes the next bytes on their way to the firmware.
    pub fn corrupt_bytes_to_firmware(&self, count: usize) -> Result<(), SimError> {
        self.order(&format!("corrupt {count}"))
    }

    /// Changes the next bytes on their way to the host.
    pub fn corrupt_bytes_to_host(&self, count: usize) -> Result<(), SimError> {
        self.order(&format!("corrupt_replies {count}"))
    }

    /// The firmware gets nowhere from now on; its hardware watchdog resets it within 300 ms.
    pub fn hang(&self) -> Result<(), SimError> {
        self.order("hang")
    }

    fn order(&self, order: &str) -> Result<(), SimError> {
        Ok(self.child.order(order)?)
    }
}
