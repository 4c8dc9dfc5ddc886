//! The cell that picks.

use scenarios::{PickingCell, PickingOptions, rakelight, table_with};
use sim::world::{Scatter, World};

use crate::Arguments;

/// Simulated, with its nodes up as in `launch_configs/sim.yaml`.
pub(crate) async fn start(arguments: &Arguments) -> anyhow::Result<PickingCell> {
    let processes = vec![
        vec!["light_sequencer"],
        vec!["camera_capture", "normal_solver", "grasp_planner"],
        vec!["trajectory_executor"],
        vec!["cell_coordinator"],
    ];
    let options = PickingOptions {
        program: rakelight()?,
        processes,
        parameters: Vec::new(),
    };
    PickingCell::start(world(arguments, arguments.seed)?, options).await
}

/// Clutter in place of the default world's objects.
pub(crate) fn world(arguments: &Arguments, seed: u64) -> anyhow::Result<World> {
    let mut world = table_with("objects: []")?;
    let scatter = Scatter {
        seed,
        count: arguments.objects,
        shapes: arguments.shapes.clone(),
        ..Scatter::default()
    };
    world.scene.bodies = scatter.bodies(&[])?;
    Ok(world)
}
