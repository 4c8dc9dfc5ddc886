//! What a check found, and how it is told.

use std::fmt::Write;

use serde::Serialize;

/// How good it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Status {
    /// As it should be.
    Ok,
    /// The cell runs, but not as well as it could.
    Warn,
    /// Something does not work without it.
    Missing,
}

/// One line of the report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    pub(super) section: &'static str,
    pub(super) what: String,
    pub(super) status: Status,
    /// What was found.
    pub(super) found: String,
    /// What to do about it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) advice: Option<String>,
    /// Whether the cell cannot run while this is missing.
    pub(super) needed: bool,
}

/// Makes the findings of one section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Section(pub(super) &'static str);

impl Section {
    pub(super) fn ok(self, what: impl Into<String>, found: impl Into<String>) -> Finding {
        self.finding(Status::Ok, what, found, None)
    }

    pub(super) fn warn(self, what: impl Into<String>, found: impl Into<String>, advice: impl Into<String>) -> Finding {
        self.finding(Status::Warn, what, found, Some(advice.into()))
    }

    pub(super) fn missing(
        self,
        what: impl Into<String>,
        found: impl Into<String>,
        advice: impl Into<String>,
    ) -> Finding {
        self.finding(Status::Missing, what, found, Some(advice.into()))
    }

    fn finding(
        self,
        status: Status,
        what: impl Into<String>,
        found: impl Into<String>,
        advice: Option<String>,
    ) -> Finding {
        Finding {
            section: self.0,
            what: what.into(),
            status,
            found: found.into(),
            advice,
            needed: false,
        }
    }
}

impl Finding {
    /// The cell cannot run while this is missing.
    #[must_use]
    pub(super) fn needed(mut self) -> Self {
        self.needed = true;
        self
    }

    fn prevents_the_cell(&self) -> bool {
        self.needed && self.status == Status::Missing
    }
}

/// All that was found.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// The launch config that the cell would be brought up with.
    pub(super) config: String,
    /// Whether it can be.
    pub(super) can_run: bool,
    pub(super) findings: Vec<Finding>,
}

impl Report {
    pub(super) fn new(config: String, findings: Vec<Finding>) -> Self {
        Self {
            config,
            can_run: !findings.iter().any(Finding::prevents_the_cell),
            findings,
        }
    }

    /// A line for each finding, by section, and a summary.
    pub(super) fn for_people(&self) -> String {
        let width = self.findings.iter().map(|f| f.what.chars().count()).max().unwrap_or(0);
        let mut text = String::new();
        let mut section = "";
        for finding in &self.findings {
            if finding.section != section {
                section = finding.section;
                text.push_str(section);
                text.push('\n');
            }
            let status = match finding.status {
                Status::Ok => "ok",
                Status::Warn => "warn",
                Status::Missing => "missing",
            };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "  {status:7}  {:width$}  {}", finding.what, finding.found);
            if let Some(advice) = &finding.advice {
                let _ = writeln!(text, "  {:7}  {:width$}  -> {advice}", "", "");
            }
        }
        text.push_str(&self.summary());
        text
    }

    fn summary(&self) -> String {
        let count = |status| self.findings.iter().filter(|f| f.status == status).count();
        format!(
            "{} missing, {} to improve: the cell of {} {}",
            count(Status::Missing),
            count(Status::Warn),
            self.config,
            if self.can_run { "can run" } else { "cannot run" }
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_finding_says_what_is_there_and_what_to_do() {
        let (lights, ros) = (Section("lights"), Section("ROS"));
        let findings = vec![
            lights
                .missing("AVR compiler", "no avr-g++", "sudo apt-get install gcc-avr")
                .needed(),
            lights.ok("serial ports", "/dev/ttyACM0"),
            ros.warn("domain", "0, as everybody has", "set ROS_DOMAIN_ID"),
        ];
        insta::assert_snapshot!(Report::new("sim.yaml".into(), findings.clone()).for_people(), @"
        lights
          missing  AVR compiler  no avr-g++
                                 -> sudo apt-get install gcc-avr
          ok       serial ports  /dev/ttyACM0
        ROS
          warn     domain        0, as everybody has
                                 -> set ROS_DOMAIN_ID
        1 missing, 1 to improve: the cell of sim.yaml cannot run
        ");
        assert!(Report::new("sim.yaml".into(), findings[1..].to_vec()).can_run);
    }
}
