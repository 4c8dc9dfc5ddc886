//! Runs a cycle: does what it asks for, and tells it what happens.

use std::future::pending;
use std::sync::Arc;
use std::time::Duration;

use futures::FutureExt;
use futures::future::BoxFuture;
use tokio::time::{Instant, sleep_until};
use tokio_util::sync::CancellationToken;
use tracing::Instrument;

use crate::arm::Arm;
use crate::convert;
use crate::cycle::{Command, Cycle, Event, Outcome, View};
use crate::hands::{Hands, Wanted};

/// A cycle that is being run.
pub(crate) struct Drive {
    pub(crate) hands: Arc<Hands>,
    pub(crate) arm: Arm,
    pub(crate) wanted: Wanted,
    pub(crate) cancel: CancellationToken,
}

/// What is under way, and how it is told to end.
struct Job {
    answer: BoxFuture<'static, Event>,
    interrupt: CancellationToken,
}

impl Job {
    fn none() -> Self {
        Self {
            answer: pending().boxed(),
            interrupt: CancellationToken::new(),
        }
    }
}

impl Drive {
    /// To the end. `tell` hears how it goes, whenever that changes, and the time since the begin.
    pub(crate) async fn run(
        mut self,
        (mut cycle, first): (Cycle, Option<Command>),
        mut tell: impl FnMut(&View, Duration),
    ) -> Outcome {
        let begun = Instant::now();
        let mut job = Job::none();
        self.act(first, &mut job);
        let mut told = None;
        loop {
            let view = cycle.view();
            if told.as_ref() != Some(&view) {
                tell(&view, begun.elapsed());
                told = Some(view);
            }
            if let Some(outcome) = cycle.outcome() {
                return outcome.clone();
            }
            let event = self.next(&mut job, begun + cycle.deadline()).await;
            let next = cycle.on(event, begun.elapsed());
            self.act(next, &mut job);
        }
    }

    async fn next(&mut self, job: &mut Job, deadline: Instant) -> Event {
        tokio::select! {
            answer = &mut job.answer => {
                *job = Job::none();
                answer
            }
            Some(state) = self.arm.next() => Event::Arm(convert::report(&state)),
            () = self.cancel.cancelled() => {
                // Once is enough.
                self.cancel = CancellationToken::new();
                Event::Cancel
            }
            () = sleep_until(deadline) => Event::Tick,
        }
    }

    fn act(&self, command: Option<Command>, job: &mut Job) {
        let Some(command) = command else { return };
        tracing::debug!(?command, "next");
        match command {
            Command::Interrupt => job.interrupt.cancel(),
            Command::Halt => {
                let hands = Arc::clone(&self.hands);
                tokio::spawn(async move { hands.halt().await }.in_current_span());
            }
            command => {
                let interrupt = CancellationToken::new();
                let hands = Arc::clone(&self.hands);
                let answer = hands.perform(command, self.wanted.clone(), interrupt.clone());
                *job = Job {
                    answer: answer.boxed(),
                    interrupt,
                };
            }
        }
    }
}
