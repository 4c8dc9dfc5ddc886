//! A conversation with a firmware that was greeted: commands and their replies, the pings that keep it awake and tell its
//! time, and the one thing that it is doing.

mod activity;
mod pending;
mod replies;

use std::time::{Duration, Instant};

use devices::{LightBankState, LightError, LightLink, PanelSet};
use light_protocol::{Command, Panels};
use tokio::sync::mpsc::UnboundedReceiver;

use crate::clock::BoardClock;
use crate::convert::panel_set;
use crate::error::LinkError;
use crate::greeting::Greeted;
use crate::job::{Job, Reply};
use crate::line::Line;
use crate::sequence_run::SequenceRun;
use crate::shared::Shared;
use activity::Activity;
use pending::{Pending, PendingList, Purpose};

/// Well below the firmware's 500 ms.
const PING_WHILE_LIT: Duration = Duration::from_millis(100);
const PING_WHILE_IDLE: Duration = Duration::from_secs(1);
/// The clock is learnt from a few quick pings.
const PING_WHILE_LEARNING: Duration = Duration::from_millis(30);
const PINGS_TO_LEARN_FROM: u32 = 8;
/// A reply takes a few milliseconds, up to 16 more through a USB chip, and more on a busy computer.
const REPLY_PATIENCE: Duration = Duration::from_millis(400);
/// After so long without a word the link is lost.
const SILENCE: Duration = Duration::from_millis(1500);
const CLOSE_PATIENCE: Duration = Duration::from_millis(400);
const STOPPED: &str = "stopped by the host";

/// How a conversation ended without a failure of the line.
pub(crate) enum End {
    /// The controller was dropped.
    Closed,
    /// The firmware restarted.
    Reset { cause: String },
}

pub(crate) struct Session<'a> {
    line: &'a mut Line,
    shared: &'a Shared,
    firmware_version: String,
    clock: BoardClock,
    activity: Activity,
    lit: Panels,
    pending: PendingList,
    next_ping: Instant,
    pings_to_learn_from: u32,
}

/// What a step of the conversation comes to: usually it goes on.
type Outcome = Result<Option<End>, LinkError>;

impl<'a> Session<'a> {
    pub(crate) fn new(line: &'a mut Line, greeted: Greeted, shared: &'a Shared) -> Self {
        let firmware_version = greeted.hello.firmware_version.map(|part| part.to_string()).join(".");
        tracing::info!(port = line.port(), firmware_version, "light controller connected");
        shared.count(|statistics| statistics.connections += 1);
        let session = Self {
            line,
            shared,
            firmware_version,
            clock: greeted.clock,
            activity: Activity::Idle,
            lit: Panels::NONE,
            pending: PendingList::default(),
            next_ping: Instant::now(),
            pings_to_learn_from: PINGS_TO_LEARN_FROM,
        };
        session.tell();
        session
    }

    /// Until the link or the firmware is lost, or the controller is dropped. Whoever waits for an answer gets one.
    pub(crate) async fn run(mut self, jobs: &mut UnboundedReceiver<Job>) -> Result<End, LinkError> {
        let end = self.serve(jobs).await;
        let reason = match &end {
            Ok(End::Closed) => "the driver was closed".to_owned(),
            Ok(End::Reset { cause }) => format!("the controller was reset ({cause})"),
            Err(error) => error.to_string(),
        };
        if let Activity::Sequence(run) = self.activity.end() {
            self.shared.tell_disconnected(reason.clone());
            self.fault(&run.fail(reason.clone()));
        }
        for pending in self.pending.take_sent_before(Instant::now()) {
            let reason = reason.clone();
            pending.purpose.fail(LightError::Disconnected { reason });
        }
        end
    }

    async fn serve(&mut self, jobs: &mut UnboundedReceiver<Job>) -> Result<End, LinkError> {
        loop {
            let until = self.next_deadline();
            let end = tokio::select! {
                arrived = self.line.receive() => self.take(&arrived?).await?,
                job = jobs.recv() => match job {
                    Some(job) => self.start(job).await?,
                    None => return self.close().await,
                },
                () = self.activity.given_up() => self.abort().await?,
                () = tokio::time::sleep_until(until.into()) => self.tick().await?,
            };
            if let Some(end) = end {
                return Ok(end);
            }
            self.tell();
        }
    }

    // ---- what is asked ----

    async fn start(&mut self, job: Job) -> Outcome {
        if matches!(job, Job::Set { .. } | Job::Run { .. }) && !self.make_way().await? {
            job.fail(LightError::Busy);
            return Ok(None);
        }
        match job {
            Job::Off { reply } => return self.off(Some(reply)).await,
            Job::Set { light, reply } => {
                self.send(light.command(), Purpose::Set { light, reply }).await?;
            }
            Job::Run { sequence, reply } => {
                let number = self.send(Command::Sequence(*sequence), Purpose::Sequence).await?;
                let run = SequenceRun::new(number, *sequence, reply);
                self.activity = Activity::Sequence(Box::new(run));
            }
        }
        // Something will be lit: the pause of an idle link would be too long.
        self.next_ping = self.next_ping.min(Instant::now() + PING_WHILE_LIT);
        Ok(None)
    }

