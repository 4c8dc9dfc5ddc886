//! The numpy solver as a process beside.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, ensure};
use geometry::nalgebra::Point3;
use imaging::Mask;
use photometric::Capture;

/// Milliseconds that numpy takes for the normals of the same pixels; none where Python or numpy is missing.
pub(crate) fn numpy_ms(capture: &Capture<'_>, mask: &Mask) -> anyhow::Result<Option<f64>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("peers/photometric_peer.py");
    let has_numpy = Command::new("python")
        .args(["-c", "import numpy"])
        .stderr(Stdio::null())
        .status();
    if !has_numpy.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: python with numpy is missing (cargo xtask setup)");
        return Ok(None);
    }
    let mut peer = Command::new("python")
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()?;
    let mut input = peer.stdin.take().context("the peer has an input")?;
    input.write_all(&request(capture, mask))?;
    drop(input);
    let output = peer.wait_with_output()?;
    ensure!(output.status.success(), "the peer failed");
    Ok(Some(String::from_utf8_lossy(&output.stdout).trim().parse()?))
}

/// Number of lights and pixels, light vectors at the middle of the mat, samples light by light; 64-bit numbers.
fn request(capture: &Capture<'_>, mask: &Mask) -> Vec<u8> {
    let inside: Vec<usize> = (0..mask.as_image().pixels().len())
        .filter(|&index| mask.as_image().pixels()[index] != 0)
        .collect();
    let panels = capture.rig.panels();
    let mut numbers = vec![panels.len() as f64, inside.len() as f64];
    for panel in panels {
        numbers.extend(panel.light_vector(&Point3::new(0.43, 0.0, 0.015)).iter());
    }
    let dark = capture.stack.dark().pixels();
    for image in panels.iter().filter_map(|panel| capture.stack.light(panel.channel)) {
        numbers.extend(
            inside
                .iter()
                .map(|&index| f64::from(image.pixels()[index]) - f64::from(dark[index])),
        );
    }
    numbers.into_iter().flat_map(f64::to_le_bytes).collect()
}
