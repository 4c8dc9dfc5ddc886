//! The ports: who knocks is let in, and reports are sent.

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream};
use std::os::unix::net::UnixListener;
use std::sync::Arc;
use std::time::{Duration, Instant};

use xarm_protocol::ReportKind;

use super::config::{ArmConfig, ArmPorts};
use super::error::ArmError;
use super::shared::Shared;
use super::wire::Door;

/// The fastest reports' period; also how long someone who knocks waits at most.
const PERIOD: Duration = Duration::from_millis(10);
const KINDS: [ReportKind; 3] = [ReportKind::Normal, ReportKind::Rich, ReportKind::Real];

/// All that is open to clients.
pub(super) struct Doors {
    control: Vec<Door>,
    reports: Vec<ReportDoor>,
}

struct ReportDoor {
    kind: ReportKind,
    listener: TcpListener,
    clients: Vec<TcpStream>,
}

impl Doors {
    /// Opens all ports; those that were chosen freely are told.
    pub(super) fn open(config: &ArmConfig, ports: ArmPorts) -> Result<(Self, ArmPorts), ArmError> {
        let (control, port) = listen("control port", config.address, ports.control)?;
        let mut chosen = ArmPorts { control: port, ..ports };
        let mut control = vec![Door::Tcp(control)];
        if let Some(path) = &config.socket {
            control.push(unix_door(path)?);
        }
        let mut reports = Vec::new();
        for kind in KINDS {
            let (listener, port) = listen("report port", config.address, ports.of_reports(kind))?;
            match kind {
                ReportKind::Normal => chosen.normal = port,
                ReportKind::Rich => chosen.rich = port,
                ReportKind::Real => chosen.real = port,
            }
            reports.push(ReportDoor {
                kind,
                listener,
                clients: Vec::new(),
            });
        }
        Ok((Self { control, reports }, chosen))
    }
}

fn listen(role: &'static str, address: Ipv4Addr, port: u16) -> Result<(TcpListener, u16), ArmError> {
    let place = SocketAddrV4::new(address, port);
    let open = || {
        let listener = TcpListener::bind(place)?;
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        Ok((listener, port))
    };
    open().map_err(|reason| ArmError::Bind {
        role,
        place: place.to_string(),
        reason,
    })
}

fn unix_door(path: &std::path::Path) -> Result<Door, ArmError> {
    let open = || {
        // What a controller left behind that was killed.
        if path.exists() {
            std::fs::remove_file(path)?;
        }
        let listener = UnixListener::bind(path)?;
        listener.set_nonblocking(true)?;
        Ok(Door::Unix(listener, path.to_owned()))
    };
    open().map_err(|reason| ArmError::Bind {
        role: "control socket",
        place: path.display().to_string(),
        reason,
    })
}

/// Until the end.
pub(super) fn run(shared: &Arc<Shared>) {
    let mut due = Instant::now();
    let mut round = 0_u32;
    while !shared.has_ended() {
        if !shared.faults.is_paused() {
            serve(shared, round);
        }
        round = round.wrapping_add(1);
        // What a busy machine missed is not made up for.
        let now = Instant::now();
        due = (due + PERIOD).max(now);
        std::thread::sleep(due - now);
    }
}

fn serve(shared: &Arc<Shared>, round: u32) {
    let mut doors = shared.doors.lock();
    let Some(doors) = doors.as_mut() else { return };
    for door in &doors.control {
        while let Some((wire, name)) = door.open() {
            if let Err(error) = shared.clients.welcome(shared, wire, name) {
                tracing::warn!("a client of the simulated arm cannot be served: {error}");
            }
        }
    }
    let (faults, firmware) = (shared.faults.get(), shared.core.lock().firmware());
    for door in &mut doors.reports {
        door.let_in();
        let rounds = 1000 / door.kind.rate() / PERIOD.as_millis() as u32;
        if faults.no_reports || !round.is_multiple_of(rounds) || door.clients.is_empty() {
            continue;
        }
        let mut bytes = shared
            .core
            .lock()
            .report()
            .encode(door.kind, door.kind.length(firmware));
        if shared.faults.take_odd_report() {
            bytes[3] = bytes[3].wrapping_add(1);
        }
        door.send(&bytes);
    }
}

impl ReportDoor {
    fn let_in(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // A client that reads too slowly is let go rather than waited for.
            if stream.set_nonblocking(true).is_ok() && stream.set_nodelay(true).is_ok() {
                self.clients.push(stream);
            }
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        self.clients.retain_mut(|client| client.write_all(bytes).is_ok());
    }
}
