//! What the stand-ins have in common.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use interfaces::rakelight_msgs::action::MoveToolGoal;
use interfaces::rakelight_msgs::msg::ArmState;
use parking_lot::Mutex;
use tokio::sync::watch;

/// Where captures are taken from, radians.
pub const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

/// How a stand-in meets a request.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Reply {
    /// As it should.
    #[default]
    Well,
    /// With this reason.
    Refuse(String),
    /// Never; a motion goes on until it is cancelled.
    Hang,
}

/// The stand-ins' world. Clones are handles to the same.
#[derive(Clone)]
pub struct World {
    inner: Arc<Mutex<Inner>>,
    changed: Arc<watch::Sender<u64>>,
}

/// What there is.
#[derive(Clone)]
pub struct Inner {
    /// Contacts of objects on the table: x in metres, on the x axis of the base.
    pub objects: Vec<f64>,
    /// Objects in the bin.
    pub binned: usize,
    /// Cameras that do not answer.
    pub gone: Vec<String>,
    /// What the planner says beside its grasps.
    pub note: String,
    /// Grasps are planned, and the arm does not reach them.
    pub out_of_reach: bool,
    /// How often the cup does not seal from now on.
    pub leaks: u32,
    /// The next object falls while the arm carries it to the bin.
    pub drops: bool,
    /// Such as `ArmState::READY`.
    pub mode: u8,
    /// In words.
    pub fault: String,
    /// The pump runs.
    pub pump: bool,
    /// On the cup, whose contact was there.
    pub held: Option<f64>,
    /// Where the arm stands, radians.
    pub joints: [f64; 7],
    /// From a motion's arrival here until it is taken.
    pub acceptance: Duration,
    /// Motions under way.
    pub moving: usize,
    /// Requests so far, by name; motions by leg.
    pub asked: Vec<String>,
    /// Goals of motions that were begun.
    pub motions: Vec<MoveToolGoal>,
    replies: BTreeMap<String, Reply>,
}

impl World {
    /// With objects at these places; the arm is at home and ready.
    pub fn new(objects: &[f64]) -> Self {
        let inner = Inner {
            objects: objects.to_vec(),
            binned: 0,
            gone: Vec::new(),
            note: String::new(),
            out_of_reach: false,
            leaks: 0,
            drops: false,
            mode: ArmState::READY,
            fault: String::new(),
            pump: false,
            held: None,
            joints: HOME,
            acceptance: Duration::ZERO,
            moving: 0,
            asked: Vec::new(),
            motions: Vec::new(),
            replies: BTreeMap::new(),
        };
        Self {
            inner: Arc::new(Mutex::new(inner)),
            changed: Arc::new(watch::Sender::new(0)),
        }
    }

    /// As it is now.
    pub fn look(&self) -> Inner {
        self.inner.lock().clone()
    }

    /// Changes the world, and lets the arm tell of it.
    pub fn change<R>(&self, change: impl FnOnce(&mut Inner) -> R) -> R {
        let result = change(&mut self.inner.lock());
        self.changed.send_modify(|n| *n += 1);
        result
    }

    /// From now on `what` is met so: a service, or a leg of a motion: `pregrasp`, `approach`, `back`, `lift`, `bin`; with
    /// `dry ` before it, its dry run.
    pub fn reply(&self, what: &str, reply: Reply) {
        self.change(|world| world.replies.insert(what.to_owned(), reply));
    }

    /// Everything works again.
    pub fn heal(&self) {
        self.change(|world| world.replies.clear());
    }

    /// Counts a request, and says how it is to be met.
    pub(super) fn asked(&self, what: &str) -> Reply {
        self.change(|world| {
            world.asked.push(what.to_owned());
            world.replies.get(what).cloned().unwrap_or_default()
        })
    }

    /// Wakes after every change.
    pub fn changes(&self) -> watch::Receiver<u64> {
        self.changed.subscribe()
    }
}

impl Inner {
    /// How often that was asked for.
    pub fn count(&self, what: &str) -> usize {
        self.asked.iter().filter(|asked| *asked == what).count()
    }

    pub(super) fn vacuum(&self) -> u8 {
        match (self.pump, self.held) {
            (false, _) => ArmState::VACUUM_OFF,
            (true, None) => ArmState::VACUUM_ON,
            (true, Some(_)) => ArmState::VACUUM_HELD,
        }
    }

    /// What it holds falls: into the bin when the arm is there.
    pub(super) fn let_go(&mut self, over_bin: bool) {
        match self.held.take() {
            Some(_) if over_bin => self.binned += 1,
            Some(at) => self.objects.push(at),
            None => {}
        }
    }
}
