//! Finding the controller, or not.

use std::time::{Duration, Instant};

use devices::{LightBank, LightError, LightLink, PanelSet};
use light_serial::{LightController, LightSerialConfig};
use sim::board::{BoardConfig, BoardFirmware};
use tokio_serial::SerialStream;

use crate::rig::{Board, Rig, capture, disconnected, wait_for};

fn open(port: impl Into<std::path::PathBuf>) -> LightController {
    LightController::open(LightSerialConfig::new(port))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_link_says_who_is_there_and_how_well_its_clock_is_known() {
    let Some(rig) = Rig::start().await else { return };
    let known = |state: &devices::LightBankState| matches!(state.link, LightLink::Connected { clock_uncertainty, .. } if clock_uncertainty < Duration::from_millis(2));
    let state = rig.state("a known clock", known).await;
    let LightLink::Connected {
        port,
        firmware_version,
        clock_uncertainty,
    } = state.link
    else {
        unreachable!("it was waited for");
    };
    assert_eq!(
        (port.as_str(), firmware_version.as_str()),
        (rig.board.simulated.port().to_str().expect("text"), "1.0.0")
    );
    println!("clock known to {clock_uncertainty:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_firmware_of_another_protocol_is_named() {
    let config = BoardConfig {
        firmware: BoardFirmware::OtherProtocol,
        ..BoardConfig::default()
    };
    let Some(board) = Board::start(&config) else { return };
    let lights = open(board.simulated.port());
    let reason = disconnected(&lights, "speaks").await;
    assert!(
        reason.contains("this host speaks light protocol 1") && reason.contains("1.0.0 speaks 250: upload"),
        "{reason}"
    );
    let refused = lights.run_sequence(capture()).await;
    assert_eq!(refused, Err(LightError::Disconnected { reason }));
    assert!(board.is_dark());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_belongs_to_one() {
    let Some(rig) = Rig::start().await else { return };
    let second = open(rig.board.simulated.port());
    let reason = disconnected(&second, "in use").await;
    assert_eq!(
        reason,
        format!(
            "port {} is in use by another program",
            rig.board.simulated.port().display()
        )
    );
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
    rig.lights.close().await;
    wait_for(&second, "its turn", |state| {
        matches!(state.link, LightLink::Connected { .. })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_port_that_is_not_there_is_named_and_found_when_it_comes() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("lights");
    let lights = open(&link);
    let reason = disconnected(&lights, "does not exist").await;
    assert!(reason.contains(link.to_str().expect("text")), "{reason}");
    let refused = lights.set(PanelSet([true; 7]), Duration::from_secs(1)).await;
    assert!(matches!(refused, Err(LightError::Disconnected { .. })), "{refused:?}");
    let config = BoardConfig {
        link: Some(link),
        ..BoardConfig::default()
    };
    let Some(_board) = Board::start(&config) else { return };
    wait_for(&lights, "a link", |state| {
        matches!(state.link, LightLink::Connected { .. })
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_device_that_says_nothing_is_reported() {
    let (_silent, terminal) = SerialStream::pair().expect("a terminal");
    let path = serialport::SerialPort::name(&terminal).expect("it has a name");
    drop(terminal);
    let lights = open(&path);
    let started = Instant::now();
    let reason = disconnected(&lights, "answered").await;
    println!("{:?}: {reason}", started.elapsed());
    assert!(
        reason.contains(&path) && reason.contains("is it the light controller"),
        "{reason}"
    );
    assert!(started.elapsed() < Duration::from_secs(6));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn something_that_is_no_port_is_named() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let lights = open(file.path());
    let reason = disconnected(&lights, "cannot open").await;
    assert!(reason.contains(file.path().to_str().expect("text")), "{reason}");
}
