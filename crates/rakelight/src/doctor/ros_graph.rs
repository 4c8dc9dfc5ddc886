//! What the environment says of ROS, and which cells run here.

use std::path::Path;

use ros::{DiscoveryRange, NodeOptions};

use super::finding::{Finding, Section};
use crate::running_cell::RunningCell;

const ROS: Section = Section("ROS");

/// `options` are those that a node of the cell would be started with; what they leave open, the environment says.
pub(super) fn check(options: &NodeOptions, running: &Path) -> Vec<Finding> {
    vec![domain(options), range(options), cells(running)]
}

fn domain(options: &NodeOptions) -> Finding {
    let what = "domain";
    match options.resolved_domain_id() {
        Ok(id) => ROS.ok(what, id.to_string()).needed(),
        Err(error) => ROS
            .missing(
                what,
                error.to_string(),
                "unset ROS_DOMAIN_ID, or choose one of 0 to 101",
            )
            .needed(),
    }
}

fn range(options: &NodeOptions) -> Finding {
    let what = "discovery range";
    match options.resolved_discovery_range() {
        Ok(DiscoveryRange::Localhost) => ROS.ok(what, "this machine only").needed(),
        Ok(DiscoveryRange::Subnet) => ROS.ok(what, "the whole subnet").needed(),
        Err(error) => ROS
            .missing(
                what,
                error.to_string(),
                "unset ROS_AUTOMATIC_DISCOVERY_RANGE, or set it to LOCALHOST or SUBNET",
            )
            .needed(),
    }
}

fn cells(running: &Path) -> Finding {
    let cells: Vec<String> = RunningCell::all(running)
        .iter()
        .map(|cell| format!("{} in domain {} (process {})", cell.namespace, cell.domain_id, cell.pid))
        .collect();
    let found = if cells.is_empty() {
        "none".to_owned()
    } else {
        cells.join(", ")
    };
    ROS.ok("running cells", found)
}

#[cfg(test)]
mod tests {
    use super::super::finding::Status;
    use super::*;

    #[test]
    fn what_a_node_would_join_is_told() {
        let options = NodeOptions::new("doctor")
            .domain_id(7)
            .discovery_range(DiscoveryRange::Localhost);
        let findings = check(&options, Path::new("/nowhere"));
        let found: Vec<&str> = findings.iter().map(|finding| finding.found.as_str()).collect();
        assert_eq!(found, ["7", "this machine only", "none"]);
        let bad = domain(&options.domain_id(150));
        assert_eq!((bad.status, bad.needed), (Status::Missing, true));
    }
}
