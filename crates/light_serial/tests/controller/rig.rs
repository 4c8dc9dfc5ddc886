//! A board and a driver that is connected to it.

use std::sync::Arc;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use devices::{Channel, LightBank, LightBankState, LightLink, LightSequence, LightStep};
use light_serial::{LightController, LightSerialConfig};
use parking_lot::Mutex;
use sim::SimError;
use sim::board::{BoardConfig, BoardError, Edge, LightBoard, Pin};

pub(crate) const PATIENCE: Duration = Duration::from_secs(10);
pub(crate) const ON_TIME: Duration = Duration::from_micros(2500);
pub(crate) const GAP: Duration = Duration::from_micros(500);
pub(crate) const TRIGGER_DELAY: Duration = Duration::from_micros(300);

pub(crate) struct Rig {
    pub(crate) lights: LightController,
    pub(crate) board: Board,
}

/// A board whose edges are kept.
pub(crate) struct Board {
    pub(crate) simulated: LightBoard,
    edges: Arc<Mutex<Vec<Edge>>>,
    news: mpsc::Receiver<Edge>,
}

impl Board {
    /// None, and a loud word, where the board's tools are not installed.
    pub(crate) fn start(config: &BoardConfig) -> Option<Self> {
        let edges = Arc::new(Mutex::new(Vec::new()));
        let (sender, news) = mpsc::channel();
        let kept = Arc::clone(&edges);
        let started = LightBoard::start(config, move |edge| {
            kept.lock().push(edge);
            // Nobody listens at the end of a test.
            let _ = sender.send(edge);
        });
        match started {
            Ok(simulated) => Some(Self { simulated, edges, news }),
            Err(SimError::Board(error @ BoardError::NotBuilt { .. })) => {
                println!("SKIPPED: {error} (cargo xtask setup)");
                None
            }
            Err(error) => panic!("{error}"),
        }
    }

    /// Every edge so far.
    pub(crate) fn edges(&self) -> Vec<Edge> {
        assert!(
            self.simulated.wait_until(Instant::now(), PATIENCE),
            "the board keeps up"
        );
        self.edges.lock().clone()
    }

    pub(crate) fn forget_edges(&self) {
        self.edges();
        self.edges.lock().clear();
        while self.news.try_recv().is_ok() {}
    }

    /// Waits until an output changes to this level.
    pub(crate) fn wait_for_edge(&self, pin: Pin, high: bool) -> Edge {
        let deadline = Instant::now() + PATIENCE;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let edge = self.news.recv_timeout(left).expect("the edge comes");
            if edge.pin == pin && edge.high == high {
                return edge;
            }
        }
    }

    pub(crate) fn is_dark(&self) -> bool {
        let edges = self.edges();
        let lit = |number: &u8| {
            let last = edges.iter().rfind(|edge| edge.pin == Pin::Panel(*number));
            last.is_some_and(|edge| edge.high)
        };
        (1..=7).find(lit).is_none()
    }

    /// Waits until every panel is off, at most as long as the firmware's watchdog and a little more.
    pub(crate) fn goes_dark(&self) {
        let deadline = Instant::now() + Duration::from_millis(1500);
        while !self.is_dark() {
            assert!(Instant::now() < deadline, "the lights stay on");
            assert!(
                self.simulated
                    .wait_until(Instant::now() + Duration::from_millis(5), PATIENCE)
            );
        }
    }
}

impl Rig {
    /// Connected; none where the board's tools are not installed.
    pub(crate) async fn start() -> Option<Self> {
        Self::with_board(Board::start(&BoardConfig::default())?).await
    }

    pub(crate) async fn with_board(board: Board) -> Option<Self> {
        let lights = LightController::open(LightSerialConfig::new(board.simulated.port()));
        let rig = Self { lights, board };
        rig.connected().await;
        Some(rig)
    }

    pub(crate) async fn connected(&self) -> LightBankState {
        self.state("a link", |state| matches!(state.link, LightLink::Connected { .. }))
            .await
    }

    pub(crate) async fn state(&self, what: &str, wanted: impl FnMut(&LightBankState) -> bool) -> LightBankState {
        wait_for(&self.lights, what, wanted).await
    }
}

pub(crate) async fn wait_for(
    lights: &LightController,
    what: &str,
    wanted: impl FnMut(&LightBankState) -> bool,
) -> LightBankState {
    let mut state = lights.state();
    let found = tokio::time::timeout(PATIENCE, state.wait_for(wanted)).await;
    match found {
        Ok(Ok(state)) => state.clone(),
        _ => panic!("{what} does not come; the state is {:?}", lights.state().borrow()),
    }
}

/// Why there is no link.
pub(crate) async fn disconnected(lights: &LightController, text: &str) -> String {
    let state = wait_for(
        lights,
        text,
        |state| matches!(&state.link, LightLink::Disconnected { reason } if reason.contains(text)),
    );
    match state.await.link {
        LightLink::Disconnected { reason } => reason,
        LightLink::Connected { .. } => unreachable!("it was waited for"),
    }
}

/// Dark, then L1..L7.
pub(crate) fn capture() -> LightSequence {
    sequence(ON_TIME, GAP)
}

pub(crate) fn sequence(on_time: Duration, gap: Duration) -> LightSequence {
    LightSequence {
        steps: Channel::all()
            .map(|channel| LightStep { channel, on_time, gap })
            .collect(),
        trigger_delay: TRIGGER_DELAY,
        trigger_width: Duration::from_micros(500),
    }
}

/// Of one pin, in order: times of rising and falling edges, as instant and as cycle.
pub(crate) fn pulses(edges: &[Edge], pin: Pin) -> Vec<(Edge, Edge)> {
    let of_pin: Vec<Edge> = edges.iter().filter(|edge| edge.pin == pin).copied().collect();
    of_pin
        .chunks_exact(2)
        .map(|pair| {
            assert!(pair[0].high && !pair[1].high);
            (pair[0], pair[1])
        })
        .collect()
}

pub(crate) fn micros_between(one: Instant, other: Instant) -> f64 {
    let apart = one.max(other) - one.min(other);
    apart.as_secs_f64() * 1e6
}
