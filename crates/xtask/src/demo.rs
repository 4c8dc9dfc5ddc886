//! `demo`: the release build of `rakelight demo`.

use std::ffi::OsString;
use std::process::{Command, ExitCode};

use anyhow::Result;

use crate::process;
use crate::repository::Repository;
use crate::setup;
use crate::workspace::Workspace;

pub(crate) fn run(repository: &Repository, arguments: &[OsString]) -> Result<ExitCode> {
    setup::ensure(repository)?;
    eprintln!("Building rakelight (release); the first time takes some minutes.");
    process::run(
        process::cargo()
            .args(["build", "--release", "-p", "rakelight"])
            .current_dir(repository.root()),
    )?;
    let program = Workspace::read(repository)?.target_folder()?.join("release/rakelight");
    let status = process::status(Command::new(program).arg("demo").args(arguments))?;
    Ok(process::exit_code(status))
}
