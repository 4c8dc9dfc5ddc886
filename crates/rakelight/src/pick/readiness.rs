//! A cell that has just come up may not be ready yet: its arm is armed a moment later.

use std::time::Duration;

use interfaces::rakelight_msgs::msg::CellState;
use ros::{Node, Qos};

/// A cell that is not ready by then says better itself why not.
const PATIENCE: Duration = Duration::from_secs(10);

/// Waits until the cell takes a pick, or long enough.
pub(super) async fn wait(node: &Node) -> Result<(), ros::Error> {
    let mut states = node.subscription::<CellState>("state", Qos::LATCHED)?;
    let idle = async {
        while let Some(received) = states.next().await {
            if received.message.stage == CellState::IDLE {
                return;
            }
        }
    };
    // Whoever asks hears the reason from the cell.
    let _ = tokio::time::timeout(PATIENCE, idle).await;
    Ok(())
}
