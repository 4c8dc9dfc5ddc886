//! Where the cell is that a command talks to.

use std::env;
use std::path::Path;

use anyhow::{anyhow, bail};
use ros::{DiscoveryRange, LaunchConfig, Node, NodeOptions};

use crate::failure::Failure;
use crate::running_cell::{self, RunningCell};

/// Variables that say it.
const VARIABLES: [&str; 3] = ["ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY"];

/// Options of a node beside those of the cell: as its launch config says; else as the environment says; else those of
/// the cell that `rakelight up` runs on this machine.
pub(crate) fn options(node: &str, namespace: &str, config: Option<&Path>) -> anyhow::Result<NodeOptions> {
    if let Some(path) = config {
        return Ok(LaunchConfig::read(path)?.node_options(node));
    }
    let options = NodeOptions::new(node).namespace(namespace);
    if VARIABLES.iter().any(|name| env::var_os(name).is_some()) {
        return Ok(options);
    }
    match the_one(RunningCell::all(&running_cell::folder()), namespace)? {
        Some(cell) => Ok(options
            .domain_id(cell.domain_id)
            .discovery_range(cell.discovery_range())),
        // On another host, perhaps.
        None => Ok(options),
    }
}

/// Where a cell is looked for, for errors.
pub(crate) struct Place {
    domain_id: u16,
    range: DiscoveryRange,
}

impl Place {
    pub(crate) fn of(options: &NodeOptions) -> Result<Self, Failure> {
        Ok(Self {
            domain_id: options.resolved_domain_id().map_err(Failure::usage)?,
            range: options.resolved_discovery_range().map_err(Failure::usage)?,
        })
    }

    pub(crate) fn no_cell(&self, node: &Node) -> anyhow::Error {
        let range = match self.range {
            DiscoveryRange::Localhost => "on this machine",
            DiscoveryRange::Subnet => "on the subnet",
        };
        anyhow!(
            "no cell answers in namespace {} of ROS domain {} {range}; bring one up with `rakelight up`, and look at its \
             output if it runs already",
            node.namespace(),
            self.domain_id
        )
    }
}

fn the_one(cells: Vec<RunningCell>, namespace: &str) -> anyhow::Result<Option<RunningCell>> {
    let mut here = cells.into_iter().filter(|cell| cell.namespace == namespace);
    let first = here.next();
    let others: Vec<String> = here.map(|cell| cell.domain_id.to_string()).collect();
    if let (Some(first), false) = (&first, others.is_empty()) {
        bail!(anyhow!(
            "several cells run in namespace {namespace}, in the ROS domains {}, {}; choose one with ROS_DOMAIN_ID or --config",
            first.domain_id,
            others.join(", ")
        ));
    }
    Ok(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cell(namespace: &str, domain_id: u16) -> RunningCell {
        RunningCell {
            pid: 1,
            config: "sim.yaml".into(),
            namespace: namespace.into(),
            domain_id,
            localhost: true,
        }
    }

    #[test]
    fn the_cell_of_this_machine_is_taken_if_there_is_just_one() {
        assert_eq!(the_one(vec![], "/cell").unwrap(), None);
        let one = the_one(vec![cell("/other", 1), cell("/cell", 2)], "/cell").unwrap();
        assert_eq!(one, Some(cell("/cell", 2)));
        let error = the_one(vec![cell("/cell", 2), cell("/cell", 5)], "/cell").unwrap_err();
        assert!(error.to_string().contains("domains 2, 5; choose one"), "{error}");
    }
}
