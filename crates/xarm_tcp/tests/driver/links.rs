//! Connecting: who is welcome, and what is told.

use devices::{Arm, ArmCondition, ArmError, ArmLink, Suction};
use sim::arm::ArmConfig;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpListener;
use xarm_protocol::{Firmware, Protocol, Reply, Status};
use xarm_tcp::{XArm, XArmConfig};

use crate::rig::{HOME, Rig, driver_config, lost_reason, start, wait_for};

#[tokio::test(flavor = "multi_thread")]
async fn a_connected_arm_tells_who_and_where_it_is() {
    let rig = Rig::connected().await;
    let state = rig.wait_for(|state| state.condition == ArmCondition::Stopped).await;
    let ArmLink::Connected {
        firmware_version,
        serial_number,
        ..
    } = &state.link
    else {
        panic!("it is connected");
    };
    assert_eq!(
        (firmware_version.as_str(), serial_number.as_str()),
        ("v2.5.5", "XI130506SIM001")
    );
    let joints = state.joints.expect("it has reported");
    for (found, expected) in joints.angles.iter().zip(HOME) {
        assert!((found - expected).abs() < 1e-6);
    }
    assert!(joints.velocities.iter().all(|velocity| velocity.abs() < 1e-3));
    assert_eq!(rig.arm.statistics().connections, 1);
}

async fn refusal(mut config: XArmConfig, expected_serial: Option<&str>) -> String {
    config.expected_serial = expected_serial.map(ToOwned::to_owned);
    let arm = XArm::open(config);
    let connecting = "is being connected";
    let state = wait_for(&arm, |state| {
        lost_reason(state).is_some_and(|reason| !reason.contains(connecting))
    })
    .await;
    lost_reason(&state).expect("it is not connected").to_owned()
}

/// A controller that answers who it is, and nothing else.
async fn answering(identity: &'static str) -> XArmConfig {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port is free");
    let control_port = listener.local_addr().expect("it is bound").port();
    tokio::spawn(async move {
        let (mut socket, _) = listener.accept().await.expect("somebody connects");
        let mut request = [0; 7];
        socket.read_exact(&mut request).await.expect("it asks");
        let reply = Reply {
            register: request[6],
            status: Status::FINE,
            data: identity.as_bytes().to_vec(),
        };
        let frame = reply.frame(u16::from_be_bytes([request[0], request[1]]), Protocol::Private);
        socket.write_all(&frame.encode()).await.expect("it listens");
        // Until it hangs up.
        let _ = socket.read(&mut request).await;
    });
    XArmConfig {
        control_port,
        ..XArmConfig::new("127.0.0.1")
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_known_xarm7_is_refused_by_name() {
    let reason = refusal(answering("7,7,XI130506A,AC130501D,v1.6.0").await, None).await;
    assert!(reason.contains("firmware v1.6.0 is not known"), "{reason}");
    let reason = refusal(answering("6,6,XI130506A,AC130501D,v2.5.5").await, None).await;
    assert!(reason.contains("has 6 joints"), "{reason}");
    let reason = refusal(answering("hello").await, None).await;
    assert!(reason.contains("identity is `hello`"), "{reason}");
    let controller = start(ArmConfig::default());
    let reason = refusal(driver_config(&controller), Some("XI130506OTHER1")).await;
    assert!(
        reason.contains("serial number XI130506SIM001, expected is XI130506OTHER1"),
        "{reason}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn older_firmware_that_is_supported_is_served() {
    for firmware in [Firmware::new(1, 8, 4), Firmware::new(1, 12, 10), Firmware::new(2, 7, 1)] {
        let mut config = ArmConfig::default();
        config.identity.firmware = firmware;
        let rig = Rig::with(config, |_| {}).await;
        rig.armed().await;
        rig.arm.set(true).await.expect("the outputs switch");
        rig.arm.stop().await.expect("it stops");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_controller_everything_says_so_at_once() {
    let controller = start(ArmConfig::default());
    let config = driver_config(&controller);
    drop(controller);
    let arm = XArm::open(config);
    wait_for(&arm, |state| {
        lost_reason(state).is_some_and(|reason| reason.contains("cannot connect"))
    })
    .await;
    assert!(matches!(arm.arm().await.err(), Some(ArmError::Disconnected { .. })));
    assert!(matches!(arm.stop().await, Err(ArmError::Disconnected { .. })));
    assert!(matches!(arm.recover(true).await, Err(ArmError::Disconnected { .. })));
    assert!(matches!(arm.set(true).await, Err(ArmError::Disconnected { .. })));
    assert!(matches!(
        arm.calibrated_kinematics().await,
        Err(ArmError::Disconnected { .. })
    ));
    arm.close().await;
}
