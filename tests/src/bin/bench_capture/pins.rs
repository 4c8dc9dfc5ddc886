//! What the simulated board's pins did.

use std::sync::{Arc, Mutex, PoisonError};

use sim::board::{Edge, Pin};

const CYCLES_PER_MICRO: f64 = 16.0;

/// How long each panel was on, in microseconds, every time.
#[derive(Clone, Default)]
pub(crate) struct Pins(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    on_since: [Option<u64>; 8],
    on_micros: Vec<f64>,
}

impl Pins {
    pub(crate) fn take(&self, edge: &Edge) {
        let Pin::Panel(panel) = edge.pin else { return };
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if edge.high {
            state.on_since[usize::from(panel)] = Some(edge.cycle);
        } else if let Some(since) = state.on_since[usize::from(panel)].take() {
            state.on_micros.push((edge.cycle - since) as f64 / CYCLES_PER_MICRO);
        }
    }

    pub(crate) fn on_times(&self) -> Vec<f64> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).on_micros.clone()
    }
}
