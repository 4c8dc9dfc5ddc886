//! Programs that come from the system's packages.

use std::path::Path;
use std::process::Stdio;

use anyhow::{Result, bail};

use super::privilege::Privilege;
use super::python;
use crate::process::{describe, find_program, status};
use crate::repository::Repository;

/// Something the system must provide, whoever installed it.
struct Need {
    what: &'static str,
    present: fn(&Repository) -> bool,
    debian_packages: &'static [&'static str],
}

const NEEDS: [Need; 15] = [
    Need {
        what: "a C compiler",
        present: |_| has("cc"),
        debian_packages: &["gcc"],
    },
    Need {
        what: "a C++ compiler",
        present: |_| has("c++") || has("g++"),
        debian_packages: &["g++"],
    },
    Need {
        what: "make",
        present: |_| has("make"),
        debian_packages: &["make"],
    },
    Need {
        what: "cmake",
        present: |_| has("cmake"),
        debian_packages: &["cmake"],
    },
    Need {
        what: "patch",
        present: |_| has("patch"),
        debian_packages: &["patch"],
    },
    Need {
        what: "CPython 3.11 with headers and venv",
        present: python::has_interpreter,
        debian_packages: &["python3.11", "python3.11-dev", "python3.11-venv"],
    },
    Need {
        what: "a C++ compiler for AVR (the lights' firmware)",
        present: |_| has("avr-g++"),
        debian_packages: &["gcc-avr"],
    },
    Need {
        what: "the AVR C library",
        present: |_| exists("/usr/lib/avr/include/avr/io.h"),
        debian_packages: &["avr-libc"],
    },
    Need {
        what: "the Arduino core for AVR",
        present: |_| exists("/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h"),
        debian_packages: &["arduino-core-avr"],
    },
    Need {
        what: "the AVR simulator's library",
        present: |_| exists("/usr/include/simavr/sim_avr.h"),
        debian_packages: &["libsimavr-dev"],
    },
    Need {
        what: "the ELF library's headers",
        present: |_| exists("/usr/include/libelf.h"),
        debian_packages: &["libelf-dev"],
    },
    Need {
        what: "the camera library Aravis (headers)",
        present: |_| exists("/usr/include/aravis-0.8/arv.h"),
        debian_packages: &["libaravis-dev"],
    },
    Need {
        what: "the USB library's headers, which Aravis' own ask for",
        present: |_| exists("/usr/include/libusb-1.0/libusb.h"),
        debian_packages: &["libusb-1.0-0-dev"],
    },
    Need {
        what: "the camera tools of Aravis (arv-tool-0.8, arv-camera-test-0.8)",
        present: |_| has("arv-tool-0.8") && has("arv-camera-test-0.8"),
        // Debian splits them: the second package has the tests and the viewer.
        debian_packages: &["aravis-tools-cli", "aravis-tools"],
    },
    Need {
        what: "cyclictest (the yardstick of the servo loop)",
        present: |_| has("cyclictest"),
        debian_packages: &["rt-tests"],
    },
];

fn has(program: &str) -> bool {
    find_program(program).is_some()
}

fn exists(path: &str) -> bool {
    Path::new(path).exists()
}

fn unmet(repository: &Repository) -> Vec<&'static Need> {
    NEEDS.iter().filter(|need| !(need.present)(repository)).collect()
}

#[expect(clippy::unnecessary_wraps, reason = "the shape that all steps share")]
pub(super) fn missing(repository: &Repository) -> Result<Option<String>> {
    let names: Vec<_> = unmet(repository).iter().map(|need| need.what).collect();
    Ok((!names.is_empty()).then(|| names.join(", ")))
}

pub(super) fn install(repository: &Repository) -> Result<()> {
    let unmet = unmet(repository);
    let packages: Vec<&str> = unmet.iter().flat_map(|need| need.debian_packages).copied().collect();
    if !has("apt-get") {
        let names: Vec<_> = unmet.iter().map(|need| need.what).collect();
        bail!(
            "this system has no apt-get. Install with its own package manager: {}",
            names.join(", ")
        );
    }
    let Some(privilege) = Privilege::detect() else {
        bail!("{}", by_hand(&packages));
    };
    // One broken third-party source makes `update` fail although the packages can be had: let `install` decide.
    if let Err(error) = apt(privilege, &["update", "-q"]) {
        eprintln!("    warning: {error:#}");
    }
    let words: Vec<&str> = ["install", "-y", "-q", "--no-install-recommends"]
        .into_iter()
        .chain(packages)
        .collect();
    apt(privilege, &words)?;
    explain_missing_python(repository)
}

fn by_hand(packages: &[&str]) -> String {
    format!(
        "this user is not root and cannot use sudo. Have root run these two commands, then repeat set-up:\n    \
         apt-get update\n    apt-get install -y {}",
        packages.join(" ")
    )
}

fn apt(privilege: Privilege, words: &[&str]) -> Result<()> {
    let words: Vec<&str> = ["apt-get", "-o", "DPkg::Lock::Timeout=120"]
        .iter()
        .chain(words)
        .copied()
        .collect();
    let mut command = privilege.command(&words);
    if privilege != Privilege::SudoInteractive {
        command.stdin(Stdio::null());
    }
    eprintln!("    $ {}", describe(&command));
    let status = status(command.stdout(std::io::stderr()))?;
    if !status.success() {
        bail!("`{}` ended with {status}.{}", describe(&command), hint(&words));
    }
    Ok(())
}

/// Distributions other than Debian 12 may have no package of that Python: say where else it comes from.
fn hint(words: &[&str]) -> String {
    if words.contains(&"python3.11") {
        format!("\n{}", python::HOW_TO_GET)
    } else {
        String::new()
    }
}

fn explain_missing_python(repository: &Repository) -> Result<()> {
    if python::has_interpreter(repository) {
        return Ok(());
    }
    bail!("{}", python::explain_candidates())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_rights_the_exact_commands_are_named() {
        let text = by_hand(&["cmake", "g++"]);
        assert!(
            text.contains("apt-get update") && text.contains("apt-get install -y cmake g++"),
            "{text}"
        );
    }

    #[test]
    fn a_failed_python_install_says_where_else_to_get_it() {
        assert!(hint(&["install", "python3.11"]).contains("RAKELIGHT_PYTHON"));
        assert_eq!(hint(&["install", "cmake"]), "");
    }
}
