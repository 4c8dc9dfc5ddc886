//! Reports from bytes.

use crate::bytes::Cursor;
use crate::error::ProtocolError;
use crate::modes::{Mode, State};
use crate::report::{Condition, Details, NORMAL_LENGTH, REAL_LENGTHS, Report, ReportKind};

/// Sensitivities end here.
const MOST_SENSITIVE: u8 = 5;
/// Characters of the version.
const VERSION: usize = 30;

impl Report {
    /// From all bytes of a report, its length included.
    pub fn decode(kind: ReportKind, bytes: &[u8]) -> Result<Self, ProtocolError> {
        let mut cursor = Cursor::new("report", "as many bytes as its kind has", bytes);
        cursor.u32()?;
        let both = cursor.u8()?;
        let mut report = Self {
            mode: Mode::try_from(both >> 4)?,
            state: State::try_from(both & 0x0F)?,
            queued: cursor.u16()?,
            joints: cursor.floats()?,
            pose: cursor.floats()?,
            torques: cursor.floats()?,
            forces: None,
            condition: None,
            details: None,
        };
        match kind {
            ReportKind::Real if bytes.len() > REAL_LENGTHS[0] => {
                report.forces = Some([cursor.floats()?, cursor.floats()?]);
            }
            ReportKind::Real => {}
            ReportKind::Normal | ReportKind::Rich => report.condition = Some(condition(&mut cursor)?),
        }
        if kind == ReportKind::Rich && bytes.len() > NORMAL_LENGTH {
            report.details = Some(details(&mut cursor)?);
        }
        Ok(report)
    }
}

fn condition(cursor: &mut Cursor<'_>) -> Result<Condition, ProtocolError> {
    let [brakes, enabled, error, warning] = cursor.array()?;
    Ok(Condition {
        brakes,
        enabled,
        error,
        warning,
        tcp_offset: cursor.floats()?,
        load: cursor.floats()?,
        collision_sensitivity: sensitivity("collision sensitivity", cursor)?,
        teach_sensitivity: sensitivity("teach sensitivity", cursor)?,
        gravity: cursor.floats()?,
    })
}

fn sensitivity(what: &'static str, cursor: &mut Cursor<'_>) -> Result<u8, ProtocolError> {
    let found = cursor.u8()?;
    if found <= MOST_SENSITIVE {
        return Ok(found);
    }
    Err(ProtocolError::Value {
        what,
        found: found.into(),
        allowed: "0 to 5",
    })
}

fn details(cursor: &mut Cursor<'_>) -> Result<Details, ProtocolError> {
    let [robot_type, axes, ..] = cursor.array::<6>()?;
    let text = cursor.slice(VERSION)?;
    let end = text.iter().position(|byte| *byte == 0).unwrap_or(VERSION);
    let mut details = Details {
        robot_type,
        axes,
        version: String::from_utf8_lossy(&text[..end]).into_owned(),
        tcp_motion: cursor.floats()?,
        joint_motion: cursor.floats()?,
        rotation_motion: cursor.floats()?,
        servos: servos(cursor)?,
        tool_board: cursor.array()?,
        temperatures: None,
        speeds: None,
        power: None,
        flags: None,
    };
    longer(cursor, &mut details)?;
    Ok(details)
}

fn servos(cursor: &mut Cursor<'_>) -> Result<[[u8; 2]; 7], ProtocolError> {
    let mut servos = [[0; 2]; 7];
    for servo in &mut servos {
        *servo = cursor.array()?;
    }
    Ok(servos)
}

/// What later firmware put behind; each part is there as a whole or not at all.
fn longer(cursor: &mut Cursor<'_>, details: &mut Details) -> Result<(), ProtocolError> {
    if cursor.is_empty() {
        return Ok(());
    }
    details.temperatures = Some(cursor.array()?.map(u8::cast_signed));
    if cursor.is_empty() {
        return Ok(());
    }
    details.speeds = Some((cursor.f32()?, cursor.floats()?));
    // Counter, world offset, output resets: 30 bytes; simulation and tool shape: 27.
    if cursor.remaining() < 30 + 27 + 42 {
        return Ok(());
    }
    cursor.slice(30 + 27)?;
    let mut voltages = [0.0; 7];
    for voltage in &mut voltages {
        *voltage = f32::from(cursor.u16()?) / 100.0;
    }
    details.power = Some((voltages, cursor.floats()?));
    // Inputs and outputs of the box: 50 bytes; forces and their axis: 61.
    if cursor.remaining() < 50 + 61 {
        return Ok(());
    }
    cursor.slice(50 + 61)?;
    if !cursor.is_empty() {
        details.flags = Some(cursor.u8()?);
    }
    Ok(())
}
