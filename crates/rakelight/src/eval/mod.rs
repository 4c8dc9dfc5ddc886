//! `rakelight eval`: how far results are from the truth, in figures.

mod render;

use clap::{Args, Subcommand};

use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Compare the simulated cameras' images with path-traced captures.
    Render(render::Arguments),
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.what {
        What::Render(arguments) => render::run(arguments).await,
    }
}
