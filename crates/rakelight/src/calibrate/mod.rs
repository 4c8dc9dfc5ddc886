//! `rakelight calibrate`: what a cell has to know of its own parts.

mod lights;

use clap::{Args, Subcommand};

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Fit the panels to captures of a matte white hemisphere at a dozen places on the mat.
    Lights(lights::Arguments),
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.what {
        What::Lights(arguments) => tokio::task::spawn_blocking(move || lights::run(&arguments)).await?,
    }
}
