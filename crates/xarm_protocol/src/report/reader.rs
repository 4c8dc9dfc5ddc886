//! Reports out of a stream of bytes.

use crate::error::ProtocolError;
use crate::report::{NORMAL_LENGTH, NORMAL_MISTAKE, REAL_LENGTHS, RICH_LENGTHS, RICH_MISTAKE, Report, ReportKind};

/// Takes bytes as they come and gives whole reports. A controller sends reports of one length on a connection.
#[derive(Debug, Clone)]
pub struct ReportReader {
    kind: ReportKind,
    bytes: Vec<u8>,
    length: Option<usize>,
}

impl ReportReader {
    /// For one connection.
    pub fn new(kind: ReportKind) -> Self {
        Self {
            kind,
            bytes: Vec::with_capacity(2048),
            length: None,
        }
    }

    /// Bytes in the order in which they came.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// The next whole report; none until more bytes come.
    ///
    /// # Errors
    /// A length that is none of the known ones or not that of the report before, values without meaning. The stream
    /// cannot be read on, and the connection has to be closed.
    #[allow(clippy::should_implement_trait, reason = "an error in the stream is no item of it")]
    pub fn next(&mut self) -> Result<Option<Report>, ProtocolError> {
        let Some(head) = self.bytes.first_chunk::<4>() else {
            return Ok(None);
        };
        let found = u32::from_be_bytes(*head) as usize;
        let length = self.check_length(found)?;
        let Some(bytes) = self.bytes.get(..length) else {
            return Ok(None);
        };
        let report = Report::decode(self.kind, bytes)?;
        self.bytes.drain(..length);
        self.length = Some(found);
        Ok(Some(report))
    }

    fn check_length(&self, found: usize) -> Result<usize, ProtocolError> {
        let known = |lengths: &[usize]| {
            let known: Vec<String> = lengths.iter().map(ToString::to_string).collect();
            known.join(", ")
        };
        let error = |known| ProtocolError::ReportLength {
            kind: self.kind.name(),
            found,
            known,
        };
        if let Some(length) = self.length.filter(|length| *length != found) {
            return Err(error(format!("{length}, as the reports before on this connection")));
        }
        match (self.kind, found) {
            (ReportKind::Normal, NORMAL_LENGTH | NORMAL_MISTAKE) => Ok(NORMAL_LENGTH),
            (ReportKind::Normal, _) => Err(error(known(&[NORMAL_LENGTH]))),
            (ReportKind::Rich, RICH_MISTAKE) => Ok(RICH_LENGTHS[0]),
            (ReportKind::Rich, _) if RICH_LENGTHS.contains(&found) => Ok(found),
            (ReportKind::Rich, _) => Err(error(known(&RICH_LENGTHS))),
            (ReportKind::Real, _) if REAL_LENGTHS.contains(&found) => Ok(found),
            (ReportKind::Real, _) => Err(error(known(&REAL_LENGTHS))),
        }
    }
}
