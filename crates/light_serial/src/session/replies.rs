//! What the firmware says, and what follows from it.

use std::time::Instant;

use light_protocol::{Ack, EndReason, Ended, Message, Panels, Refusal, RefusalReason};

use super::activity::Activity;
use super::pending::{Pending, Purpose};
use super::{End, Outcome, PINGS_TO_LEARN_FROM, STOPPED, Session};
use crate::clock::Exchange;
use crate::convert::refused;
use crate::line::Arrived;

impl Session<'_> {
    pub(super) async fn take(&mut self, arrived: &Arrived) -> Outcome {
        let received = match arrived.content {
            Ok(received) => received,
            Err(error) => {
                tracing::debug!(%error, "a damaged frame");
                return Ok(None);
            }
        };
        self.pending.heard();
        let number = received.sequence_number;
        match received.message {
            Message::Boot(hello) => Ok(Some(End::Reset {
                cause: hello.reset_cause.to_string(),
            })),
            // A late answer to a HELLO that was sent twice.
            Message::Hello(_) => Ok(None),
            Message::Ack(ack) => self.acknowledged(number, ack, arrived).await,
            Message::Nak(refusal) => self.refused(number, refusal).await,
            Message::Step(report) => {
                self.lit = Panels::NONE;
                if let Activity::Sequence(run) = &mut self.activity
                    && run.number == number
                {
                    run.add(report);
                }
                Ok(None)
            }
            Message::Ended(ended) => self.ended(number, ended).await,
        }
    }

    async fn acknowledged(&mut self, number: u8, ack: Ack, arrived: &Arrived) -> Outcome {
        self.lit = ack.lit;
        if let Some(pending) = self.pending.take(number) {
            self.learn(&pending, ack, arrived);
            self.done(pending, ack, arrived.at);
        }
        match self.activity {
            // Replies come in order, so this is newer than the SET, whose end was not heard.
            Activity::Manual { .. } if ack.lit == Panels::NONE => self.activity = Activity::Idle,
            Activity::Idle if ack.lit != Panels::NONE && !self.pending.has_off() && !self.pending.has_set() => {
                self.shared
                    .fault(format!("{} was on without having been asked for", ack.lit));
                return self.off(None).await;
            }
            _ => {}
        }
        Ok(None)
    }

    fn done(&mut self, pending: Pending, ack: Ack, arrived_at: Instant) {
        match pending.purpose {
            Purpose::Ping | Purpose::Sequence => {}
            Purpose::Set { light, reply } => {
                let since = self.clock.instant(ack.at).unwrap_or(arrived_at);
                self.activity = Activity::Manual {
                    number: pending.sent.number,
                    until: since + light.duration(),
                };
                self.tell();
                // Whoever asked may have gone; the SET ends by itself.
                let _ = reply.send(Ok(()));
            }
            Purpose::Off { ends, reply } => {
                if ends.is_some() && ends == self.activity.number() {
                    self.fail_run(STOPPED);
                    self.activity.end();
                }
                self.tell();
                reply.map(|reply| reply.send(Ok(())));
            }
        }
    }

    fn learn(&mut self, pending: &Pending, ack: Ack, arrived: &Arrived) {
        // The stamp of a SEQ is that of its first step, which is yet to come.
        if matches!(pending.purpose, Purpose::Sequence) {
            return;
        }
        let jumped = self.clock.add(ack.at, &Exchange::new(pending.sent, arrived));
        if jumped {
            tracing::warn!("the light controller's clock is not where it should be; it is learnt anew");
            self.shared.count(|statistics| statistics.clock_jumps += 1);
            self.pings_to_learn_from = PINGS_TO_LEARN_FROM;
            self.next_ping = Instant::now();
        }
    }

    async fn refused(&mut self, number: u8, refusal: Refusal) -> Outcome {
        match refusal.reason {
            RefusalReason::NoHello => {
                return Ok(Some(End::Reset {
                    cause: "it asks to be greeted".into(),
                }));
            }
            RefusalReason::BadCrc => return self.damaged_on_the_way().await,
            _ => {}
        }
        let Some(pending) = self.pending.take(number) else {
            return Ok(None);
        };
        if matches!(pending.purpose, Purpose::Sequence) {
            if let Activity::Sequence(run) = self.activity.end() {
                self.tell();
                run.refuse(refused(&refusal));
            }
            return Ok(None);
        }
        // What a refused SET should have replaced may be off, too: let there be no doubt.
        if matches!(pending.purpose, Purpose::Set { .. }) {
            self.off(None).await?;
        }
        pending.purpose.fail(refused(&refusal));
        Ok(None)
    }

    /// Which frame it was is not known, so none of those that are under way can be relied on.
    async fn damaged_on_the_way(&mut self) -> Outcome {
        self.shared.count(|statistics| statistics.bad_frames_sent += 1);
        for pending in self.pending.take_sent_before(Instant::now()) {
            self.repeat(pending, "a frame to the controller arrived damaged")
                .await?;
        }
        Ok(None)
    }

    async fn ended(&mut self, number: u8, ended: Ended) -> Outcome {
        if self.activity.number() != Some(number) {
            // Of something that was replaced.
            return Ok(None);
        }
        self.lit = Panels::NONE;
        let Activity::Sequence(run) = self.activity.end() else {
            if ended.reason == EndReason::Silence {
                self.shared.fault(ended.reason.to_string());
            }
            return Ok(None);
        };
        self.tell();
        match run.end(ended, &self.clock) {
            Ok(()) => Ok(None),
            Err(error) => {
                self.fault(&error);
                self.off(None).await
            }
        }
    }
}
