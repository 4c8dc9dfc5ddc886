//! The same camera when it bins its pixels or reads a part of its sensor.

use devices::{Binning, Region};
use geometry::PinholeCamera;

use super::CalibrationFile;
use crate::CameraAravisError;

impl CalibrationFile {
    /// The calibration of the images that a camera with these settings sends. The file is that of whole pixels on the
    /// whole sensor; the region counts pixels after binning, as [`devices::CameraSettings`] does.
    pub fn scaled(&self, binning: Binning, region: Option<Region>) -> Result<Self, CameraAravisError> {
        let (bx, by) = (binning.horizontal, binning.vertical);
        let (width, height) = (self.width, self.height);
        if bx == 0 || by == 0 || bx > width || by > height {
            let what = format!("binning of {bx} x {by}");
            return Err(CameraAravisError::DoesNotFit { what, width, height });
        }
        let (width, height) = (width / bx, height / by);
        let region = region.unwrap_or(Region {
            x: 0,
            y: 0,
            width,
            height,
        });
        if !fits(region.x, region.width, width) || !fits(region.y, region.height, height) {
            let Region {
                x,
                y,
                width: w,
                height: h,
            } = region;
            let what = format!("a region of {w} x {h} at ({x}, {y})");
            return Err(CameraAravisError::DoesNotFit { what, width, height });
        }
        Ok(self.cut(binning, region))
    }

    fn cut(&self, binning: Binning, region: Region) -> Self {
        let factor = [1.0 / f64::from(binning.horizontal), 1.0 / f64::from(binning.vertical)];
        let start = [f64::from(region.x), f64::from(region.y)];
        let mut cut = self.clone();
        (cut.width, cut.height) = (region.width, region.height);
        for axis in 0..2 {
            scale_row(
                &mut cut.camera_matrix[3 * axis..3 * axis + 3],
                factor[axis],
                start[axis],
            );
            scale_row(
                &mut cut.projection_matrix[4 * axis..4 * axis + 4],
                factor[axis],
                start[axis],
            );
        }
        let [fx, _, cx, _, fy, cy, ..] = cut.camera_matrix;
        // Positive and finite as before, and the size is not empty: this does not fail.
        if let Ok(camera) = PinholeCamera::new(cut.width as usize, cut.height as usize, [fx, fy], [cx, cy]) {
            cut.camera = camera.with_distortion(self.camera.distortion());
        }
        cut
    }
}

fn fits(start: u32, length: u32, limit: u32) -> bool {
    length > 0 && start.checked_add(length).is_some_and(|end| end <= limit)
}

/// A row of a projection in pixels. Integer positions are the pixels' centres, so edges scale about -0.5.
fn scale_row(row: &mut [f64], factor: f64, start: f64) {
    for value in &mut *row {
        *value *= factor;
    }
    row[2] += 0.5 * factor - 0.5 - start;
}
