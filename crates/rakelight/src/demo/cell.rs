//! The cell of the demo: `rakelight up` as a child, whose words go into a file.

use std::fs::File;
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use indicatif::ProgressBar;
use tokio::io::{AsyncBufReadExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};

/// Rendering and discovery take seconds; on a busy machine, a minute.
const START: Duration = Duration::from_mins(3);
const END: Duration = Duration::from_secs(30);

/// A running cell. It ends when this is dropped.
pub(super) struct Cell {
    child: Child,
    /// Closing it asks the cell to end.
    stdin: Option<ChildStdin>,
    events: Lines<BufReader<ChildStdout>>,
}

impl Cell {
    /// Brings it up and waits until it is ready; gives the seconds that this took too.
    pub(super) async fn up(arguments: &[&str], log: &Path) -> anyhow::Result<(Self, f64)> {
        let file = File::create(log).with_context(|| format!("cannot create {}", log.display()))?;
        let mut child = Command::new(std::env::current_exe()?)
            .args(arguments)
            .args(["--json", "--end-with-stdin"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(file)
            .process_group(0)
            .kill_on_drop(true)
            .spawn()?;
        let output = child.stdout.take().context("the cell has no output")?;
        let mut cell = Self {
            stdin: child.stdin.take(),
            child,
            events: BufReader::new(output).lines(),
        };
        let ready = tokio::time::timeout(START, cell.ready()).await;
        let seconds = ready.map_err(|_| anyhow!("the cell is not ready after {START:?}; see {}", log.display()))?;
        let seconds = seconds.with_context(|| format!("see {}", log.display()))?;
        Ok((cell, seconds))
    }

    async fn ready(&mut self) -> anyhow::Result<f64> {
        let progress = ProgressBar::new_spinner().with_message("rendering the world, starting the nodes");
        progress.enable_steady_tick(Duration::from_millis(150));
        while let Some(line) = self.events.next_line().await? {
            let event: serde_json::Value = serde_json::from_str(&line).unwrap_or_default();
            if event["event"] == "ready" {
                progress.finish_and_clear();
                return Ok(event["seconds"].as_f64().unwrap_or_default());
            }
        }
        progress.finish_and_clear();
        bail!("the cell ended before it was ready")
    }

    /// Takes it down in good order.
    pub(super) async fn down(mut self) -> anyhow::Result<()> {
        drop(self.stdin.take());
        // What it says while it ends is not needed, but the pipe must not fill.
        let end = async {
            while let Ok(Some(_)) = self.events.next_line().await {}
            self.child.wait().await
        };
        let status = tokio::time::timeout(END, end).await;
        let status = status.map_err(|_| anyhow!("the cell does not end within {END:?}"))??;
        if !status.success() {
            bail!("the cell ended with {status}");
        }
        Ok(())
    }
}
