//! The real tools of Aravis against the served device.

use std::net::Ipv4Addr;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use bytes::Bytes;
use gige_vision::{DeviceConfig, Faults, FrameRequest, GigeVisionError, Server};

const PATIENCE: Duration = Duration::from_mins(1);

fn picture(request: &FrameRequest) -> Bytes {
    vec![request.index as u8; request.image_bytes()].into()
}

/// An address of loopback for this process, so that runs side by side do not meet.
fn serve(last: u8) -> Option<(Server, String, Ipv4Addr)> {
    let [.., middle, low] = std::process::id().to_be_bytes();
    let ip = Ipv4Addr::new(127, 64 + (middle & 63), low, last);
    let serial = format!("A{:x}-{last}", std::process::id());
    let config = DeviceConfig {
        sensor_width: 640,
        sensor_height: 480,
        ..DeviceConfig::new(&serial, ip)
    };
    match Server::start(&config, picture) {
        Ok(server) => Some((server, format!("Rakelight-Simulated-{serial}"), ip)),
        Err(GigeVisionError::Bind { address, source }) => {
            println!("SKIPPED: {address} cannot be served here: {source}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// Runs a tool; `None` (and a loud line) where it is missing.
fn run(tool: &str, arguments: &[&str]) -> Option<Output> {
    let mut command = Command::new(tool);
    command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = match command.spawn() {
        Ok(child) => child,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            println!("SKIPPED: {tool} is missing; `cargo xtask setup` installs it");
            return None;
        }
        Err(error) => panic!("{tool}: {error}"),
    };
    let end = Instant::now() + PATIENCE;
    // These tools write less than a pipe holds, so nothing has to be read while they run.
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > end {
            child.kill().unwrap();
            panic!("{tool} {arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    Some(child.wait_with_output().unwrap())
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// The figure behind `name =` in a tool's report.
fn figure(report: &str, name: &str) -> u64 {
    let line = report.lines().find(|line| line.starts_with(name));
    let value = line
        .and_then(|line| line.split('=').nth(1))
        .unwrap_or_else(|| panic!("no {name} in\n{report}"));
    value.trim().parse().unwrap()
}

#[test]
fn arv_tool_lists_the_camera_and_sets_its_features() {
    let Some((_server, name, ip)) = serve(1) else { return };
    let Some(list) = run("arv-tool-0.8", &[]) else { return };
    let list = text(&list);
    assert!(list.contains(&format!("{name} ({ip})")), "{list}");
    let ip = ip.to_string();
    let read = |arguments: &[&str]| run("arv-tool-0.8", &[&["-a", &ip], arguments].concat()).unwrap();
    let values = text(&read(&["values"]));
    for expected in [
        "'SensorWidth' = 640",
        "'PixelFormat' = 'Mono16'",
        "'ExposureTime' = 2500 us",
        "'PayloadSize' = 614400",
        "'GevTimestampTickFrequency' = 1000000000",
    ] {
        assert!(values.contains(expected), "{expected} is missing in\n{values}");
    }
    let set = read(&[
        "control",
        "ExposureTime=1234.5",
        "GevSCPSPacketSize=7000",
        "Gain=3.5",
        "Width=320",
    ]);
    let again = text(&read(&[
        "control",
        "ExposureTime",
        "GevSCPSPacketSize",
        "Gain",
        "OffsetX",
        "PayloadSize",
    ]));
    for expected in [
        "ExposureTime = 1234.5 us",
        "GevSCPSPacketSize = 7000",
        "Gain = 3.5 dB",
        "OffsetX = 0 min:0 max:320",
        "PayloadSize = 307200",
    ] {
        assert!(
            again.contains(expected),
            "{expected} is missing in\n{again}{}",
            text(&set)
        );
    }
    let refused = text(&read(&["control", "ExposureTime=1"]));
    assert!(refused.contains("invalid-parameter"), "{refused}");
}

#[test]
fn arv_camera_test_receives_frames_with_and_without_losses() {
    let Some((server, name, _)) = serve(2) else { return };
    let size = ["--no-packet-socket", "-q", "1.0", "-i", "7600", "-y", "50000"];
    let base = [&["-n", name.as_str(), "--duration=2"], size.as_slice()].concat();
    let Some(free) = run("arv-camera-test-0.8", &[base.as_slice(), &["-f", "20"]].concat()) else {
        return;
    };
    let free = text(&free);
    assert!(figure(&free, "n_completed_buffers") >= 5, "{free}");
    assert_eq!(figure(&free, "n_size_mismatch_errors"), 0, "{free}");
    let triggered = run("arv-camera-test-0.8", &[base.as_slice(), &["-o", "10"]].concat()).unwrap();
    let triggered = text(&triggered);
    assert!(figure(&triggered, "n_completed_buffers") >= 5, "{triggered}");
    server.set_faults(Faults {
        drop_ratio: 0.02,
        drop_seed: 5,
        ..Faults::default()
    });
    let lossy = text(&run("arv-camera-test-0.8", &[base.as_slice(), &["-f", "10"]].concat()).unwrap());
    assert!(figure(&lossy, "n_resent_packets") > 0, "{lossy}");
    assert!(figure(&lossy, "n_completed_buffers") >= 5, "{lossy}");
    // The packet-size probe, with the capability for packet sockets or without.
    let probed = text(&run("arv-camera-test-0.8", &["-n", &name, "--duration=1", "-j", "always"]).unwrap());
    assert!(probed.contains("gv packet size         = 65000"), "{probed}");
}
