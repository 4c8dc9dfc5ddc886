//! What calibrations of cameras say of themselves, for people.

use camera_calibration::{CameraCalibration, HandEyeReport, Placed, Shortfall, ViewReport};

/// A camera: its numbers with what they are sure to, where in the image it was seen, and its views.
pub(super) fn camera(calibration: &CameraCalibration) -> String {
    let ([fx, fy], [cx, cy], lens) = (
        calibration.camera.focal(),
        calibration.camera.principal(),
        calibration.camera.distortion(),
    );
    let [dfx, dfy, dcx, dcy, dk1, dk2, dp1, dp2, dk3] = calibration.deviations;
    let mut lines = vec![
        format!(
            "{}: {} x {} pixels, RMS {:.3} px, tilt {:.0} degrees",
            calibration.name,
            calibration.camera.width(),
            calibration.camera.height(),
            calibration.rms_px,
            calibration.tilt.to_degrees()
        ),
        format!("  fx {fx:.2} ± {dfx:.2}, fy {fy:.2} ± {dfy:.2}, cx {cx:.2} ± {dcx:.2}, cy {cy:.2} ± {dcy:.2} px"),
        format!(
            "  k1 {:.5} ± {dk1:.5}, k2 {:.5} ± {dk2:.5}, p1 {:.6} ± {dp1:.6}, p2 {:.6} ± {dp2:.6}, k3 {:.5} ± {dk3:.5}",
            lens.k1, lens.k2, lens.p1, lens.p2, lens.k3
        ),
    ];
    lines.extend(views(&calibration.views));
    let share = 100.0 * calibration.coverage.share();
    lines.push(format!("  corners over the image ({share:.0} % of its cells):"));
    lines.extend(calibration.coverage.counts.iter().map(|row| {
        let cells: Vec<String> = row.iter().map(|count| format!("{count:4}")).collect();
        format!("   {}", cells.join(""))
    }));
    lines.extend(shortfalls(&calibration.shortfalls));
    text(&lines)
}

/// A hand-eye calibration's fit.
pub(super) fn hand_eye(report: &HandEyeReport) -> String {
    let mut lines = vec![format!(
        "arm and camera agree to {:.3} mm on the target ({:.3} px; {:.3} px with the arm a little off at every stand)",
        1e3 * report.rms,
        report.rms_px,
        report.image_rms_px
    )];
    lines.extend(views(&report.views));
    lines.extend(shortfalls(&report.shortfalls));
    text(&lines)
}

/// A pose that was found.
pub(super) fn placed(name: &str, placed: &Placed) -> String {
    let [x, y, z] = placed.pose.translation().into();
    let [qx, qy, qz, qw] = placed.pose.quaternion_xyzw();
    let [turn, shift] = placed.deviations;
    format!(
        "{name}: [{x:.6}, {y:.6}, {z:.6}, {qx:.7}, {qy:.7}, {qz:.7}, {qw:.7}] ± {:.3} mm, {:.4} degrees\n",
        1e3 * shift,
        turn.to_degrees()
    )
}

fn views(views: &[ViewReport]) -> impl Iterator<Item = String> {
    let used = views.iter().filter(|view| view.left_out.is_none());
    let worst = used.map(|view| view.rms_px).fold(0.0, f64::max);
    views.iter().map(move |view| {
        if let Some(reason) = &view.left_out {
            return format!("  {}: LEFT OUT: {reason}", view.name);
        }
        let mark = if view.rms_px >= worst { ", the worst" } else { "" };
        format!(
            "  {}: {} corners, RMS {:.3} px{mark}",
            view.name, view.corners, view.rms_px
        )
    })
}

fn shortfalls(shortfalls: &[Shortfall]) -> impl Iterator<Item = String> {
    shortfalls
        .iter()
        .map(|shortfall| format!("  NOT GOOD ENOUGH: {shortfall}"))
}

fn text(lines: &[String]) -> String {
    lines.iter().flat_map(|line| [line.as_str(), "\n"]).collect()
}
