//! Who is there, how the arm is switched on, and what every request is answered with.

use client::{Client, of_firmware, start};
use sim::arm::{ArmConfig, ArmController};
use xarm_protocol::{Identity, Mode, Protocol, Reply, Request, State, StateCommand, Status, tool_address};

use crate::client;

#[test]
fn an_arm_tells_who_it_is() {
    for version in ["v1.8.4", "v1.12.10", "v2.5.5"] {
        let arm = ArmController::start(of_firmware(version)).expect("an arm");
        let mut client = Client::connect(&arm);
        let reply = client.call(&Request::Version);
        let identity = Identity::decode(&reply.data).expect("an identity");
        assert_eq!(reply.data.len(), 40, "the vendor's client reads no more");
        assert_eq!((identity.axes, identity.firmware.to_string().as_str()), (7, version));
        assert_eq!(
            (identity.arm_serial.as_str(), identity.box_serial.as_str()),
            ("XI1305", "AC1305")
        );
        assert!(reply.status.has(Status::NOT_READY) && !reply.status.has(Status::ERROR));
        let serials = client.call(&Request::SerialNumbers).data;
        assert_eq!((serials.len(), &serials[..14]), (40, &b"XI130506SIM001"[..]));
    }
}

#[test]
fn switching_on_goes_through_the_states() {
    let arm = start();
    let mut client = Client::connect(&arm);
    assert_eq!(client.state(), State::Stopped);
    client.call(&Request::SetState(StateCommand::Run));
    assert_eq!(client.state(), State::Stopped, "motors are off");
    client.call(&Request::MotionEnable { axis: 8, on: true });
    client.call(&Request::SetMode(Mode::Servo));
    assert_eq!(client.state(), State::Changed);
    assert!(client.call(&Request::GetState).status.has(Status::NOT_READY));
    client.fine(&Request::SetState(StateCommand::Run));
    assert_eq!(client.state(), State::Ready);
    client.call(&Request::SetMode(Mode::Position));
    assert_eq!(
        client.state(),
        State::Changed,
        "another mode wants to be set ready again"
    );
    client.fine(&Request::SetState(StateCommand::Run));
    client.fine(&Request::SetTcpLoad {
        mass: 0.61,
        centre: [0.0, 0.0, 53.0],
    });
    assert_eq!(client.state(), State::Ready, "another load is nothing of the kind");
    client.call(&Request::SetTcpOffset([0.0, 0.0, 126.0, 0.0, 0.0, 0.0]));
    assert_eq!(client.state(), State::Changed, "another tool is");
    client.fine(&Request::SetState(StateCommand::Run));
    client.call(&Request::MotionEnable { axis: 3, on: false });
    assert_eq!(client.state(), State::Stopped);
}

#[test]
fn kinematics_are_those_of_the_facts() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let angles = [0.5, -0.6, 0.3, 1.2, -0.4, 1.6, 0.9];
    let pose: [f32; 6] = client
        .call(&Request::ForwardKinematics(angles))
        .read_floats()
        .expect("six");
    let known = [201.0903, 214.2523, 614.8912, 2.918_167, -0.554_225, -0.119_921];
    for (found, known) in pose.iter().zip(known) {
        assert!((found - known).abs() < 2e-3, "{pose:?}");
    }
    let reply = client.call(&Request::InverseKinematics(pose));
    let found: [f32; 7] = reply.read_floats().expect("seven");
    let again: [f32; 6] = client
        .call(&Request::ForwardKinematics(found))
        .read_floats()
        .expect("six");
    for (index, (found, wanted)) in again.iter().zip(pose).enumerate() {
        let tolerance = if index < 3 { 0.01 } else { 1e-4 };
        assert!((found - wanted).abs() < tolerance, "{again:?} and {pose:?}");
    }
    let far = client.call(&Request::InverseKinematics([2000.0, 0.0, 0.0, 3.1, 0.0, 0.0]));
    assert!(far.status.has(Status::INVALID));
    let dimensions: [f32; 28] = client.call(&Request::GetCalibratedDh).read_floats().expect("28");
    assert_eq!((dimensions[1], dimensions[9], dimensions[27]), (267.0, 293.0, 76.0));
}

#[test]
fn limits_follow_from_the_serial_number() {
    for (serial, is_outside) in [("XI120003SIM001", 0), ("XI130506SIM001", 1)] {
        let mut config = ArmConfig::default();
        config.identity.arm_serial = serial.into();
        let arm = ArmController::start(config).expect("an arm");
        let mut client = Client::connect(&arm);
        let check = Request::JointLimitCheck([0.0, 2.05, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(client.call(&check).read_bytes(), Ok([is_outside]), "{serial}");
    }
}

#[test]
fn joint_details_come_with_the_firmware() {
    for (version, bytes) in [("v1.8.4", 28), ("v1.12.10", 84), ("v2.5.5", 84)] {
        let arm = ArmController::start(of_firmware(version)).expect("an arm");
        let mut client = Client::connect(&arm);
        assert_eq!(
            client.call(&Request::GetJoints { parts: Some(3) }).data.len(),
            bytes,
            "{version}"
        );
        assert_eq!(client.call(&Request::GetJoints { parts: None }).data.len(), 28);
    }
}

#[test]
fn what_cannot_be_is_answered_and_remembered() {
    let arm = start();
    let mut client = Client::connect(&arm);
    let unknown = Request::Unknown {
        register: 200,
        parameters: vec![1, 2, 3],
    };
    assert!(client.call(&unknown).status.has(Status::WARNING));
    assert_eq!(client.error(), [0, 13]);
    client.call(&Request::CleanWarning);
    let wrong = [
        Request::SetCollisionSensitivity(6),
        Request::SetMode(Mode::JointOnline),
        Request::ToolRead { address: 0x1234 },
        Request::ToolWrite {
            address: tool_address::SET_OUTPUTS,
            value: f32::NAN,
            in_queue: None,
        },
        // One byte too few.
        Request::Unknown {
            register: 11,
            parameters: vec![8],
        },
    ];
    for request in wrong {
        assert!(client.call(&request).status.has(Status::INVALID), "{request:?}");
        assert_eq!(client.error(), [0, 12], "{request:?}");
        client.call(&Request::CleanWarning);
    }
}

#[test]
fn protocol_and_transaction_come_back() {
    let arm = start();
    let mut client = Client::connect(&arm);
    for (transaction, protocol) in [(1, Protocol::Private), (u16::MAX, Protocol::KeepAlive)] {
        client.send(&Request::GetState.frame(transaction, protocol).encode());
        let frame = client.read().expect("an answer");
        assert_eq!((frame.transaction, frame.protocol), (transaction, protocol));
        assert_eq!(Reply::of_frame(&frame).expect("a reply").register, 13);
    }
    client.send(&xarm_protocol::HEARTBEAT);
    client.send(&[0, 9, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1]);
    let modbus = client.read().expect("an answer to Modbus, none to the heart-beat");
    assert_eq!((modbus.transaction, modbus.body), (9, vec![1, 0x83, 1]));
}
