//! What the child has told so far.

use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex};

use super::Slips;

#[derive(Debug, Default)]
pub(super) struct State {
    /// Every edge before this has been handed out.
    pub(super) reached: Option<Instant>,
    pub(super) plugged: bool,
    /// The child is no more.
    pub(super) ended: bool,
    /// What went wrong, for people.
    pub(super) problem: Option<String>,
    pub(super) slips: Slips,
}

#[derive(Debug, Default)]
pub(super) struct Progress {
    state: Mutex<State>,
    changed: Condvar,
}

impl Progress {
    pub(super) fn update(&self, change: impl FnOnce(&mut State)) {
        change(&mut self.state.lock());
        self.changed.notify_all();
    }

    /// Whether it came to this before the deadline. The end of the child ends waiting.
    pub(super) fn wait(&self, deadline: Instant, arrived: impl Fn(&State) -> bool) -> bool {
        let mut state = self.state.lock();
        while !arrived(&state) && !state.ended {
            if self.changed.wait_until(&mut state, deadline).timed_out() {
                break;
            }
        }
        arrived(&state)
    }

    pub(super) fn slips(&self) -> Slips {
        self.state.lock().slips
    }

    pub(super) fn problem(&self) -> Option<String> {
        let state = self.state.lock();
        let ended = state.ended.then(|| "without a word".to_owned());
        state.problem.clone().or(ended)
    }

    pub(super) fn slipped(&self, by: Duration) {
        self.update(|state| {
            state.slips.count += 1;
            state.slips.total += by;
        });
    }
}
