//! A conversation with a controller that was greeted. The only place that decides on the controller's mode.

mod running;
mod watched;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{ArmCondition, ArmError, ArmLink, StreamFault};
use futures::FutureExt;
use futures::future::BoxFuture;
use tokio::sync::mpsc::UnboundedReceiver;
use tokio::sync::watch;
use tokio_util::task::AbortOnDropHandle;
use xarm_protocol::{ReportKind, Request, State, StateCommand};

use crate::config::XArmConfig;
use crate::control::ControlTask;
use crate::error::LinkError;
use crate::faults::KnownError;
use crate::greeting::Link;
use crate::job::Job;
use crate::motion::Conversation;
use crate::observed::{Motion, Observed};
use crate::reports::{self, Source};
use crate::shared::Shared;
use crate::stream_end::End;
use running::{Done, Running, answer};
use watched::{Verdict, WatchedStream};

const CLOSE_PATIENCE: Duration = Duration::from_millis(300);

pub(crate) struct Session<'a> {
    config: &'a XArmConfig,
    shared: &'a Shared,
    link: Link,
    task: ControlTask,
    observed: watch::Receiver<Observed>,
    /// Dropped with the session.
    _reports: [AbortOnDropHandle<()>; 2],
    stream: Option<WatchedStream>,
    running: Running,
    waiting: VecDeque<Job>,
    /// What was told last, and when.
    error: (KnownError, Instant),
    inquiry: Option<BoxFuture<'static, Result<KnownError, LinkError>>>,
    next_inquiry: Instant,
    last_state: Option<State>,
}

impl<'a> Session<'a> {
    pub(crate) fn new(config: &'a XArmConfig, link: Link, task: ControlTask, shared: &'a Arc<Shared>) -> Self {
        let (sender, observed) = watch::channel(Observed::nothing());
        let follow =
            |source| AbortOnDropHandle::new(tokio::spawn(reports::follow(source, sender.clone(), shared.clone())));
        let reports = sources(config).map(follow);
        let identity = &link.identity;
        tracing::info!(firmware = %identity.firmware, serial = identity.arm_serial, "arm connected");
        shared.connect(link.clone());
        let now = Instant::now();
        let session = Self {
            config,
            shared,
            link,
            task,
            observed,
            _reports: reports,
            stream: None,
            running: Running::Nothing,
            waiting: VecDeque::new(),
            error: (KnownError::NONE, now),
            inquiry: None,
            next_inquiry: now,
            last_state: None,
        };
        session.tell();
        session
    }

    /// Until the controller is lost or the arm is dropped. Whoever waits for an answer gets one.
    pub(crate) async fn run(mut self, jobs: &mut UnboundedReceiver<Job>) -> Result<(), LinkError> {
        let end = self.serve(jobs).await;
        let reason = match &end {
            Ok(()) => "the driver was closed".to_owned(),
            Err(error) => error.to_string(),
        };
        self.end_stream(End::Fault(StreamFault::Disconnected), &reason);
        self.shared.disconnect(reason.clone());
        self.running.cancel(ArmError::Disconnected { reason: reason.clone() });
        for job in self.waiting.drain(..) {
            job.fail(ArmError::Disconnected { reason: reason.clone() });
        }
        end
    }

    async fn serve(&mut self, jobs: &mut UnboundedReceiver<Job>) -> Result<(), LinkError> {
        loop {
            let until = self.next_inquiry.into();
            tokio::select! {
                lost = &mut self.task => return Err(lost.unwrap_or_else(|error| self.died(&error))),
                job = jobs.recv() => match job {
                    Some(job) => self.take(job),
                    None => return self.close().await,
                },
                done = self.running.done() => self.finish(done),
                changed = self.observed.changed() => match changed {
                    Ok(()) => self.follow_reports(),
                    Err(_) => return Err(self.died(&"the reports' tasks ended")),
                },
                answer = wait(&mut self.inquiry) => self.learn(answer?),
                () = tokio::time::sleep_until(until), if self.inquiry.is_none() => self.inquire(),
            }
            self.start_waiting();
            self.tell();
        }
    }

