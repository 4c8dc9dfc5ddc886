//! The vacuum gripper on the arm's tool board.

use std::time::Duration;

use devices::{ArmError, SuctionState};
use tokio::time::Instant;
use xarm_protocol::{Reply, Request, Status, VacuumHardware, tool_address};

use crate::config::Timeouts;
use crate::error::LinkError;
use crate::greeting::Link;

/// Outputs are asked for so often until they are as they were set; there is no event that tells.
const ASK_AGAIN: Duration = Duration::from_millis(20);

/// A gripper, while its controller is connected.
pub(crate) struct Gripper {
    pub(crate) link: Link,
    pub(crate) hardware: VacuumHardware,
    pub(crate) timeouts: Timeouts,
}

impl Gripper {
    /// Pump, then vent; done when the outputs say so.
    pub(crate) async fn set(&self, on: bool) -> Result<(), ArmError> {
        for value in self.hardware.writes(on) {
            self.write(value).await?;
        }
        let deadline = Instant::now() + self.timeouts.suction;
        loop {
            let outputs = self.read_board(tool_address::OUTPUTS).await?;
            if self.is_set(on, outputs) {
                return Ok(());
            }
            if Instant::now() >= deadline {
                return Err(ArmError::Timeout {
                    what: "switching the vacuum gripper's outputs",
                    timeout: self.timeouts.suction,
                });
            }
            tokio::time::sleep(ASK_AGAIN).await;
        }
    }

    /// By outputs and inputs as they are now.
    pub(crate) async fn read(&self) -> Result<SuctionState, ArmError> {
        let outputs = self.read_board(tool_address::OUTPUTS).await?;
        let inputs = self.read_board(tool_address::INPUTS).await?;
        Ok(SuctionState {
            on: self.hardware.is_on(outputs),
            held: self.hardware.is_held(inputs),
        })
    }

    fn is_set(&self, on: bool, outputs: i32) -> bool {
        let has = |bit: u8| outputs & i32::from(bit) != 0;
        has(self.hardware.pump_bit()) == on && has(self.hardware.vent_bit()) != on
    }

    async fn write(&self, value: u16) -> Result<(), ArmError> {
        let at_once = self.link.identity.firmware.has_immediate_tool_io();
        let request = Request::ToolWrite {
            address: tool_address::SET_OUTPUTS,
            value: f32::from(value),
            in_queue: at_once.then_some(false),
        };
        self.ask(request).await.map(drop)
    }

    async fn read_board(&self, address: u16) -> Result<i32, ArmError> {
        let reply = self.ask(Request::ToolRead { address }).await?;
        reply.read_integer().map_err(|error| ArmError::Refused {
            reason: format!("the tool board's answer is not understood: {error}"),
        })
    }

    /// Errors, warnings and an arm that is not ready do not concern the gripper.
    async fn ask(&self, request: Request) -> Result<Reply, ArmError> {
        let timeout = self.timeouts.reply;
        let reply = match self.link.control.ask("the tool board", request, timeout).await {
            Err(LinkError::Silent { waited, .. }) => {
                return Err(ArmError::Timeout {
                    what: "an answer of the tool board",
                    timeout: waited,
                });
            }
            other => other?,
        };
        if reply.status.has(Status::INVALID) {
            return Err(ArmError::Refused {
                reason: "the tool board did not answer the controller: is the gripper plugged in?".to_owned(),
            });
        }
        Ok(reply)
    }
}
