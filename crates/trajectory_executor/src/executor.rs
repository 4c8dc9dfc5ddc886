//! Who may move the arm, and when: every motion of the node goes through here.

mod attend;
mod standing;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use devices::{Arm, ArmCondition, ArmState, JointValues};
use kinematics::ModifiedDh;
use nalgebra::SVector;
use parking_lot::{Mutex, RwLock};
use tokio::sync::{oneshot, watch};
use trajectory::Trajectory;
use xarm_tcp::XArm;

use crate::error::MotionError;
use crate::handling::Handling;
use crate::model::Model;
use crate::servo::{Servo, ServoRemote};

pub(crate) use standing::Standing;

/// A stop from full speed takes less.
const STOP_TIMEOUT: Duration = Duration::from_secs(3);
/// A stream is taken over within a period.
const ENGAGE_TIMEOUT: Duration = Duration::from_secs(1);
/// Between the set-points and the angles that are measured while the arm is held, radians.
const HELD_WITHIN: f64 = 0.02;

type Ending = Result<(), MotionError>;

/// Where the arm's own dimensions come from.
pub(crate) struct Dimensions {
    pub(crate) arm: Arc<XArm>,
    /// Otherwise the nominal ones count.
    pub(crate) is_wanted: bool,
}

impl Dimensions {
    async fn read(&self) -> Result<Option<[ModifiedDh; 7]>, MotionError> {
        if !self.is_wanted {
            return Ok(None);
        }
        let rows = self.arm.calibrated_kinematics().await;
        rows.map(Some).map_err(|error| MotionError::NotReady {
            reason: format!("{error}; parameter calibrated_kinematics = false uses the nominal dimensions"),
        })
    }
}

pub(crate) struct Executor {
    arm: Arc<dyn Arm>,
    dimensions: Dimensions,
    model: RwLock<Arc<Model>>,
    servo: Mutex<Servo>,
    remote: ServoRemote,
    standing: watch::Sender<Standing>,
    /// Who waits for the trajectory that is followed.
    waiting: Mutex<Option<(u64, oneshot::Sender<Ending>)>>,
    engaged: tokio::sync::Notify,
    /// One recovery at a time.
    recovering: tokio::sync::Mutex<()>,
    last_id: AtomicU64,
    state_timeout: Duration,
}

/// A motion that is planned.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    pub(crate) trajectory: Trajectory<7>,
    /// Of the tool, metres per second: what it was planned with.
    pub(crate) speed: f64,
    pub(crate) handling: Handling,
}

/// A motion under way. Dropping it leaves the arm moving.
pub(crate) struct Running {
    pub(crate) began: Instant,
    pub(crate) duration: Duration,
    ended: oneshot::Receiver<Ending>,
}

impl Running {
    /// Waits for the end.
    pub(crate) async fn ended(&mut self) -> Ending {
        (&mut self.ended).await.unwrap_or_else(|_| {
            Err(MotionError::NotReady {
                reason: "the node is being shut down".into(),
            })
        })
    }

    /// 0 to 1, by time.
    pub(crate) fn progress(&self) -> f64 {
        let whole = self.duration.as_secs_f64().max(1e-9);
        (self.began.elapsed().as_secs_f64() / whole).min(1.0)
    }
}

impl Executor {
    pub(crate) fn new(
        arm: Arc<dyn Arm>,
        dimensions: Dimensions,
        model: Model,
        servo: Servo,
        state_timeout: Duration,
    ) -> Self {
        Self {
            remote: servo.remote(),
            servo: Mutex::new(servo),
            arm,
            dimensions,
            model: RwLock::new(Arc::new(model)),
            standing: watch::Sender::new(Standing::Disarmed),
            waiting: Mutex::new(None),
            engaged: tokio::sync::Notify::new(),
            recovering: tokio::sync::Mutex::new(()),
            last_id: AtomicU64::new(0),
            state_timeout,
        }
    }