    fn died(&self, error: &dyn std::fmt::Display) -> LinkError {
        LinkError::Lost {
            address: self.link.control.address().to_owned(),
            reason: error.to_string(),
        }
    }

    // ---- what is asked ----

    /// A stop comes before everything else, and ends what would move the arm.
    fn take(&mut self, job: Job) {
        if !matches!(job, Job::Stop { .. }) {
            return self.waiting.push_back(job);
        }
        let stopped = || ArmError::Refused {
            reason: "the arm was stopped meanwhile".to_owned(),
        };
        self.end_stream(End::Fault(StreamFault::NotReady), "the arm was stopped");
        self.running.cancel_unless_stopping(stopped());
        let (stops, others): (VecDeque<_>, VecDeque<_>) = std::mem::take(&mut self.waiting)
            .into_iter()
            .partition(|job| matches!(job, Job::Stop { .. }));
        for job in others {
            job.fail(stopped());
        }
        self.waiting = stops;
        self.waiting.push_back(job);
    }

    fn start_waiting(&mut self) {
        if !self.running.is_idle() {
            return;
        }
        let Some(job) = self.waiting.pop_front() else { return };
        let conversation = self.conversation();
        if matches!(job, Job::Arm { .. } | Job::Recover { .. }) {
            self.end_stream(End::Fault(StreamFault::NotReady), "the arm is armed or recovered anew");
        }
        self.running = Running::start(job, conversation);
    }

    fn finish(&mut self, done: Done) {
        match done {
            Done::Arm(Ok(stream), reply) => {
                self.stream = Some(WatchedStream::new(stream.end().clone()));
                self.shared.count(|statistics| statistics.streams += 1);
                self.tell();
                // A stream that nobody takes is dropped, and so ends.
                answer(reply, Ok(stream));
            }
            Done::Arm(Err(error), reply) => {
                tracing::warn!(%error, "the arm was not armed");
                answer(reply, Err(error));
            }
            Done::Stop(result, reply) => {
                self.note("stop", &result);
                answer(reply, result);
            }
            Done::Recover(result, reply) => {
                if result.is_ok() {
                    self.error = (KnownError::NONE, Instant::now());
                }
                self.note("recovery", &result);
                answer(reply, result);
            }
        }
        self.inquire();
    }

    fn note(&self, what: &str, result: &Result<(), ArmError>) {
        match result {
            Ok(()) => tracing::info!("the {what} of the arm is done"),
            Err(error) => tracing::warn!(%error, "the {what} of the arm failed"),
        }
        self.tell();
    }

    fn conversation(&self) -> Conversation {
        Conversation {
            link: self.link.clone(),
            observed: self.observed.clone(),
            timeouts: self.config.timeouts,
        }
    }

    // ---- what the controller says ----

    fn inquire(&mut self) {
        let conversation = self.conversation();
        self.inquiry = Some(async move { conversation.ask_error().await }.boxed());
        self.next_inquiry = Instant::now() + self.config.timeouts.keep_alive;
    }

    fn learn(&mut self, error: KnownError) {
        self.inquiry = None;
        self.set_error(error, Instant::now());
        if let Some(stream) = &mut self.stream {
            stream.answered();
        }
    }

    fn set_error(&mut self, error: KnownError, at: Instant) {
        if error.code != self.error.0.code
            && let Some(fault) = error.fault()
        {
            tracing::warn!(code = fault.code, fault.description, "the arm has a fault");
            self.shared
                .count(|statistics| statistics.last_fault = Some(format!("{}: {}", fault.code, fault.description)));
        }
        self.error = (error, at);
    }

