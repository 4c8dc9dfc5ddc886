//! `rakelight eval`: how far results are from the truth, in figures.

mod depth;
mod edges;
mod football;
mod motion;
mod normals;
mod pictures;
mod render;
mod scenes;

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
    /// Compare integrated depth with the truth of path-traced captures.
    Depth(scenes::SceneArguments),
    /// Compare depth edges with the truth of path-traced captures.
    Edges(scenes::SceneArguments),
    /// Compare the normals of a real, photographed football with a fitted sphere.
    Football(football::Arguments),
    /// Compare the simulated cameras' images with path-traced captures.
    Render(render::Arguments),
    /// Plan a pick and compare what it reaches with the arm's limits.
    Motion(motion::Arguments),
}

pub(crate) async fn run(arguments: Arguments) -> Result<(), Failure> {
    match arguments.what {
        What::Normals(arguments) => normals::run(arguments).await,
        What::Depth(arguments) => depth::run(arguments).await,
        What::Edges(arguments) => edges::run(arguments).await,
        What::Football(arguments) => football::run(arguments).await,
        What::Render(arguments) => render::run(arguments).await,
        What::Motion(arguments) => motion::run(arguments).await,
    }
}
