//! The connections on which the controller reports. Each has a task that opens it again when nothing, or nothing that is
//! understood, comes.

use std::sync::Arc;
use std::time::{Duration, Instant};

use devices::JointReading;
use tokio::io::AsyncReadExt;
use tokio::net::TcpStream;
use tokio::sync::watch;
use xarm_protocol::{Report, ReportKind, ReportReader};

use crate::control::connect;
use crate::observed::{Health, Motion, Observed};
use crate::shared::Shared;
use crate::velocity::Velocities;

const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(1);
/// Currents stand where torques are.
const FLAG_CURRENTS: u8 = 0x04;

/// Where the reports of a kind come from, and how long they may take.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub(crate) kind: ReportKind,
    pub(crate) address: String,
    pub(crate) connect_patience: Duration,
    pub(crate) patience: Duration,
}

/// Never ends by itself.
pub(crate) async fn follow(source: Source, observed: watch::Sender<Observed>, shared: Arc<Shared>) {
    let mut pause = FIRST_PAUSE;
    let mut told = String::new();
    loop {
        let reason = read(&source, &observed, &mut pause).await;
        let reason = format!("{} reports from {}: {reason}", source.kind.name(), source.address);
        if reason == told {
            tracing::debug!(reason, "still no reports");
        } else {
            tracing::warn!(reason, "trying again");
        }
        shared.count(|statistics| statistics.report_failures += 1);
        observed.send_modify(|observed| observed.lose(source.kind, reason.clone()));
        told = reason;
        tokio::time::sleep(pause).await;
        pause = (pause * 2).min(LONGEST_PAUSE);
    }
}

/// Until it fails.
async fn read(source: &Source, observed: &watch::Sender<Observed>, pause: &mut Duration) -> String {
    let mut socket = match connect(&source.address, source.connect_patience).await {
        Ok(socket) => socket,
        Err(error) => return error.to_string(),
    };
    let mut reader = ReportReader::new(source.kind);
    let mut velocities = Velocities::new(Duration::from_secs(1) / source.kind.rate());
    loop {
        match next(&mut socket, &mut reader, source.patience).await {
            Ok(report) => {
                if !report.joints.iter().all(|angle| angle.is_finite()) {
                    return format!("angles that are no numbers: {:?}", report.joints);
                }
                observed.send_modify(|observed| put(observed, source.kind, &report, &mut velocities));
                *pause = FIRST_PAUSE;
            }
            Err(reason) => return reason,
        }
    }
}

async fn next(socket: &mut TcpStream, reader: &mut ReportReader, patience: Duration) -> Result<Report, String> {
    let deadline = tokio::time::Instant::now() + patience;
    let mut buffer = [0; 2048];
    loop {
        if let Some(report) = reader.next().map_err(|error| error.to_string())? {
            return Ok(report);
        }
        let read = tokio::time::timeout_at(deadline, socket.read(&mut buffer)).await;
        let count = read
            .map_err(|_| format!("none came within {patience:?}"))?
            .map_err(|error| error.to_string())?;
        if count == 0 {
            return Err("the controller closed the connection".to_owned());
        }
        reader.push(&buffer[..count]);
    }
}

fn put(observed: &mut Observed, kind: ReportKind, report: &Report, velocities: &mut Velocities) {
    if kind == ReportKind::Real {
        put_motion(observed, report, velocities);
    } else if let Some(condition) = &report.condition {
        let details = report.details.as_ref();
        let flags = details.and_then(|details| details.flags).unwrap_or(0);
        observed.health = Ok(Health::new(
            condition.error,
            details.map(|details| details.servos),
            [condition.brakes, condition.enabled],
            flags & FLAG_CURRENTS != 0,
        ));
    }
}

fn put_motion(observed: &mut Observed, report: &Report, velocities: &mut Velocities) {
    let received_at = Instant::now();
    let angles = report.joints.map(f64::from);
    observed.motion = Ok(Motion {
        mode: report.mode,
        state: report.state,
        received_at,
    });
    observed.joints = Some(JointReading {
        angles,
        velocities: velocities.next(received_at, angles),
        torques: report.torques.map(f64::from),
        received_at,
    });
}
