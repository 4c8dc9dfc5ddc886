//! `cargo xtask`: makes a clone ready to work and runs what people run in it.
//!
//! It is a program of its own, in a workspace of its own, because the main workspace cannot even be resolved before
//! `setup` has put the patched RustDDS in place. It holds no product code: `demo` and `bench` build and call the
//! programs of the main workspace.

mod bench;
mod demo;
mod process;
mod repository;
mod setup;
mod stamp;
mod test;
mod workspace;

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};

use crate::repository::Repository;

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    about = "Set up, try, test and measure Rakelight from a clone",
    version
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Install and build what is missing: system packages, tools, patched RustDDS, Python environment, ROS messages
    Setup {
        /// Only say what is missing; exit code 1 if anything is
        #[arg(long)]
        check: bool,
    },
    /// Build the release binary and run `rakelight demo`; what follows is passed on
    Demo {
        /// Arguments for `rakelight demo`
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Formatting, lints, Rust tests, documentation and the tests with rclpy clients
    Test,
    /// Build and run one benchmark; what follows `--` is passed on
    Bench {
        /// Name of the benchmark, such as `transport`
        name: String,
        /// Print the result as one JSON object, the last thing on standard output
        #[arg(long)]
        json: bool,
        /// Arguments for the benchmark, such as `--help`
        #[arg(last = true)]
        arguments: Vec<OsString>,
    },
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    run(arguments.command).unwrap_or_else(|error| {
        eprintln!("\nerror: {error:#}");
        ExitCode::FAILURE
    })
}

fn run(command: Command) -> Result<ExitCode> {
    let repository = Repository::locate()?;
    match command {
        Command::Setup { check: true } => setup::check(&repository),
        Command::Setup { check: false } => setup::run(&repository),
        Command::Demo { arguments } => demo::run(&repository, &arguments),
        Command::Test => test::run(&repository),
        Command::Bench { name, json, arguments } => bench::run(&repository, &name, json, &arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        <Arguments as clap::CommandFactory>::command().debug_assert();
    }

    #[test]
    fn demo_passes_options_through_with_and_without_a_separator() {
        for line in [&["x", "demo", "--football"][..], &["x", "demo", "--", "--football"]] {
            let Command::Demo { arguments } = Arguments::parse_from(line).command else {
                panic!("{line:?} is not the demo command")
            };
            assert_eq!(arguments, ["--football"]);
        }
    }

    #[test]
    fn bench_passes_on_what_follows_the_separator() {
        let line = ["x", "bench", "motion", "--json", "--", "--servo-seconds", "5"];
        let Command::Bench { name, json, arguments } = Arguments::parse_from(line).command else {
            panic!("{line:?} is not the bench command")
        };
        assert_eq!((name.as_str(), json), ("motion", true));
        assert_eq!(arguments, ["--servo-seconds", "5"]);
    }
}
