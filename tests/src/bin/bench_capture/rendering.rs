//! How long the simulator needs after a change of the world.

use std::time::Instant;

use sim::render::{RenderOptions, render};
use sim::world::World;

/// Seconds for both cameras together.
#[derive(Clone, Copy)]
pub(crate) struct Rendering {
    /// At 768 x 768.
    pub(crate) binned_s: f64,
    /// At 1536 x 1536.
    pub(crate) full_s: f64,
}

pub(crate) fn measure(world: &World) -> anyhow::Result<Rendering> {
    Ok(Rendering {
        binned_s: both_views(world, 2)?,
        full_s: both_views(world, 1)?,
    })
}

fn both_views(world: &World, binning: u32) -> anyhow::Result<f64> {
    let started = Instant::now();
    for camera in &world.cameras {
        let view = world.view(camera, [binning; 2])?;
        render(&world.scene, &view, &RenderOptions { seed: world.seed })?;
    }
    Ok(started.elapsed().as_secs_f64())
}