    pub(crate) fn standing(&self) -> watch::Receiver<Standing> {
        self.standing.subscribe()
    }

    pub(crate) fn arm_state(&self) -> watch::Receiver<ArmState> {
        self.arm.state()
    }

    pub(crate) fn model(&self) -> Arc<Model> {
        Arc::clone(&self.model.read())
    }

    pub(crate) fn remote(&self) -> &ServoRemote {
        &self.remote
    }

    pub(crate) fn realtime_complaint(&self) -> Option<String> {
        self.servo.lock().realtime().complaint()
    }

    /// Where the next motion begins: the set-point that is held.
    pub(crate) fn held_at(&self) -> Result<JointValues, MotionError> {
        self.standing.borrow().require_ready()?;
        let commanded = self.remote.commanded().ok_or_else(|| not_ready("it was never armed"))?;
        let at = commanded.map(|state| state.position);
        self.require_fresh(&at)?;
        Ok(at)
    }

    /// The measured state is new, free of faults, and where the arm was sent.
    fn require_fresh(&self, at: &JointValues) -> Result<(), MotionError> {
        let measured = self.measured()?;
        for (index, (commanded, measured)) in at.iter().zip(&measured).enumerate() {
            if (commanded - measured).abs() > HELD_WITHIN {
                return Err(MotionError::Elsewhere {
                    joint: index + 1,
                    start: *commanded,
                    stands: *measured,
                    tolerance: HELD_WITHIN,
                });
            }
        }
        Ok(())
    }

    /// Checks a trajectory and begins it. Everything is looked at first; nothing moves unless all of it is well.
    pub(crate) fn begin(&self, motion: Motion, start_tolerance: f64) -> Result<Running, MotionError> {
        let at = self.held_at()?;
        let (model, trajectory) = (self.model(), motion.trajectory);
        require_start(&trajectory, &at, start_tolerance)?;
        trajectory.require_rest()?;
        model.planner(motion.speed)?.check(&trajectory)?;
        model.require_free(&trajectory, &motion.handling)?;
        self.start(trajectory)
    }

    fn start(&self, trajectory: Trajectory<7>) -> Result<Running, MotionError> {
        let id = self.last_id.fetch_add(1, Ordering::Relaxed) + 1;
        let duration = Duration::from_secs_f64(trajectory.duration());
        let (ends, ended) = oneshot::channel();
        let mut begun = Ok(());
        // Within this no stop can be requested: one before is seen here, one after is seen by the servo loop.
        self.standing.send_if_modified(|standing| {
            begun = standing.require_ready();
            if begun.is_ok() && !self.servo.lock().follow(id, Box::new(trajectory)) {
                begun = Err(not_ready("the servo loop takes no commands"));
            }
            if begun.is_ok() {
                *self.waiting.lock() = Some((id, ends));
                *standing = Standing::Moving;
            }
            begun.is_ok()
        });
        begun?;
        Ok(Running {
            began: Instant::now(),
            duration,
            ended,
        })
    }

    /// Decelerates what is under way, without more: the arm is ready again when it rests.
    pub(crate) fn cancel(&self) {
        self.standing.send_if_modified(|standing| {
            let moves = *standing == Standing::Moving;
            if moves {
                self.remote.stop();
                *standing = Standing::Stopping { latched: None };
            }
            moves
        });
    }

    /// Decelerates, and refuses motions until somebody calls `recover`.
    pub(crate) async fn stop(&self, reason: &str) -> Result<(), MotionError> {
        self.standing.send_if_modified(|standing| {
            self.remote.stop();
            let stopped = standing.stopped(reason);
            let is_new = *standing != stopped;
            *standing = stopped;
            is_new
        });
        let mut standing = self.standing.subscribe();
        let rests = standing.wait_for(|standing| !standing.is_moving());
        let is_held = tokio::time::timeout(STOP_TIMEOUT, rests)
            .await
            .is_ok_and(|rests| rests.is_ok_and(|standing| matches!(*standing, Standing::Stopped { .. })));
        if is_held {
            return Ok(());
        }
        // An arm that this node does not hold, or has lost, may be moved by somebody else.
        Ok(self.arm.stop().await?)
    }

