//! The file's keys as they are written.

use std::fmt::Write;

use serde::Deserialize;

#[derive(Debug, Deserialize)]
pub(super) struct Document {
    pub(super) image_width: i64,
    pub(super) image_height: i64,
    pub(super) camera_name: String,
    pub(super) camera_matrix: Matrix,
    pub(super) distortion_model: String,
    pub(super) distortion_coefficients: Matrix,
    pub(super) rectification_matrix: Matrix,
    pub(super) projection_matrix: Matrix,
}

#[derive(Debug, Deserialize)]
pub(super) struct Matrix {
    pub(super) rows: usize,
    pub(super) cols: usize,
    pub(super) data: Vec<f64>,
}

impl Matrix {
    pub(super) fn new((rows, cols): (usize, usize), data: &[f64]) -> Self {
        Self {
            rows,
            cols,
            data: data.to_vec(),
        }
    }

    pub(super) fn shape(&self) -> String {
        format!("{} x {} with {} numbers", self.rows, self.cols, self.data.len())
    }
}

/// In the order and with the layout of `camera_calibration`, which serialisers of YAML do not keep.
pub(super) fn write(document: &Document) -> String {
    let mut text = format!(
        "image_width: {}\nimage_height: {}\ncamera_name: {}\n",
        document.image_width,
        document.image_height,
        quoted(&document.camera_name)
    );
    write_matrix(&mut text, "camera_matrix", &document.camera_matrix);
    // `String` never fails to take text.
    let _ = writeln!(text, "distortion_model: {}", quoted(&document.distortion_model));
    write_matrix(&mut text, "distortion_coefficients", &document.distortion_coefficients);
    write_matrix(&mut text, "rectification_matrix", &document.rectification_matrix);
    write_matrix(&mut text, "projection_matrix", &document.projection_matrix);
    text
}

/// A name with a colon or a quote in it must not become something else.
fn quoted(name: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let starts_well = name.starts_with(|letter: char| letter.is_ascii_alphabetic());
    if starts_well && name.chars().all(plain) {
        name.to_owned()
    } else {
        format!("{name:?}")
    }
}

fn write_matrix(text: &mut String, key: &str, matrix: &Matrix) {
    let values: Vec<String> = matrix.data.iter().map(|value| format!("{value:?}")).collect();
    let _ = writeln!(
        text,
        "{key}:\n  rows: {}\n  cols: {}\n  data: [{}]",
        matrix.rows,
        matrix.cols,
        values.join(", ")
    );
}
