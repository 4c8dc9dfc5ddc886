//! The node's time: the system's, or what `/clock` says while `use_sim_time` is true.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use interfaces::builtin_interfaces::msg::Time;
use interfaces::rosgraph_msgs::msg::Clock as ClockMessage;
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;

use crate::error::Error;
use crate::graph::Graph;
use crate::parameters::{Parameter, ParameterHandle, Parameters};
use crate::qos::Qos;
use crate::subscription::Subscription;

/// A sleep by system time looks again this often, in case that the system's clock was set.
const LONGEST_SLEEP: Duration = Duration::from_secs(1);

/// Jumps that are kept for those who have not looked yet.
const JUMPS_KEPT: usize = 16;

/// A node's clock. Clones show the same time.
#[derive(Clone)]
pub struct Clock {
    inner: Arc<Inner>,
}

struct Inner {
    source: watch::Sender<Source>,
    jumps: tokio::sync::broadcast::Sender<Jump>,
}

/// Where time comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    System,
    /// The last `/clock`, in nanoseconds; `None` before the first.
    Simulated(Option<i64>),
}

/// Time went back, because a bag started again, or it comes from another source now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jump {
    /// Nanoseconds before the jump.
    pub from: i64,
    /// Nanoseconds after it.
    pub to: i64,
}

/// Why [`Clock::sleep_until`] ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Woken {
    /// The time has come.
    Reached,
    /// Time went back, or comes from elsewhere now: what the wait was for no longer holds.
    Jumped,
}

impl Default for Clock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock {
    /// A clock that shows system time.
    pub fn new() -> Self {
        let inner = Inner {
            source: watch::Sender::new(Source::System),
            jumps: tokio::sync::broadcast::Sender::new(JUMPS_KEPT),
        };
        Self { inner: Arc::new(inner) }
    }

    /// Nanoseconds since 1970 or, in simulated time, since whatever its publisher counts from; 0 before the first
    /// `/clock`.
    pub fn now_nanos(&self) -> i64 {
        self.inner.source.borrow().now()
    }

    /// [`Self::now_nanos`] as a stamp.
    pub fn now(&self) -> Time {
        // From 2038 on the stamp's 32 bits of seconds are full, whatever is done here.
        Time::from_nanos(self.now_nanos()).unwrap_or(Time {
            sec: i32::MAX,
            nanosec: 0,
        })
    }

    /// Whether there is a time: false while time is simulated and nobody has said it yet.
    pub fn is_ready(&self) -> bool {
        *self.inner.source.borrow() != Source::Simulated(None)
    }

    /// Whether time comes from `/clock`.
    pub fn is_simulated(&self) -> bool {
        matches!(*self.inner.source.borrow(), Source::Simulated(_))
    }

    /// Waits until [`Self::is_ready`].
    pub async fn wait_until_ready(&self) {
        let mut source = self.inner.source.subscribe();
        // The sender lives in this clock.
        let _ = source.wait_for(|source| *source != Source::Simulated(None)).await;
    }

    /// Sleeps until this clock shows `deadline` (nanoseconds) or jumps. Cancel safe.
    pub async fn sleep_until(&self, deadline: i64) -> Woken {
        let mut source = self.inner.source.subscribe();
        let mut last = *source.borrow_and_update();
        loop {
            if last.is_ready() && last.now() >= deadline {
                return Woken::Reached;
            }
            let _ = tokio::time::timeout(last.patience(deadline), source.changed()).await;
            let current = *source.borrow_and_update();
            if last.jumps_to(current).is_some() {
                return Woken::Jumped;
            }
            last = current;
        }
    }

    /// Sleeps for `duration` of this clock's time, or until it jumps.
    pub async fn sleep(&self, duration: Duration) -> Woken {
        self.wait_until_ready().await;
        let nanos = i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX);
        self.sleep_until(self.now_nanos().saturating_add(nanos)).await
    }

    /// Tells of every jump from now on.
    pub fn jumps(&self) -> Jumps {
        Jumps {
            receiver: self.inner.jumps.subscribe(),
        }
    }

    /// Uses what `/clock` says, or the system's time.
    fn simulate(&self, simulated: bool) {
        if simulated != self.is_simulated() {
            self.replace(if simulated {
                Source::Simulated(None)
            } else {
                Source::System
            });
        }
    }

    /// A `/clock` message has come.
    fn tell(&self, nanos: i64) {
        if self.is_simulated() {
            self.replace(Source::Simulated(Some(nanos)));
        }
    }

    fn replace(&self, next: Source) {
        let previous = self.inner.source.send_replace(next);
        if let Some(jump) = previous.jumps_to(next) {
            tracing::info!(from = jump.from, to = jump.to, "time jumped");
            // Nobody may be listening.
            let _ = self.inner.jumps.send(jump);
        }
    }
}

impl Source {
    fn now(self) -> i64 {
        match self {
            Self::System => system_nanos(),
            Self::Simulated(nanos) => nanos.unwrap_or(0),
        }
    }

    fn is_ready(self) -> bool {
        self != Self::Simulated(None)
    }

    /// Before its first message, simulated time has no place to jump from or to.
    fn jumps_to(self, next: Self) -> Option<Jump> {
        let jump = Some(Jump {
            from: self.now(),
            to: next.now(),
        });
        match (self, next) {
            (Self::Simulated(Some(from)), Self::Simulated(Some(to))) if to < from => jump,
            (Self::System, Self::Simulated(_)) | (Self::Simulated(_), Self::System) => jump,
            _ => None,
        }
    }

