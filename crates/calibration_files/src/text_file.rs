//! Files as text, with their path in what went wrong.

use std::path::Path;

use crate::error::CalibrationFileError;

pub(crate) fn read(path: &Path) -> Result<String, CalibrationFileError> {
    std::fs::read_to_string(path).map_err(|source| failed(path, source))
}

/// One that is there is replaced.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), CalibrationFileError> {
    std::fs::write(path, text).map_err(|source| failed(path, source))
}

fn failed(path: &Path, source: std::io::Error) -> CalibrationFileError {
    CalibrationFileError::Io {
        path: path.to_owned(),
        source,
    }
}
