use std::path::Path;
use std::process::Command;

use crate::build;

/// Framing, sequencer, caps and refusals, and the golden frames: see `firmware/tests/portable_test.cpp`.
#[test]
fn the_hardware_free_part_passes_its_tests_on_this_computer() {
    if build::skip_without(&[build::cxx_need()]) {
        return;
    }
    let sketch = build::firmware_folder().join("rakelight_lights");
    let sources = ["frame.cpp", "sequencer.cpp", "budget.cpp", "controller.cpp"];
    let mut compiler = Command::new("g++");
    compiler
        .args(["-std=c++11", "-Wall", "-Wextra", "-Werror"])
        .args(["-fsanitize=undefined", "-fno-sanitize-recover", "-I"])
        .arg(&sketch)
        .arg(build::firmware_folder().join("tests/portable_test.cpp"))
        .args(sources.map(|source| sketch.join(source)));
    let lock = build::build_lock();
    let program = build::compile(&mut compiler, "portable_test");
    drop(lock);
    build::run(Command::new(program).arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("golden_frames.txt")));
}
