//! Where the board's program and firmware are.

use std::path::{Path, PathBuf};

use super::{BoardError, BoardFirmware};

const MISSING_TOOLS: &str = env!("RAKELIGHT_BOARD_MISSING");
const BUILT: &str = env!("RAKELIGHT_BOARD_FOLDER");
const PROGRAM_VARIABLE: &str = "RAKELIGHT_AVR_HOST";
const FIRMWARE_VARIABLE: &str = "RAKELIGHT_LIGHT_FIRMWARE";
const ELF: &str = "rakelight_lights.elf";

/// What a board is made of.
#[derive(Debug)]
pub(super) struct Parts {
    pub(super) program: PathBuf,
    pub(super) firmware: PathBuf,
}

pub(super) fn find(firmware: BoardFirmware) -> Result<Parts, BoardError> {
    let folder = Path::new(BUILT);
    let (elf, variable) = match firmware {
        BoardFirmware::Released => (folder.join("firmware").join(ELF), Some(FIRMWARE_VARIABLE)),
        BoardFirmware::OtherProtocol => (folder.join("firmware_other_protocol").join(ELF), None),
    };
    Ok(Parts {
        program: part(folder.join("light_board"), Some(PROGRAM_VARIABLE))?,
        firmware: part(elf, variable)?,
    })
}

fn part(built: PathBuf, variable: Option<&'static str>) -> Result<PathBuf, BoardError> {
    let named = variable.and_then(|variable| Some((PathBuf::from(std::env::var_os(variable)?), variable)));
    if named.is_none() && !MISSING_TOOLS.is_empty() {
        return Err(BoardError::NotBuilt { missing: MISSING_TOOLS });
    }
    let (path, named_by) = named.unwrap_or((built, "this build"));
    if path.is_file() {
        Ok(path)
    } else {
        Err(BoardError::PartMissing { path, named_by })
    }
}
