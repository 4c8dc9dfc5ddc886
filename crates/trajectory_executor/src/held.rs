//! Whether the cup holds something, while the arm moves.

use std::time::Duration;

use devices::{Suction, SuctionState};

use crate::error::MotionError;

/// The controller is asked again so soon after its answer: at 50 mm/s the tool goes half a millimetre meanwhile.
const LOOK: Duration = Duration::from_millis(10);

/// Refuses a pump that is off; whether something is held already.
pub(crate) async fn held_with_pump_on(suction: &dyn Suction) -> Result<bool, MotionError> {
    let state = suction.read().await?;
    require_on(state)?;
    Ok(state.held)
}

/// Waits until the cup holds something.
///
/// # Errors
/// A pump that goes off, a controller that does not answer.
pub(crate) async fn until_held(suction: &dyn Suction) -> Result<(), MotionError> {
    while !held_with_pump_on(suction).await? {
        tokio::time::sleep(LOOK).await;
    }
    Ok(())
}

fn require_on(state: SuctionState) -> Result<(), MotionError> {
    if state.on {
        return Ok(());
    }
    Err(MotionError::PumpOff)
}
