//! What the doctor says of this machine.

use std::process::Command;

use serde_json::Value;

use super::{Config, RAKELIGHT};

/// Exit code and report.
fn examine(config: &Config, variables: &[(&str, &str)]) -> (Option<i32>, Value) {
    let output = Command::new(RAKELIGHT)
        .args(["doctor", "--json", "--config", config.as_str()])
        .env_remove("ROS_DOMAIN_ID")
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    let report = serde_json::from_slice(&output.stdout).unwrap();
    (output.status.code(), report)
}

fn finding<'a>(report: &'a Value, what: &str) -> &'a Value {
    let findings = report["findings"].as_array().unwrap();
    findings.iter().find(|finding| finding["what"] == what).unwrap()
}

#[test]
fn a_cell_without_devices_runs_anywhere() {
    let (code, report) = examine(&Config::replay(), &[("ROS_DOMAIN_ID", "12")]);
    assert_eq!(code, Some(0), "{report:#}");
    assert_eq!(report["can_run"], true);
    assert_eq!(finding(&report, "domain")["found"], "12");
    for what in [
        "socket buffers",
        "packet socket",
        "open files",
        "disk space",
        "time of day",
        "clock source",
    ] {
        assert_ne!(finding(&report, what)["found"], "", "{what}");
    }
}

#[test]
fn a_domain_that_cannot_be_is_missing_with_what_to_do() {
    let (code, report) = examine(&Config::replay(), &[("ROS_DOMAIN_ID", "500")]);
    assert_eq!((code, &report["can_run"]), (Some(1), &false.into()));
    let domain = finding(&report, "domain");
    assert_eq!(domain["status"], "missing");
    assert!(domain["advice"].as_str().unwrap().contains("0 to 101"), "{domain}");
}
