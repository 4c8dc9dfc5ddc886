//! A pump that holds nothing while the arm rests is switched off by and by: whoever switched it on may be gone.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::Suction;

use crate::services::Desk;

/// The controller is asked for it often enough already.
const LOOK: Duration = Duration::from_secs(1);

/// Looks until the task is ended.
pub(crate) async fn attend(desk: Arc<Desk>) {
    let mut in_vain = InVain::default();
    loop {
        tokio::time::sleep(LOOK).await;
        let is_moving = desk.executor.standing().borrow().is_moving();
        let runs_empty = match desk.suction.read().await {
            Ok(state) => state.on && !state.held && !is_moving,
            // Nobody knows, and nobody could switch it off.
            Err(_) => false,
        };
        let timeout = Duration::from_secs_f64(desk.parameters.vacuum_timeout);
        if in_vain.is_over(runs_empty, Instant::now(), timeout) {
            switch_off(desk.suction.as_ref(), timeout).await;
        }
    }
}

async fn switch_off(suction: &dyn Suction, timeout: Duration) {
    match suction.set(false).await {
        Ok(()) => tracing::warn!("the pump held nothing for {timeout:?} while the arm rested: it was switched off"),
        Err(error) => tracing::error!(%error, "the pump holds nothing and cannot be switched off"),
    }
}

/// Since when the pump runs and holds nothing.
#[derive(Debug, Default)]
struct InVain {
    since: Option<Instant>,
}

impl InVain {
    /// Whether that has lasted for `timeout`; it counts anew afterwards.
    fn is_over(&mut self, runs_empty: bool, now: Instant, timeout: Duration) -> bool {
        if !runs_empty {
            self.since = None;
            return false;
        }
        let is_over = now.duration_since(*self.since.get_or_insert(now)) >= timeout;
        if is_over {
            self.since = None;
        }
        is_over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_pump_that_runs_empty_all_the_time_is_switched_off() {
        let (start, timeout) = (Instant::now(), Duration::from_secs(10));
        let at = |seconds| start + Duration::from_secs(seconds);
        let mut pump = InVain::default();
        assert!(!pump.is_over(true, at(0), timeout));
        assert!(!pump.is_over(true, at(9), timeout));
        assert!(!pump.is_over(false, at(10), timeout), "something is held");
        assert!(!pump.is_over(true, at(11), timeout));
        assert!(!pump.is_over(true, at(20), timeout));
        assert!(pump.is_over(true, at(21), timeout));
        assert!(!pump.is_over(true, at(22), timeout));
    }
}
