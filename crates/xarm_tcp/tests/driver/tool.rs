//! The vacuum gripper, and the arm's own dimensions.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::{ArmError, Suction, SuctionState};
use geometry::RigidTransform;
use kinematics::ModifiedDh;
use sim::arm::{ArmConfig, SuctionWorld};
use xarm_protocol::{Firmware, VacuumHardware};

use crate::rig::{PATIENCE, Rig};

/// A plate that follows the cup.
#[derive(Debug)]
struct Plate;

impl SuctionWorld for Plate {
    fn touched(&self, _: &RigidTransform) -> Option<f64> {
        Some(0.2)
    }
}

async fn rig(wired: VacuumHardware, configured: VacuumHardware, firmware: Firmware) -> Rig {
    let mut config = ArmConfig {
        vacuum: wired,
        suction: Some(Arc::new(Plate)),
        ..ArmConfig::default()
    };
    config.identity.firmware = firmware;
    Rig::with(config, |config| config.vacuum = configured).await
}

async fn read(rig: &Rig) -> SuctionState {
    rig.arm.read().await.expect("the tool board answers")
}

#[tokio::test(flavor = "multi_thread")]
async fn both_versions_hold_and_release() {
    for hardware in [VacuumHardware::Cable, VacuumHardware::Contacts] {
        for firmware in [Firmware::new(2, 3, 0), Firmware::new(2, 5, 5)] {
            let rig = rig(hardware, hardware, firmware).await;
            assert_eq!(read(&rig).await, SuctionState::default());
            rig.arm.set(true).await.expect("it switches");
            assert!(read(&rig).await.on);
            let deadline = Instant::now() + PATIENCE;
            while !read(&rig).await.held {
                assert!(Instant::now() < deadline, "{hardware:?} holds");
            }
            rig.arm.set(false).await.expect("it switches");
            assert!(!read(&rig).await.on);
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_wrong_wiring_is_silent() {
    let rig = rig(VacuumHardware::Contacts, VacuumHardware::Cable, Firmware::new(2, 5, 5)).await;
    rig.arm
        .set(true)
        .await
        .expect("outputs switch whatever is wired to them");
    // Three times as long as a seal takes.
    let until = Instant::now() + Duration::from_millis(600);
    while Instant::now() < until {
        assert!(!read(&rig).await.held);
    }
    assert_eq!(rig.controller.moment().held, None);
}

fn measured() -> [ModifiedDh; 7] {
    let nominal = [
        (0.267, 0.0, 0.0),
        (0.0, -FRAC_PI_2, 0.0),
        (0.293, FRAC_PI_2, 0.0),
        (0.0, FRAC_PI_2, 0.0525),
        (0.3425, FRAC_PI_2, 0.0775),
        (0.0, FRAC_PI_2, 0.0),
        (0.097, -FRAC_PI_2, 0.076),
    ];
    nominal.map(|(d, alpha, a)| ModifiedDh {
        theta: 0.002,
        d: d + 0.0007,
        alpha: alpha - 0.003,
        a: a + 0.0004,
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn the_arms_own_dimensions_are_read_in_metres() {
    let config = ArmConfig {
        calibration: Some(measured()),
        ..ArmConfig::default()
    };
    let rig = Rig::with(config, |_| {}).await;
    let found = rig.arm.calibrated_kinematics().await.expect("it knows them");
    for (found, expected) in found.iter().zip(measured()) {
        let differences = [
            found.theta - expected.theta,
            found.d - expected.d,
            found.alpha - expected.alpha,
            found.a - expected.a,
        ];
        assert!(
            differences.iter().all(|difference| difference.abs() < 1e-6),
            "{found:?}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn dimensions_of_another_arm_are_refused() {
    let mut wrong = measured();
    wrong[3].a += 0.03;
    let config = ArmConfig {
        calibration: Some(wrong),
        ..ArmConfig::default()
    };
    let rig = Rig::with(config, |_| {}).await;
    let refused = rig.arm.calibrated_kinematics().await;
    assert!(
        matches!(&refused, Err(ArmError::Refused { reason }) if reason.contains("a of joint 4")),
        "{refused:?}"
    );
}
