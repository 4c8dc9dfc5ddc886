//! Builds what the simulated light controller is made of: the firmware for the microcontroller, and the program that
//! simulates it. Where the tools for that are missing the crate still builds, and says what is missing when a board is
//! started.

use std::env;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;

const FIRMWARE: &str = "../light_protocol/firmware";
const SIMAVR_HEADERS: &str = "/usr/include/simavr";
/// A protocol version that no release has.
const OTHER_PROTOCOL: &str = "DEFINES=-DRAKELIGHT_PROTOCOL_VERSION=250";

/// What is needed, by the name that people know, and a file that is there when it is installed.
const FILES: [(&str, &str); 4] = [
    ("avr-libc", "/usr/lib/avr/include/avr/io.h"),
    (
        "arduino-core-avr",
        "/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h",
    ),
    ("libsimavr-dev", "/usr/include/simavr/sim_avr.h"),
    ("libelf-dev", "/usr/include/libelf.h"),
];
const PROGRAMS: [(&str, &str); 3] = [("a C compiler", "cc"), ("make", "make"), ("gcc-avr", "avr-g++")];

fn main() -> Result<(), Box<dyn Error>> {
    for folder in ["rakelight_lights", "simulator", "Makefile"] {
        println!("cargo::rerun-if-changed={FIRMWARE}/{folder}");
    }
    println!("cargo::rerun-if-env-changed=PATH");
    let missing = missing();
    println!("cargo::rustc-env=RAKELIGHT_BOARD_MISSING={}", missing.join(", "));
    let output = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rustc-env=RAKELIGHT_BOARD_FOLDER={}", output.display());
    if missing.is_empty() {
        build_firmware(&output.join("firmware"), None)?;
        build_firmware(&output.join("firmware_other_protocol"), Some(OTHER_PROTOCOL))?;
        build_simulator(&output.join("light_board"))?;
    }
    Ok(())
}

fn missing() -> Vec<&'static str> {
    let files = FILES.iter().filter(|(_, file)| {
        // A file that is not there makes cargo look again in every build.
        println!("cargo::rerun-if-changed={file}");
        !Path::new(file).exists()
    });
    let programs = PROGRAMS.iter().filter(|(_, program)| {
        let there = is_program(program);
        if !there {
            println!("cargo::rerun-if-changed=/usr/bin/{program}");
        }
        !there
    });
    files.chain(programs).map(|(name, _)| *name).collect()
}

fn is_program(name: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&path).any(|folder| folder.join(name).is_file())
}

fn build_firmware(output: &Path, defines: Option<&str>) -> Result<(), Box<dyn Error>> {
    let mut make = Command::new("make");
    make.args(["-C", FIRMWARE])
        .arg(format!("OUT={}", output.display()))
        .args(defines);
    // The cargo that runs this is no make, and must not be taken for one.
    run(make.env_remove("MAKEFLAGS").env_remove("MFLAGS"))
}

fn build_simulator(program: &Path) -> Result<(), Box<dyn Error>> {
    let simulator = Path::new(FIRMWARE).join("simulator");
    let mut compiler = Command::new("cc");
    compiler
        .args(["-O2", "-Wall", "-Wextra", "-isystem", SIMAVR_HEADERS])
        .args(["board.c", "live.c"].map(|source| simulator.join(source)))
        .args(["-lsimavr", "-lelf", "-o"])
        .arg(program);
    run(&mut compiler)
}

fn run(command: &mut Command) -> Result<(), Box<dyn Error>> {
    let output = command.output()?;
    if output.status.success() {
        return Ok(());
    }
    let text = [output.stdout, output.stderr].concat();
    Err(format!("{command:?} failed:\n{}", String::from_utf8_lossy(&text)).into())
}
