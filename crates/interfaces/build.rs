//! Generates the Rust types of every interface file, and those of the grammar test package for this crate's tests.

use std::path::{Path, PathBuf};
use std::{env, fs};

use interface_generator::{Packages, write_rust};

type Failure = Box<dyn std::error::Error>;

fn main() {
    if let Err(error) = generate() {
        println!("cargo::error={error}");
        std::process::exit(1);
    }
}

fn generate() -> Result<(), Failure> {
    let crate_folder = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out_folder = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rerun-if-changed=build.rs");

    let mut packages = Packages::new();
    let mut written = add_packages_in(&mut packages, &crate_folder.join("standard"))?;
    written.extend(add_packages_in(&mut packages, &crate_folder.join("../../msgs"))?);
    let tested = add_packages_in(
        &mut packages,
        &crate_folder.join("../interface_generator/tests/packages"),
    )?;
    packages.resolve()?;

    write(&packages, &written, "crate", &out_folder.join("interfaces.rs"))?;
    write(
        &packages,
        &tested,
        "::interfaces",
        &out_folder.join("test_interfaces.rs"),
    )?;
    for source in packages.sources() {
        println!("cargo::rerun-if-changed={}", source.display());
    }
    Ok(())
}

/// Adds every sub-folder of `folder` as a package of that name, sorted.
fn add_packages_in(packages: &mut Packages, folder: &Path) -> Result<Vec<String>, Failure> {
    println!("cargo::rerun-if-changed={}", folder.display());
    let unreadable = |error| format!("cannot read {}: {error}", folder.display());
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        if entry.file_type()?.is_dir() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    names.sort();
    for name in &names {
        packages.add_folder(name, &folder.join(name))?;
    }
    Ok(names)
}

fn write(packages: &Packages, written: &[String], runtime: &str, path: &Path) -> Result<(), Failure> {
    let written: Vec<&str> = written.iter().map(String::as_str).collect();
    fs::write(path, write_rust(packages, &written, runtime)?)?;
    Ok(())
}
