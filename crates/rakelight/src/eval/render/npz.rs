//! Arrays in numpy's archives.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use anyhow::{Context, ensure};
use npyz::{Deserialize, NpyFile, Order};
use zip::ZipArchive;

/// All elements of an array, in the order of C.
pub(super) fn read<T: Deserialize>(path: &Path, name: &str, count: usize) -> anyhow::Result<Vec<T>> {
    read_array(path, name, count).with_context(|| format!("{}, array {name}", path.display()))
}

fn read_array<T: Deserialize>(path: &Path, name: &str, count: usize) -> anyhow::Result<Vec<T>> {
    let mut archive = ZipArchive::new(BufReader::new(File::open(path)?))?;
    let entry: &mut dyn Read = &mut archive.by_name(&format!("{name}.npy"))?;
    let array = NpyFile::new(entry)?;
    ensure!(array.order() == Order::C, "it is in the order of Fortran");
    let found = array.len();
    ensure!(found == count as u64, "it has {found} elements, expected are {count}");
    Ok(array.into_vec()?)
}
