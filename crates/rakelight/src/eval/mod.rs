//! `rakelight eval`: how far results are from the truth, in figures.

mod normals;
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
    /// Compare solved normals with the truth of path-traced captures.
    Normals(normals::Arguments),
    /// Compare the simulated cameras' images with path-traced captures.
    Render(render::Arguments),
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.what {
        What::Normals(arguments) => normals::run(arguments).await,
        What::Render(arguments) => render::run(arguments).await,
    }
}
