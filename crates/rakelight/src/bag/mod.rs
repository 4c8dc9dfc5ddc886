//! `rakelight bag info|check|cut`: what is in a bag, what is wrong with it, and a part of it.

pub(crate) mod captures;
mod check;
pub(crate) mod cut;
mod info;
pub(crate) mod message;
mod text;

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::{Args, Subcommand};
use recording::{Bag, Damage};
use serde::Serialize;

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Say what is in a bag: files, topics, captures.
    Info(info::Arguments),
    /// Check that a bag is whole and its captures are; exit code 1 when not.
    Check(check::Arguments),
    /// Write a part of a bag as a new one.
    Cut(cut::Arguments),
}

pub(crate) fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.command {
        Command::Info(arguments) => info::run(&arguments),
        Command::Check(arguments) => check::run(&arguments),
        Command::Cut(arguments) => cut::run(&arguments),
    }
}

pub(crate) fn open(path: &Path) -> Result<Bag, Failure> {
    if !path.exists() {
        return Err(Failure::usage(anyhow!("no bag at {}", path.display())));
    }
    Ok(Bag::open(path)?)
}

/// A damage in machine-readable form.
#[derive(Debug, Serialize)]
struct DamageReport {
    file: PathBuf,
    byte: u64,
    reason: String,
}

impl From<&Damage> for DamageReport {
    fn from(damage: &Damage) -> Self {
        Self {
            file: damage.file.clone(),
            byte: damage.offset,
            reason: damage.reason.clone(),
        }
    }
}

pub(crate) fn print_json(value: &impl Serialize) -> Result<(), Failure> {
    println!("{}", serde_json::to_string_pretty(value)?);
    Ok(())
}
