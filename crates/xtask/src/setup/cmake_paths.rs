//! The wheels' CMake files name the Python of the machine that built them; ours is elsewhere.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result};

use crate::process::capture;
use crate::repository::Repository;
use crate::stamp::files_below;

const BAKED_HEADERS: &str = "/opt/python/cp311-cp311/include/python3.11";
const BAKED_NUMPY: &str = "/opt/python/cp311-cp311/lib/python3.11/site-packages/numpy/_core/include";

/// Writes this environment's header folders into every CMake file below its `share`.
pub(super) fn correct(repository: &Repository) -> Result<()> {
    let ask = |code: &str| -> Result<String> {
        Ok(capture(Command::new(repository.venv_python()).args(["-c", code]))?
            .trim()
            .to_owned())
    };
    let headers = ask("import sysconfig; print(sysconfig.get_paths()['include'])")?;
    let numpy = ask("import numpy; print(numpy.get_include())")?;
    let mut corrected = 0;
    for path in files_below(&repository.venv().join("share"))? {
        if path.extension().is_none_or(|extension| extension != "cmake") {
            continue;
        }
        let text = fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        if let Some(changed) = with_paths(&text, &headers, &numpy) {
            fs::write(&path, changed).with_context(|| format!("cannot write {}", path.display()))?;
            corrected += 1;
        }
    }
    eprintln!("    header folders written into {corrected} CMake files");
    Ok(())
}

/// The text with both folders replaced, or `None` if it names neither.
fn with_paths(text: &str, headers: &str, numpy: &str) -> Option<String> {
    let changed = text.replace(BAKED_NUMPY, numpy).replace(BAKED_HEADERS, headers);
    (changed != text).then_some(changed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_folders_are_replaced_and_other_text_is_left() {
        let text = format!("set(A \"{BAKED_NUMPY};{BAKED_HEADERS}\")\nset(B /opt/python)");
        let expected = "set(A \"/numpy;/headers\")\nset(B /opt/python)";
        assert_eq!(with_paths(&text, "/headers", "/numpy").as_deref(), Some(expected));
        assert_eq!(
            with_paths(expected, "/headers", "/numpy"),
            None,
            "a second run changes nothing"
        );
    }
}
