//! Builds the firmware and the programs that test it, with the system's compilers.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

const SIMAVR_HEADERS: &str = "/usr/include/simavr";
const ARDUINO_CORE: &str = "/usr/share/arduino/hardware/arduino/avr/cores/arduino/Arduino.h";

pub(crate) fn firmware_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("firmware")
}

/// Where everything is built. Several test processes may come at the same time: build under [`build_lock`], and put a
/// program in place by renaming it.
pub(crate) fn output_folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("firmware");
    std::fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

/// Held until the file is dropped.
pub(crate) fn build_lock() -> File {
    let lock = File::create(output_folder().join("lock")).expect("the target folder is writable");
    lock.lock().expect("the file system knows locks");
    lock
}

/// Runs a compiler that writes to the path put behind its arguments, and puts the result in place as `name`.
pub(crate) fn compile(compiler: &mut Command, name: &str) -> PathBuf {
    let program = output_folder().join(name);
    let unfinished = program.with_extension("new");
    run(compiler.arg("-o").arg(&unfinished));
    std::fs::rename(&unfinished, &program).expect("the target folder is writable");
    program
}

fn has(program: &str) -> bool {
    let version = Command::new(program)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    version.is_ok_and(|status| status.success())
}

/// Runs a build step; its output is the failure's text.
pub(crate) fn run(command: &mut Command) {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let text = [output.stdout, output.stderr].concat();
    assert!(
        output.status.success(),
        "{command:?} failed:\n{}",
        String::from_utf8_lossy(&text)
    );
}

/// Says loudly what is missing, if anything is.
pub(crate) fn skip_without(needs: &[(&str, bool)]) -> bool {
    let missing: Vec<&str> = needs
        .iter()
        .filter(|(_, there)| !there)
        .map(|(what, _)| *what)
        .collect();
    if missing.is_empty() {
        return false;
    }
    println!("SKIPPED: not installed: {} (cargo xtask setup)", missing.join(", "));
    true
}

pub(crate) fn cxx_need() -> (&'static str, bool) {
    ("g++", has("g++"))
}

/// What the simulation needs of this machine.
pub(crate) fn simulation_needs() -> Vec<(&'static str, bool)> {
    vec![
        ("cc", has("cc")),
        ("make", has("make")),
        ("gcc-avr", has("avr-g++")),
        ("arduino-core-avr", Path::new(ARDUINO_CORE).exists()),
        ("libsimavr-dev", Path::new(SIMAVR_HEADERS).join("sim_avr.h").exists()),
        ("libelf-dev", Path::new("/usr/include/libelf.h").exists()),
    ]
}

/// The program that simulates, and the firmware for it.
pub(crate) struct Built {
    pub(crate) host: PathBuf,
    pub(crate) firmware: PathBuf,
}

/// Built once per process.
pub(crate) fn simulation() -> &'static Built {
    static BUILT: OnceLock<Built> = OnceLock::new();
    BUILT.get_or_init(|| {
        let _lock = build_lock();
        let output = output_folder();
        run(Command::new("make")
            .arg("-C")
            .arg(firmware_folder())
            .arg(format!("OUT={}", output.display())));
        let mut compiler = Command::new("cc");
        compiler
            .args(["-O2", "-Wall", "-Wextra", "-Werror", "-isystem", SIMAVR_HEADERS])
            .args(["board.c", "scripted.c"].map(|source| firmware_folder().join("simulator").join(source)))
            .args(["-lsimavr", "-lelf"]);
        Built {
            host: compile(&mut compiler, "scripted"),
            firmware: output.join("rakelight_lights.elf"),
        }
    })
}