    /// A sequence keeps others out, unless it is at its end anyway: the firmware takes commands in order.
    async fn make_way(&mut self) -> Result<bool, LinkError> {
        match &self.activity {
            Activity::Sequence(run) if run.is_given_up() => drop(self.abort().await?),
            Activity::Sequence(_) if self.pending.has_off() => self.fail_run(STOPPED),
            Activity::Sequence(_) => return Ok(false),
            Activity::Idle | Activity::Manual { .. } => {}
        }
        Ok(true)
    }

    async fn off(&mut self, reply: Option<Reply<()>>) -> Outcome {
        let ends = self.activity.number();
        self.send(Command::Off, Purpose::Off { ends, reply }).await?;
        Ok(None)
    }

    /// Nobody waits for the sequence any more.
    async fn abort(&mut self) -> Outcome {
        tracing::info!("the light sequence is aborted: nobody waits for it any more");
        self.activity.end();
        self.pending.forget_sequence();
        self.off(None).await
    }

    async fn send(&mut self, command: Command, purpose: Purpose) -> Result<u8, LinkError> {
        let sent = self.line.send(&command).await?;
        self.pending.push(sent, purpose);
        Ok(sent.number)
    }

    /// The sequence under way, if there is one, is void.
    fn fail_run(&mut self, reason: &str) {
        if let Activity::Sequence(_) = self.activity
            && let Activity::Sequence(run) = self.activity.end()
        {
            self.pending.forget_sequence();
            self.tell();
            self.fault(&run.fail(reason));
        }
    }

    // ---- what time brings ----

    fn next_deadline(&self) -> Instant {
        let reply = self.pending.oldest().map(|sent_at| sent_at + REPLY_PATIENCE);
        let silence = self.pending.waiting_since().map(|since| since + SILENCE);
        [reply, silence, self.activity.deadline()]
            .into_iter()
            .flatten()
            .fold(self.next_ping, Instant::min)
    }

    async fn tick(&mut self) -> Outcome {
        let now = Instant::now();
        if self.pending.waiting_since().is_some_and(|since| since + SILENCE <= now) {
            return Err(LinkError::Silent {
                port: self.line.port().to_owned(),
            });
        }
        let late = now.checked_sub(REPLY_PATIENCE).unwrap_or(now);
        for pending in self.pending.take_sent_before(late) {
            // A link that may be lost is asked more often.
            self.next_ping = now;
            self.repeat(pending, "it was not acknowledged").await?;
        }
        if self.activity.deadline().is_some_and(|deadline| deadline <= now) {
            self.fail_run("its end was not reported");
            self.activity.end();
            self.off(None).await?;
        }
        if self.next_ping <= now {
            self.send(Command::Ping, Purpose::Ping).await?;
            self.next_ping = now + self.ping_interval();
        }
        Ok(None)
    }

    /// A command that may not have arrived is sent again. A sequence is not: it may run, and the cameras would see the
    /// triggers twice.
    async fn repeat(&mut self, pending: Pending, why: &str) -> Result<(), LinkError> {
        match pending.purpose {
            Purpose::Ping => {}
            Purpose::Sequence => {
                self.fail_run(why);
                self.off(None).await?;
            }
            // Something newer runs, which the firmware would not have taken if it had not heard the OFF.
            Purpose::Off { ends, reply } if self.activity.number().is_some_and(|number| Some(number) != ends) => {
                reply.map(|reply| reply.send(Ok(())));
            }
            Purpose::Off { .. } => drop(self.send(Command::Off, pending.purpose).await?),
            Purpose::Set { light, .. } => drop(self.send(light.command(), pending.purpose).await?),
        }
        Ok(())
    }

    fn ping_interval(&mut self) -> Duration {
        if self.pings_to_learn_from > 0 {
            self.pings_to_learn_from -= 1;
            return PING_WHILE_LEARNING;
        }
        match self.activity {
            Activity::Idle if self.lit == Panels::NONE => PING_WHILE_IDLE,
            _ => PING_WHILE_LIT,
        }
    }

    // ---- the end ----

    async fn close(&mut self) -> Result<End, LinkError> {
        self.off(None).await?;
        let acknowledged = async {
            while self.pending.has_off() {
                let arrived = self.line.receive().await?;
                if self.take(&arrived).await?.is_some() {
                    break;
                }
            }
            Ok(End::Closed)
        };
        let closed = tokio::time::timeout(CLOSE_PATIENCE, acknowledged).await;
        // Its watchdog has the lights off soon.
        closed.unwrap_or(Ok(End::Closed))
    }

    // ---- what is told ----

    fn fault(&self, error: &LightError) {
        tracing::warn!(%error, "a light sequence failed");
        self.shared.fault(error.to_string());
    }

    /// To be called before anybody is answered, so that whoever has an answer sees a state that fits it.
    fn tell(&self) {
        let on = match &self.activity {
            Activity::Idle => PanelSet::NONE,
            _ => panel_set(self.lit),
        };
        let link = LightLink::Connected {
            port: self.line.port().to_owned(),
            firmware_version: self.firmware_version.clone(),
            clock_uncertainty: self.clock.uncertainty(),
        };
        let mode = self.activity.mode();
        self.shared.tell(LightBankState { link, mode, on });
    }
}
