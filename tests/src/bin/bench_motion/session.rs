//! The real driver and the real servo loop, connected to the simulated controller by loopback.

use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use devices::{Arm as _, ArmLink, JointValues};
use sim::arm::{ArmConfig, ArmController};
use trajectory::Trajectory;
use trajectory_executor::servo::{Servo, ServoConfig, ServoEvent, ServoRemote};
use xarm_tcp::{Timeouts, XArm, XArmConfig};

use crate::arm::{Arm, HOME};
use crate::recorder::Log;

const PATIENCE: Duration = Duration::from_secs(30);
/// Between looks for events.
const LOOK: Duration = Duration::from_millis(2);
/// How long motions are permitted with each look: who waits for events watches the arm.
const PERMIT: Duration = Duration::from_secs(2);

pub(crate) struct Session {
    pub(crate) controller: ArmController,
    pub(crate) servo: Servo,
    pub(crate) remote: ServoRemote,
    pub(crate) log: Log,
    driver: XArm,
}

impl Session {
    /// The arm is held at home; room for so many set-points.
    pub(crate) async fn open(arm: &Arm, room: usize, priority: u8) -> anyhow::Result<Self> {
        let controller = ArmController::start(ArmConfig::default())?;
        let driver = XArm::open(driver_config(&controller));
        let mut state = driver.state();
        let is_there =
            |state: &devices::ArmState| matches!(state.link, ArmLink::Connected { .. }) && state.joints.is_some();
        tokio::time::timeout(PATIENCE, state.wait_for(is_there))
            .await
            .context("the simulated controller does not answer")??;
        let servo = Servo::start(ServoConfig {
            priority,
            ..arm.servo(&HOME)?
        })?;
        let mut session = Self {
            remote: servo.remote(),
            log: Log::with_room(room),
            controller,
            servo,
            driver,
        };
        let stream = session.driver.arm().await?;
        let stream = session.log.recorder(Some(stream));
        ensure!(session.servo.engage(Box::new(stream), HOME), "the loop takes no stream");
        let event = session.event().await?;
        ensure!(event == ServoEvent::Engaged, "{event:?} instead of holding");
        Ok(session)
    }

    pub(crate) fn begin(&mut self, trajectory: Trajectory<7>) -> anyhow::Result<()> {
        self.remote.permit_until(Instant::now() + PERMIT);
        ensure!(
            self.servo.follow(1, Box::new(trajectory)),
            "the loop takes no trajectory"
        );
        Ok(())
    }

    /// The next one; motions are permitted while it is waited for.
    pub(crate) async fn event(&mut self) -> anyhow::Result<ServoEvent> {
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            self.remote.permit_until(Instant::now() + PERMIT);
            match self.servo.take_event() {
                Some(ServoEvent::Lost { fault, .. }) => bail!("the stream was lost: {fault}"),
                Some(event) => return Ok(event),
                None => tokio::time::sleep(LOOK).await,
            }
        }
        bail!("nothing has happened in the servo loop for {PATIENCE:?}")
    }

    /// Where the arm was sent last.
    pub(crate) fn commanded(&self) -> anyhow::Result<JointValues> {
        let states = self.remote.commanded().context("nothing was sent")?;
        Ok(states.map(|state| state.position))
    }

    /// Ends the stream; what was sent until then has arrived, or never will.
    pub(crate) async fn finish(&mut self) -> anyhow::Result<()> {
        ensure!(self.servo.release(), "the loop does not let go");
        tokio::time::sleep(Duration::from_millis(300)).await;
        self.driver.stop().await?;
        Ok(())
    }

    pub(crate) async fn close(self) {
        drop(self.servo);
        self.driver.close().await;
    }
}

fn driver_config(controller: &ArmController) -> XArmConfig {
    let ports = controller.ports();
    XArmConfig {
        control_port: ports.control,
        real_time_report_port: ports.real,
        rich_report_port: ports.rich,
        // The controller shares this machine's processors with everything else that runs here.
        timeouts: Timeouts {
            reply: PATIENCE,
            real_time_report: PATIENCE,
            rich_report: PATIENCE,
            settle: PATIENCE,
            ..Timeouts::default()
        },
        ..XArmConfig::new(controller.address().to_string())
    }
}