    fn follow_reports(&mut self) {
        let observed = self.observed.borrow_and_update().clone();
        if let Ok(health) = &observed.health
            && health.received_at > self.error.1
        {
            self.set_error(health.error, health.received_at);
        }
        let state = observed.motion.as_ref().ok().map(|motion| motion.state);
        if std::mem::replace(&mut self.last_state, state) != state && state == Some(State::Stopped) {
            // The error that may be behind it is reported 20 times less often.
            self.inquire();
        }
        let Some(stream) = &mut self.stream else { return };
        match stream.judge(&observed, self.error.0) {
            Verdict::Lives => {}
            Verdict::Doubtful => self.inquire(),
            Verdict::Ended(end, reason) => self.end_stream(end, &reason),
        }
    }

    /// What ended through no doing of the controller leaves an arm that would go on if it could: it is stopped.
    fn end_stream(&mut self, end: End, reason: &str) {
        let Some(stream) = self.stream.take() else { return };
        let end = stream.end(end);
        tracing::info!(reason, ?end, "the stream of set-points ended");
        self.shared
            .count(|statistics| statistics.last_stream_end = Some(reason.to_owned()));
        let stop = matches!(
            end,
            End::Fault(StreamFault::Disconnected | StreamFault::Refused | StreamFault::Silent)
        );
        // An arm that another client has taken is left to it.
        let follows = self.observed.borrow().motion.as_ref().map_or(true, Motion::follows);
        if stop && follows && self.running.is_idle() {
            self.running = Running::stop(self.conversation(), None);
        }
    }

    // ---- the end ----

    async fn close(&mut self) -> Result<(), LinkError> {
        if self.stream.is_some() {
            self.end_stream(End::Fault(StreamFault::NotReady), "the driver was closed");
            let request = Request::SetState(StateCommand::Decelerate);
            // Without its set-points the arm stands anyway.
            let _ = self.link.control.ask_now("stop", request, CLOSE_PATIENCE).await;
        }
        Ok(())
    }

    // ---- what is told ----

    /// To be called before anybody is answered, so that whoever has an answer sees a state that fits it.
    fn tell(&self) {
        let observed = self.observed.borrow();
        let link = match observed.both() {
            Ok(_) => ArmLink::Connected {
                address: self.link.control.address().to_owned(),
                firmware_version: self.link.identity.firmware.to_string(),
                serial_number: self.link.identity.arm_serial.clone(),
            },
            Err(reason) => ArmLink::Disconnected {
                reason: reason.to_owned(),
            },
        };
        // What is wrong is told when it is known, a report later.
        let is_doubtful = self.stream.as_ref().is_some_and(WatchedStream::is_doubtful);
        let condition = (!is_doubtful).then(|| self.condition(&observed));
        self.shared.tell(link, condition, observed.reading());
    }

    fn condition(&self, observed: &Observed) -> ArmCondition {
        let Ok((motion, health)) = observed.both() else {
            return ArmCondition::Unknown;
        };
        if let Some(fault) = self.error.0.fault() {
            return ArmCondition::Fault(fault);
        }
        match motion.state {
            State::Moving | State::Decelerating => ArmCondition::Moving,
            State::Stopped | State::Paused => ArmCondition::Stopped,
            State::Ready if self.stream.is_some() && health.is_enabled() && motion.follows() => ArmCondition::Armed,
            State::Ready | State::Changed => ArmCondition::Disarmed,
        }
    }
}

fn sources(config: &XArmConfig) -> [Source; 2] {
    let source = |kind, port, patience| Source {
        kind,
        address: format!("{}:{port}", config.host),
        connect_patience: config.timeouts.connect,
        patience,
    };
    [
        source(
            ReportKind::Real,
            config.real_time_report_port,
            config.timeouts.real_time_report,
        ),
        source(ReportKind::Rich, config.rich_report_port, config.timeouts.rich_report),
    ]
}

async fn wait<T>(work: &mut Option<BoxFuture<'static, T>>) -> T {
    match work {
        Some(work) => work.await,
        None => std::future::pending().await,
    }
}
