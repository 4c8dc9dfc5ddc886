//! The simulated xArm7: the vendor's controller behind its real TCP protocol, and the arm that it moves.
//!
//! Modes 0, 1, 4 and 5 move the arm at 250 Hz within its limits; errors, recovery, the tool board and the vacuum gripper
//! behave as the hardware's. What goes wrong on demand is in [`ArmController`]'s methods.
//!
//! ```
//! use sim::arm::{ArmConfig, ArmController};
//!
//! let arm = ArmController::start(ArmConfig::default())?;
//! println!("control port: {}", arm.ports().control);
//! arm.raise_error(31);
//! assert_eq!(arm.moment().error, 31);
//! # Ok::<(), sim::arm::ArmError>(())
//! ```

use std::net::Ipv4Addr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use geometry::RigidTransform;
use parking_lot::Mutex;
use xarm_protocol::{Mode, Reply, Request, State};

mod answer;
mod clients;
mod collision;
mod config;
mod core;
mod dynamics;
mod error;
mod faults;
mod model;
mod motion;
mod planner;
mod ports;
mod profile;
mod queries;
mod report;
mod segment;
mod servo;
mod set;
mod settings;
mod shared;
mod states;
mod task;
mod tool;
mod trace;
mod units;
mod velocity;
mod wire;

pub use config::{ArmConfig, ArmPorts, SuctionWorld};
pub use error::ArmError;
pub use faults::ArmFaults;
pub use trace::ServoPoint;

use self::core::Core;
use clients::Clients;
use faults::FaultBox;
use model::ArmModel;
use ports::Doors;
use shared::Shared;

/// The nominal arm: links, joints, collision shapes.
pub(crate) fn nominal_robot() -> Result<urdf_rs::Robot, ArmError> {
    model::read_urdf()
}

/// `base_from_flange` of an arm when it is switched on.
pub(crate) fn flange_of(config: &ArmConfig) -> Result<RigidTransform, ArmError> {
    Ok(ArmModel::new(config)?.flange(&config.joints))
}

/// Joint angles (radians) that hold the flange at a pose, near those of the configuration.
pub(crate) fn joints_for(config: &ArmConfig, base_from_flange: &RigidTransform) -> Result<[f64; 7], ArmError> {
    Ok(ArmModel::new(config)?.reach(base_from_flange, &config.joints)?)
}

/// Seconds from one step of the controller to the next.
const STEP: f64 = 0.004;
const PERIOD: Duration = Duration::from_millis(4);
/// A clock that is late makes up for it, unless by more.
const MOST_LATE: Duration = Duration::from_millis(200);

/// Buttons that stop the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EmergencyStop {
    /// On the control box: error 1.
    Button,
    /// The box's emergency input: error 2.
    Input,
}

/// The arm at a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmMoment {
    /// Of the joints, radians.
    pub joints: [f64; 7],
    /// Of the joints, rad/s.
    pub velocities: [f64; 7],
    /// By the arm's own dimensions.
    pub base_from_flange: RigidTransform,
    /// What is done with commands.
    pub mode: Mode,
    /// As clients are told.
    pub state: State,
    /// 0 for none.
    pub error: u8,
    /// 0 for none.
    pub warning: u8,
    /// Kilograms that the cup holds.
    pub held: Option<f64>,
    /// Whether its pump runs.
    pub vacuum: bool,
    /// Since the start, microseconds of the controller's clock.
    pub micros: u64,
}

/// A running controller with its arm. Dropping it ends all of its threads and connections.
pub struct ArmController {
    shared: Arc<Shared>,
    address: Ipv4Addr,
    ports: ArmPorts,
    threads: Vec<JoinHandle<()>>,
}

impl ArmController {
    /// Switches an arm on: motors off, no error, state 4.
    pub fn start(config: ArmConfig) -> Result<Self, ArmError> {
        Self::start_watched(config, |_| {})
    }

    /// The same; `watcher` is shown the arm after every step and must not block.
    pub fn start_watched(
        config: ArmConfig,
        watcher: impl FnMut(&ArmMoment) + Send + 'static,
    ) -> Result<Self, ArmError> {
        let (doors, ports) = Doors::open(&config, config.ports)?;
        let address = config.address;
        let shared = Arc::new(Shared {
            core: Mutex::new(Core::new(config)?),
            clients: Clients::default(),
            faults: FaultBox::default(),
            doors: Mutex::new(Some(doors)),
            ended: AtomicBool::new(false),
            delivering: Mutex::new(()),
        });
        let (first, second) = (Arc::clone(&shared), Arc::clone(&shared));
        let threads = vec![
            std::thread::spawn(move || step_on(&first, watcher)),
            std::thread::spawn(move || ports::run(&second)),
        ];
        Ok(Self {
            shared,
            address,
            ports,
            threads,
        })
    }

