//! `rakelight calibrate target`: the board to print.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::Args;

use super::shots::Board;
use crate::failure::Failure;

#[derive(Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    board: Board,
    /// Where the drawing goes (SVG).
    #[arg(short, long, value_name = "FILE", default_value = "target.svg")]
    output: PathBuf,
    /// Replace a drawing that is there.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let output = &arguments.output;
    let target = arguments.board.target()?;
    if output.exists() && !arguments.force {
        let problem = anyhow!("{} is there already; --force replaces it", output.display());
        return Err(Failure::usage(problem));
    }
    std::fs::write(output, target.to_svg()).with_context(|| output.display().to_string())?;
    let [width, height] = target.size().map(|side| 1e3 * side);
    println!(
        "written: {}; print it at 100 %, glue it to something flat, and measure that the pattern is {width:.1} x \
         {height:.1} mm",
        output.display()
    );
    Ok(())
}
