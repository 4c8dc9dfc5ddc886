//! Whether the simulated cell has what it needs.

use std::path::Path;

use ros::LaunchConfig;
use sim::board::{BoardConfig, LightBoard};

use super::finding::{Finding, Section};

const SIMULATION: Section = Section("simulated cell");

pub(super) fn check(config: &LaunchConfig) -> Vec<Finding> {
    match &config.cell.simulator {
        Some(world) => vec![world_file(world), board()],
        None => Vec::new(),
    }
}

fn world_file(world: &Path) -> Finding {
    let what = "world";
    if world.is_file() {
        return SIMULATION.ok(what, world.display().to_string()).needed();
    }
    SIMULATION
        .missing(
            what,
            format!("no file at {}", world.display()),
            "correct `simulator` in the launch config",
        )
        .needed()
}

/// Starts one and ends it again: nothing else tells as much.
fn board() -> Finding {
    let what = "light controller";
    match LightBoard::start(&BoardConfig::default(), drop) {
        Ok(_) => SIMULATION.ok(what, "the firmware runs on a simulated board").needed(),
        Err(error) => SIMULATION
            .missing(
                what,
                error.to_string(),
                "cargo xtask setup, which installs avr-gcc and simavr; then build rakelight again",
            )
            .needed(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::finding::Status;
    use super::*;

    fn config(simulator: &str) -> LaunchConfig {
        let text = format!("cell:\n  {simulator}\n  processes: {{}}\n");
        LaunchConfig::parse(&text, "sim.yaml").unwrap()
    }

    #[test]
    fn a_world_that_is_not_there_prevents_the_cell() {
        let findings = check(&config("simulator: no_such_world.yaml"));
        assert_eq!((findings[0].status, findings[0].needed), (Status::Missing, true));
        assert!(findings[0].found.contains("no_such_world.yaml"));
        assert_eq!(check(&config("namespace: /cell")), []);
    }
}