    /// From whatever it is to ready, or why not. `looked`: somebody has looked at an arm that touched something.
    pub(crate) async fn recover(&self, home: &JointValues, base: &str, looked: bool) -> Result<(), MotionError> {
        let _alone = self.recovering.lock().await;
        if self.standing.borrow().is_moving() {
            return Err(MotionError::Busy);
        }
        if self.resume() {
            return Ok(());
        }
        self.remote.forbid();
        let _ = self.servo.lock().release();
        self.standing.send_replace(Standing::Disarmed);
        self.arm.recover(looked).await?;
        self.take_dimensions(home, base).await?;
        self.engage().await
    }

    /// An arm that was stopped and is held has nothing to recover from.
    fn resume(&self) -> bool {
        let is_armed = matches!(
            self.arm.state().borrow().condition,
            ArmCondition::Armed | ArmCondition::Moving
        );
        self.standing.send_if_modified(|standing| {
            let resumes = is_armed && matches!(standing, Standing::Stopped { .. } | Standing::Ready);
            if resumes {
                *standing = Standing::Ready;
            }
            resumes
        })
    }

    async fn take_dimensions(&self, home: &JointValues, base: &str) -> Result<(), MotionError> {
        let Some(rows) = self.dimensions.read().await? else {
            return Ok(());
        };
        let model = self.model().with_dimensions(base, &rows, home)?;
        *self.model.write() = Arc::new(model);
        Ok(())
    }

    /// Switches the arm on and holds it where it stands.
    async fn engage(&self) -> Result<(), MotionError> {
        let stream = self.arm.arm().await?;
        let at = self.measured()?;
        self.model().chain.require_limits(&SVector::from(at))?;
        let engaged = self.engaged.notified();
        if !self.servo.lock().engage(stream, at) {
            return Err(not_ready("the servo loop takes no commands"));
        }
        match tokio::time::timeout(ENGAGE_TIMEOUT, engaged).await {
            Ok(()) if *self.standing.borrow() == Standing::Ready => Ok(()),
            Ok(()) => Err(self
                .standing
                .borrow()
                .require_ready()
                .err()
                .unwrap_or(MotionError::Busy)),
            Err(_) => Err(not_ready("the servo loop did not take the arm over")),
        }
    }

    /// Where a motion would begin: for plans that are not executed.
    pub(crate) fn measured_or_held(&self) -> Result<JointValues, MotionError> {
        self.held_at().or_else(|_| self.measured())
    }

    /// By a report that is new.
    fn measured(&self) -> Result<JointValues, MotionError> {
        let state = self.arm.state();
        let state = state.borrow();
        let fresh = state
            .joints
            .filter(|joints| joints.received_at.elapsed() < self.state_timeout);
        fresh
            .map(|joints| joints.angles)
            .ok_or_else(|| not_ready("the controller has reported no joint angles for too long"))
    }

    /// Tells whoever waits for the trajectory.
    fn end(&self, id: u64, ending: Ending) {
        let mut waiting = self.waiting.lock();
        if let Some((_, ends)) = waiting.take_if(|(waiting, _)| *waiting == id) {
            // Nobody may wait any more.
            let _ = ends.send(ending);
        }
    }
}

fn require_start(trajectory: &Trajectory<7>, at: &JointValues, tolerance: f64) -> Result<(), MotionError> {
    for (index, (start, stands)) in trajectory.start().iter().zip(at).enumerate() {
        if (start.position - stands).abs() > tolerance {
            return Err(MotionError::Elsewhere {
                joint: index + 1,
                start: start.position,
                stands: *stands,
                tolerance,
            });
        }
    }
    Ok(())
}

fn not_ready(reason: &str) -> MotionError {
    MotionError::NotReady { reason: reason.into() }
}
