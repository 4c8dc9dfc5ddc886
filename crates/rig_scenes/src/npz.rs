//! Arrays in numpy's archives.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use npyz::{Deserialize, NpyFile, Order};
use zip::ZipArchive;

use crate::error::SceneError;

/// All elements of an array, in the order of C; refuses an array of another length.
pub fn read_array<T: Deserialize>(path: &Path, name: &str, count: usize) -> Result<Vec<T>, SceneError> {
    let wrong = |reason: String| SceneError::content(path, format!("array {name}: {reason}"));
    let file = File::open(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|error| wrong(error.to_string()))?;
    let entry: &mut dyn Read = &mut archive
        .by_name(&format!("{name}.npy"))
        .map_err(|error| wrong(error.to_string()))?;
    let array = NpyFile::new(entry).map_err(|error| wrong(error.to_string()))?;
    if array.order() != Order::C {
        return Err(wrong("it is in the order of Fortran".to_owned()));
    }
    let found = array.len();
    if found != count as u64 {
        return Err(wrong(format!("it has {found} elements, expected are {count}")));
    }
    array.into_vec().map_err(|error| wrong(error.to_string()))
}
