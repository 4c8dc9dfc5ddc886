//! The lights' port and the cameras of a cell on hardware, and what else is connected.

use std::collections::BTreeMap;
use std::net::Ipv4Addr;
use std::path::Path;

use camera_aravis::CameraSighting;
use light_serial::PortInfo;
use ros::{LaunchConfig, ParameterValue};

use super::finding::{Finding, Section};

const LIGHTS: Section = Section("lights");
const CAMERAS: Section = Section("cameras");

/// Both nodes' parameters, as the config sets them.
pub(super) fn check(config: &LaunchConfig, discover: bool) -> Vec<Finding> {
    let mut findings = ports(&light_serial::list_ports());
    if config.cell.simulator.is_none() {
        let lights = config.parameters(light_sequencer::NAME);
        findings.extend(text(&lights, "port").map(|port| light_port(Path::new(port))));
        findings.extend(configured(config).into_iter().map(|(name, guid)| camera(&name, &guid)));
    }
    if discover {
        findings.extend(discovered());
    }
    findings
}

fn text<'a>(parameters: &'a BTreeMap<String, ParameterValue>, name: &str) -> Option<&'a str> {
    match parameters.get(name) {
        Some(ParameterValue::String(text)) => Some(text),
        _ => None,
    }
}

fn ports(found: &[PortInfo]) -> Vec<Finding> {
    if found.is_empty() {
        return vec![LIGHTS.ok("serial ports", "none")];
    }
    found.iter().map(port).collect()
}

fn port(port: &PortInfo) -> Finding {
    let what = format!("port {}", port.path.display());
    let product = port.product.as_deref().unwrap_or("no USB device");
    let found = match &port.by_id {
        Some(by_id) => format!("{product}, {}", by_id.display()),
        None => product.to_owned(),
    };
    match &port.access {
        Ok(()) => LIGHTS.ok(what, found),
        Err(problem) => LIGHTS.warn(what, found, problem.as_str()),
    }
}

/// The port that the config names; opening it would reset the controller.
fn light_port(path: &Path) -> Finding {
    let what = "configured port";
    if path.exists() {
        return LIGHTS.ok(what, path.display().to_string()).needed();
    }
    let advice = "plug the light controller in, or correct the parameter `port` of light_sequencer";
    LIGHTS.missing(what, format!("no {}", path.display()), advice).needed()
}

/// Name and guid of every camera of the config.
fn configured(config: &LaunchConfig) -> Vec<(String, String)> {
    let parameters = config.parameters(camera_capture::NAME);
    let guid = |name: &String| {
        let camera = name.strip_suffix(".guid")?;
        Some((camera.to_owned(), text(&parameters, name)?.to_owned()))
    };
    parameters.keys().filter_map(guid).collect()
}

/// Only addresses are asked: other names take a broadcast.
fn camera(name: &str, guid: &str) -> Finding {
    let what = format!("{name}, {guid}");
    let Ok(address) = guid.parse::<Ipv4Addr>() else {
        return CAMERAS.ok(what, "not asked: finding it by name takes a broadcast (--discover)");
    };
    match camera_aravis::probe(address) {
        Ok(seen) => CAMERAS.ok(what, describe(&seen)).needed(),
        Err(error) => CAMERAS
            .missing(
                what,
                error.to_string(),
                format!("check power, cable and this host's address; correct {name}.guid of camera_capture"),
            )
            .needed(),
    }
}

fn describe(seen: &CameraSighting) -> String {
    let identity = &seen.identity;
    format!(
        "{} {}, serial number {}{}",
        identity.vendor,
        identity.model,
        identity.serial,
        if seen.in_use { ", in use" } else { "" }
    )
}

fn discovered() -> Vec<Finding> {
    match camera_aravis::list_cameras() {
        Ok(cameras) if cameras.is_empty() => vec![CAMERAS.ok("discovered", "none")],
        Ok(cameras) => cameras
            .iter()
            .map(|seen| CAMERAS.ok(format!("at {}", seen.identity.address), describe(seen)))
            .collect(),
        Err(error) => vec![CAMERAS.warn("discovered", error.to_string(), "name cameras by address in the config")],
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::finding::Status;
    use super::*;

    #[test]
    fn a_port_that_may_not_be_opened_is_told_with_what_helps() {
        assert_eq!(ports(&[])[0].found, "none");
        let found = ports(&[PortInfo {
            path: "/dev/ttyACM0".into(),
            by_id: Some(PathBuf::from("/dev/serial/by-id/arduino")),
            product: Some("Arduino Uno".into()),
            access: Err("join its group".into()),
        }]);
        assert_eq!(found[0].found, "Arduino Uno, /dev/serial/by-id/arduino");
        assert_eq!(
            (found[0].status, found[0].advice.as_deref()),
            (Status::Warn, Some("join its group"))
        );
    }

    #[test]
    fn a_camera_on_hardware_is_asked_at_its_address() {
        let text = "cell: {processes: {vision: [camera_capture], lights: [light_sequencer]}}\n\
                    camera_capture: {ros__parameters: {c1: {guid: 127.88.1.1}, c2.guid: C2-SERIAL}}\n\
                    light_sequencer: {ros__parameters: {port: /dev/no_such_port}}\n";
        let config = LaunchConfig::parse(text, "hardware.yaml").unwrap();
        let findings = check(&config, false);
        let of = |what: &str| findings.iter().find(|f| f.what.starts_with(what)).unwrap();
        assert_eq!((of("c1, 127.88.1.1").status, of("c1").needed), (Status::Missing, true));
        assert_eq!(of("c2, C2-SERIAL").status, Status::Ok);
        assert_eq!(of("configured port").found, "no /dev/no_such_port");
    }
}