    /// How long to sleep before it is worth looking at the clock again.
    fn patience(self, deadline: i64) -> Duration {
        match self {
            Self::System => {
                Duration::from_nanos(deadline.saturating_sub(system_nanos()).max(0) as u64).min(LONGEST_SLEEP)
            }
            // Only a message moves simulated time.
            Self::Simulated(_) => Duration::MAX,
        }
    }
}

fn system_nanos() -> i64 {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX)
}

/// A queue of jumps; see [`Clock::jumps`].
pub struct Jumps {
    receiver: tokio::sync::broadcast::Receiver<Jump>,
}

impl Jumps {
    /// The next jump; `None` once the clock is gone. Cancel safe.
    pub async fn next(&mut self) -> Option<Jump> {
        use tokio::sync::broadcast::error::RecvError;
        loop {
            match self.receiver.recv().await {
                Ok(jump) => return Some(jump),
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return None,
            }
        }
    }
}

/// Declares `use_sim_time`, as every ROS node does.
pub(crate) fn declare_use_sim_time(parameters: &Parameters, clock: &Clock) -> Result<ParameterHandle<bool>, Error> {
    let parameter = Parameter::bool("use_sim_time", false).describe("Take time from /clock instead of the system");
    let handle = parameters.declare(parameter)?;
    clock.simulate(handle.get());
    Ok(handle)
}

/// What is needed to subscribe to `/clock`. Not the node itself: the task would keep it alive for ever.
pub(crate) struct ClockTopic {
    pub(crate) graph: Arc<Graph>,
    /// Fully qualified and remapped.
    pub(crate) name: String,
    pub(crate) stop: CancellationToken,
}

/// Follows `use_sim_time`, and `/clock` while it is true.
pub(crate) async fn follow(clock: Clock, topic: ClockTopic, mut use_sim_time: ParameterHandle<bool>) {
    let mut simulated = use_sim_time.get();
    loop {
        clock.simulate(simulated);
        tokio::select! {
            () = topic.stop.cancelled() => return,
            () = feed(&clock, &topic), if simulated => return,
            changed = use_sim_time.changed() => simulated = changed,
        }
    }
}

/// Ends with the node, or when there can be no subscription.
async fn feed(clock: &Clock, topic: &ClockTopic) {
    let name = topic.name.clone();
    match Subscription::<ClockMessage>::new(&topic.graph, name, Qos::SENSOR, topic.stop.clone()) {
        Ok(mut subscription) => {
            while let Some(received) = subscription.next().await {
                clock.tell(received.message.clock.to_nanos());
            }
        }
        Err(error) => tracing::error!(%error, "simulated time stands still"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn simulated(nanos: i64) -> Clock {
        let clock = Clock::new();
        clock.simulate(true);
        clock.tell(nanos);
        clock
    }

    #[test]
    fn simulated_time_is_zero_and_not_ready_before_the_first_message() {
        let clock = Clock::new();
        assert!(clock.is_ready() && !clock.is_simulated() && clock.now_nanos() > 0);
        clock.tell(5);
        assert_ne!(clock.now_nanos(), 5);
        clock.simulate(true);
        assert!(!clock.is_ready());
        assert_eq!(clock.now(), Time::default());
        clock.tell(1_500_000_000);
        assert!(clock.is_ready());
        assert_eq!(
            clock.now(),
            Time {
                sec: 1,
                nanosec: 500_000_000
            }
        );
        clock.simulate(false);
        assert!(clock.is_ready() && clock.now_nanos() > 1_500_000_000);
    }

    #[tokio::test]
    async fn a_sleep_in_simulated_time_ends_when_the_clock_says_so() {
        let clock = simulated(1000);
        let sleeper = tokio::spawn({
            let clock = clock.clone();
            async move { clock.sleep_until(3000).await }
        });
        let mut sources = clock.inner.source.subscribe();
        for nanos in [2000, 2999, 3000] {
            while clock.inner.source.receiver_count() < 2 && !sleeper.is_finished() {
                tokio::task::yield_now().await;
            }
            assert!(!sleeper.is_finished());
            clock.tell(nanos);
            sources.changed().await.unwrap();
        }
        assert_eq!(sleeper.await.unwrap(), Woken::Reached);
    }

    #[tokio::test]
    async fn a_jump_back_wakes_sleepers_and_is_told() {
        let clock = simulated(1000);
        let mut jumps = clock.jumps();
        let tell = async { clock.tell(400) };
        let (woken, ()) = tokio::join!(clock.sleep_until(3000), tell);
        assert_eq!(woken, Woken::Jumped);
        assert_eq!(jumps.next().await, Some(Jump { from: 1000, to: 400 }));
    }

    #[tokio::test]
    async fn another_time_source_is_a_jump() {
        let clock = Clock::new();
        let mut jumps = clock.jumps();
        let deadline = clock.now_nanos() + 3_600_000_000_000;
        let (woken, ()) = tokio::join!(clock.sleep_until(deadline), async { clock.simulate(true) });
        assert_eq!(woken, Woken::Jumped);
        assert_eq!(jumps.next().await.unwrap().to, 0);
    }

    #[tokio::test]
    async fn a_sleep_in_system_time_ends() {
        let clock = Clock::new();
        let deadline = clock.now_nanos() + 2_000_000;
        assert_eq!(clock.sleep_until(deadline).await, Woken::Reached);
        assert!(clock.now_nanos() >= deadline);
    }
}
