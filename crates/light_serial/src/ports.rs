//! The serial ports of this machine.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use rustix::fs::{Access, access};
use serialport::SerialPortType;

const BY_ID: &str = "/dev/serial/by-id";

/// A serial port of this machine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PortInfo {
    /// Such as `/dev/ttyACM0`.
    pub path: PathBuf,
    /// A link to it in `/dev/serial/by-id`, which stays the same whatever else is plugged in.
    pub by_id: Option<PathBuf>,
    /// What the USB device calls itself.
    pub product: Option<String>,
    /// Whether this user may open it; if not, why not and what helps.
    pub access: Result<(), String>,
}

/// Every serial port that the system knows, sorted. No port is opened, which would reset an Arduino.
pub fn list_ports() -> Vec<PortInfo> {
    let found = serialport::available_ports().unwrap_or_else(|error| {
        tracing::warn!(%error, "the serial ports of this machine cannot be listed");
        Vec::new()
    });
    let mut ports: Vec<PortInfo> = found.into_iter().map(describe).collect();
    ports.sort_by(|one, other| one.path.cmp(&other.path));
    ports
}

fn describe(found: serialport::SerialPortInfo) -> PortInfo {
    let product = match found.port_type {
        SerialPortType::UsbPort(usb) => usb.product,
        _ => None,
    };
    let path = PathBuf::from(found.port_name);
    let allowed = access(&path, Access::READ_OK | Access::WRITE_OK);
    PortInfo {
        by_id: by_id(&path),
        product,
        access: allowed.map_err(|error| format!("{error}: {}", advice(&path))),
        path,
    }
}

fn by_id(path: &Path) -> Option<PathBuf> {
    let links = fs::read_dir(BY_ID).ok()?.flatten().map(|entry| entry.path());
    links
        .into_iter()
        .find(|link| fs::canonicalize(link).is_ok_and(|target| target == path))
}

/// What helps a user who may not open a port.
pub(crate) fn advice(path: &Path) -> String {
    let group = fs::metadata(path).ok().map(|metadata| metadata.gid());
    match group.and_then(group_name) {
        Some(group) if group != "root" => {
            format!("join its group and log in again: sudo usermod -aG {group} \"$USER\"")
        }
        _ => "ask the administrator of this machine".into(),
    }
}

fn group_name(id: u32) -> Option<String> {
    let groups = fs::read_to_string("/etc/group").ok()?;
    name_in(&groups, id)
}

/// A line is "name:password:id:members".
fn name_in(groups: &str, id: u32) -> Option<String> {
    groups.lines().find_map(|line| {
        let mut fields = line.split(':');
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(id)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_found_by_its_number() {
        let groups = "root:x:0:\nbroken\ndialout:x:20:alice,bob\n";
        assert_eq!(name_in(groups, 20).as_deref(), Some("dialout"));
        assert_eq!(name_in(groups, 21), None);
    }

    #[test]
    fn a_file_of_root_alone_has_no_group_to_join() {
        assert_eq!(advice(Path::new("/nowhere")), "ask the administrator of this machine");
    }

    #[test]
    fn listed_ports_exist() {
        for port in list_ports() {
            assert!(port.path.exists(), "{port:?}");
        }
    }
}
