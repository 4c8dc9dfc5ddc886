//! What the supervisor says, and what its children say, on one terminal.

use std::io::{IsTerminal, stderr};
use std::time::Duration;

use anstyle::{AnsiColor, Style};
use indicatif::{ProgressBar, ProgressStyle};
use parking_lot::Mutex;
use serde::Serialize;

/// One after the other for the processes of a cell.
const COLOURS: [AnsiColor; 6] = [
    AnsiColor::Cyan,
    AnsiColor::Green,
    AnsiColor::Magenta,
    AnsiColor::Yellow,
    AnsiColor::Blue,
    AnsiColor::BrightCyan,
];

/// What happens to the cell. For people on standard output, or with `--json` one object a line.
#[derive(Debug, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(super) enum Event<'a> {
    /// A process was started.
    Started {
        process: &'a str,
        pid: u32,
        nodes: &'a [String],
    },
    /// A process ended and is started again after a pause.
    Died {
        process: &'a str,
        how: String,
        restart_in_seconds: f64,
    },
    /// The cell is not ready yet.
    Waiting { waiting_for: String },
    /// A process ended in good order: its nodes have nothing left to do.
    Finished { process: &'a str },
    /// A process did not end when asked and was killed.
    Killed { process: &'a str },
    /// Every node answers.
    Ready(Ready<'a>),
    /// The cell is being taken down.
    Stopping { why: &'a str },
    /// Every process has ended.
    Stopped,
}

/// Where the cell is.
#[derive(Debug, Serialize)]
pub(super) struct Ready<'a> {
    pub(super) namespace: &'a str,
    pub(super) domain_id: u16,
    pub(super) discovery_range: &'a str,
    /// World file of the simulated cell.
    pub(super) simulator: Option<String>,
    pub(super) nodes: Vec<String>,
    pub(super) seconds: f64,
    /// Commands that make sense now.
    pub(super) next: &'a [&'a str],
}

/// The terminal.
pub(super) struct Console {
    json: bool,
    progress: ProgressBar,
    coloured: bool,
    /// Of the longest name of a process, so that their lines align.
    width: usize,
    waited_for: Mutex<Option<String>>,
}

impl Console {
    pub(super) fn new(json: bool, processes: impl Iterator<Item = usize>) -> Self {
        let terminal = stderr().is_terminal();
        let progress = if terminal && !json {
            let style = ProgressStyle::with_template("{spinner} {elapsed} {wide_msg}");
            let bar = ProgressBar::new_spinner();
            style.map_or(bar.clone(), |style| bar.with_style(style))
        } else {
            ProgressBar::hidden()
        };
        Self {
            json,
            progress,
            coloured: terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
            width: processes.max().unwrap_or(0),
            waited_for: Mutex::default(),
        }
    }

    /// A line that a child said.
    pub(super) fn relay(&self, index: usize, process: &str, line: &str) {
        let style = if self.coloured {
            Style::new().fg_color(Some(COLOURS[index % COLOURS.len()].into()))
        } else {
            Style::new()
        };
        let width = self.width;
        self.progress
            .suspend(|| eprintln!("{style}{process:width$} |{style:#} {line}"));
    }

    pub(super) fn tell(&self, event: &Event) {
        let text = if self.json {
            serde_json::to_string(event).unwrap_or_else(|error| error.to_string())
        } else {
            event.for_people()
        };
        self.progress.suspend(|| println!("{text}"));
    }

    /// Tells what is waited for, in a line of its own.
    pub(super) fn still_waiting(&self) {
        let what = self.waited_for.lock().clone();
        if let Some(what) = what {
            self.tell(&Event::Waiting { waiting_for: what });
        }
    }

    /// Shows what is waited for; nothing hides it again.
    pub(super) fn waiting(&self, what: Option<&str>) {
        *self.waited_for.lock() = what.map(str::to_owned);
        match what {
            Some(what) => {
                self.progress.enable_steady_tick(Duration::from_millis(150));
                self.progress.set_message(format!("waiting for {what}"));
            }
            None => self.progress.finish_and_clear(),
        }
    }
}

impl Event<'_> {
    fn for_people(&self) -> String {
        match self {
            Self::Started {
                process,
                pid,
                nodes: [],
            } => {
                format!("rakelight: {process} (process {pid})")
            }
            Self::Started { process, pid, nodes } => {
                format!("rakelight: {process} (process {pid}): {}", nodes.join(", "))
            }
            Self::Died {
                process,
                how,
                restart_in_seconds,
            } => format!("rakelight: {process} ended ({how}); again in {restart_in_seconds} s"),
            Self::Waiting { waiting_for } => format!("rakelight: still waiting for {waiting_for}"),
            Self::Finished { process } => format!("rakelight: {process} has finished"),
            Self::Killed { process } => format!("rakelight: {process} did not end when asked; killed"),
            Self::Ready(ready) => ready.for_people(),
            Self::Stopping { why } => format!("rakelight: {why}; taking the cell down"),
            Self::Stopped => "rakelight: the cell is down".into(),
        }
    }
}

impl Ready<'_> {
    fn for_people(&self) -> String {
        let world = self
            .simulator
            .as_ref()
            .map_or_else(|| "on hardware".into(), |world| format!("simulated, {world}"));
        let next: Vec<String> = self.next.iter().map(|command| format!("  {command}")).collect();
        format!(
            "The cell is ready after {:.1} s: namespace {}, ROS domain {}, {}; {world}.\n  {}\n\
             Try in another terminal, and end the cell here with Ctrl-C:\n{}",
            self.seconds,
            self.namespace,
            self.domain_id,
            self.discovery_range,
            self.nodes.join("\n  "),
            next.join("\n")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_are_told_where_the_cell_is_and_what_to_do_next() {
        let ready = Event::Ready(Ready {
            namespace: "/cell",
            domain_id: 7,
            discovery_range: "this machine only",
            simulator: Some("worlds/table.yaml".into()),
            nodes: vec!["/cell/lights".into(), "/cell/solver".into()],
            seconds: 2.04,
            next: &["rakelight capture"],
        });
        assert_eq!(
            ready.for_people(),
            "The cell is ready after 2.0 s: namespace /cell, ROS domain 7, this machine only; simulated, worlds/table.yaml.\n  \
             /cell/lights\n  /cell/solver\n\
             Try in another terminal, and end the cell here with Ctrl-C:\n  rakelight capture"
        );
        let json = serde_json::to_string(&Event::Died {
            process: "vision",
            how: "signal 9".into(),
            restart_in_seconds: 0.5,
        });
        assert_eq!(
            json.unwrap(),
            r#"{"event":"died","process":"vision","how":"signal 9","restart_in_seconds":0.5}"#
        );
    }
}