    /// Where it is on the network.
    pub fn address(&self) -> Ipv4Addr {
        self.address
    }

    /// The ports that it listens to.
    pub fn ports(&self) -> ArmPorts {
        self.ports
    }

    /// The arm as it is now.
    pub fn moment(&self) -> ArmMoment {
        self.shared.core.lock().moment()
    }

    /// Clients of the control port.
    pub fn clients(&self) -> usize {
        self.shared.clients.count()
    }

    /// Set-points that came in servo mode since this was asked last, oldest first; of some nine minutes at most.
    pub fn take_servo_trace(&self) -> Vec<ServoPoint> {
        self.shared.core.lock().trace.take()
    }

    /// Does what another client's request would do, for instance taking the mode away.
    pub fn request(&self, request: &Request) -> Reply {
        let reply = self.shared.core.lock().ask(request);
        self.shared.deliver();
        reply
    }

    /// Stops the arm with an error of this number, as [`xarm_protocol::controller_error`] names them.
    pub fn raise_error(&self, code: u8) {
        self.shared.core.lock().fail(code);
        self.shared.deliver();
    }

    /// Leaves a warning of this number.
    pub fn raise_warning(&self, code: u8) {
        self.shared.core.lock().warn(code);
    }

    /// Stops the arm until it is released and its error cleaned.
    pub fn press(&self, stop: EmergencyStop) {
        let code = match stop {
            EmergencyStop::Button => 1,
            EmergencyStop::Input => 2,
        };
        let mut core = self.shared.core.lock();
        core.pressed = Some(code);
        core.fail(code);
        drop(core);
        self.shared.deliver();
    }

    /// From now on the error can be cleaned.
    pub fn release(&self) {
        self.shared.core.lock().pressed = None;
    }

    /// What is held falls.
    pub fn lose_object(&self) {
        self.shared.core.lock().tool.lose();
    }

    /// Changes what goes wrong from now on.
    pub fn set_faults(&self, faults: ArmFaults) {
        self.shared.core.lock().tool.never_seals = faults.never_seals;
        self.shared.faults.set(faults);
    }

    /// For so long nothing is read and nothing is sent; then all goes on, and what came meanwhile is handled at once.
    pub fn pause_network(&self, time: Duration) {
        self.shared.faults.pause(time);
    }

    /// The next report has a length that no report has.
    pub fn send_odd_report(&self) {
        self.shared.faults.send_odd_report();
    }

    /// Closes the connections of the control port; clients may come again.
    pub fn drop_clients(&self) {
        self.shared.clients.drop_all();
    }

    /// Switches the controller off: connections and ports are closed, motors off, brakes shut.
    pub fn switch_off(&self) {
        drop(self.shared.doors.lock().take());
        self.shared.core.lock().restart();
        self.shared.faults.pause(Duration::ZERO);
        self.drop_clients();
        self.shared.clients.join();
    }

    /// Switches it on again at the same ports.
    pub fn switch_on(&self) -> Result<(), ArmError> {
        let mut doors = self.shared.doors.lock();
        if doors.is_none() {
            let config = self.shared.core.lock().config.clone();
            *doors = Some(Doors::open(&config, self.ports)?.0);
        }
        Ok(())
    }
}

impl Drop for ArmController {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Release);
        self.shared.faults.end();
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
        // Only now: nobody is let in any more.
        self.shared.clients.drop_all();
        self.shared.clients.join();
    }
}

impl Core {
    fn moment(&self) -> ArmMoment {
        ArmMoment {
            joints: self.angles(),
            velocities: self.joints.map(|joint| joint.velocity),
            base_from_flange: self.base_from_flange(),
            mode: self.mode,
            state: self.reported_state(),
            error: self.error,
            warning: self.warning,
            held: self.tool.held(),
            vacuum: self.tool.is_drawing(),
            micros: self.micros,
        }
    }
}

/// The controller's clock.
fn step_on(shared: &Shared, mut watcher: impl FnMut(&ArmMoment)) {
    let mut due = Instant::now();
    while !shared.has_ended() {
        due += PERIOD;
        let now = Instant::now();
        if now.saturating_duration_since(due) > MOST_LATE {
            due = now;
        }
        std::thread::sleep(due.saturating_duration_since(now));
        let moment = {
            let mut core = shared.core.lock();
            core.step();
            core.moment()
        };
        shared.deliver();
        watcher(&moment);
    }
}
