//! Where a benchmark's simulated cell is: at addresses of its own, so that a running cell is left alone.

use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, bail};
use rustix::process::{Pid, Signal, kill_process};
use sim::world::World;
use tokio::process::{Child, Command};

use crate::Domain;

/// As in the launch configs and worlds of the repository.
const PORT: &str = "/tmp/rakelight-lights";
const CAMERAS: [&str; 2] = ["127.0.0.2", "127.0.0.3"];
const ARM: &str = "127.0.0.4";

/// For a node to end.
const PATIENCE: Duration = Duration::from_secs(30);

/// A folder for what the cell needs, and addresses that belong to this process alone.
#[derive(Debug, Clone)]
pub struct Place {
    folder: PathBuf,
}

impl Place {
    /// A place whose files are in a folder that exists.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
        }
    }

    /// The world with its devices here.
    pub fn settle(&self, mut world: World) -> World {
        world.lights.port = Some(self.port());
        for (camera, address) in world.cameras.iter_mut().zip(cameras()) {
            camera.address = address;
        }
        if let Some(arm) = &mut world.arm {
            arm.address = arm_address();
        }
        world
    }

    /// A launch config of the repository whose nodes look for their devices here.
    ///
    /// # Errors
    ///
    /// When a file cannot be read or written.
    pub fn config(&self, name: &str) -> anyhow::Result<PathBuf> {
        let source = repository().join("launch_configs").join(name);
        let text = std::fs::read_to_string(&source).with_context(|| format!("cannot read {}", source.display()))?;
        let folder = source.with_file_name("").display().to_string();
        let mut text = text
            .replace("$(dirname)", &folder)
            .replace("simulator: ", &format!("simulator: {folder}"));
        for (from, to) in CAMERAS.into_iter().zip(cameras()) {
            text = text.replace(from, &to.to_string());
        }
        text = text.replace(ARM, &arm_address().to_string());
        text = text.replace(PORT, &self.port().display().to_string());
        let path = self.folder.join(name);
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(path)
    }

    fn port(&self) -> PathBuf {
        self.folder.join("lights")
    }
}

/// Processes of nodes, as `rakelight up` starts them; they end with this process at the latest.
#[derive(Debug, Default)]
pub struct NodeProcesses {
    processes: Vec<Child>,
}

impl NodeProcesses {
    /// Starts nodes in one process; `command` is the `rakelight` program, alone or below another. Parameters are
    /// `node:name:=value`, in place of the config's.
    ///
    /// # Errors
    ///
    /// When it cannot be started.
    pub fn start(
        &mut self,
        domain: &Domain,
        mut command: Command,
        nodes: &[&str],
        config: &Path,
        parameters: &[&str],
    ) -> anyhow::Result<()> {
        command
            .arg("node")
            .args(nodes)
            .args(["--end-with-stdin", "--config"])
            .arg(config)
            .arg("--ros-args")
            .args(parameters.iter().flat_map(|parameter| ["-p", *parameter]));
        self.start_command(domain, command)
    }

    /// Starts a command that ends with its standard input.
    ///
    /// # Errors
    ///
    /// When it cannot be started.
    pub fn start_command(&mut self, domain: &Domain, mut command: Command) -> anyhow::Result<()> {
        command
            .envs(domain.environment())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .kill_on_drop(true);
        let child = command.spawn().with_context(|| format!("cannot start {command:?}"))?;
        self.processes.push(child);
        Ok(())
    }

    /// Sends all of them a signal.
    ///
    /// # Errors
    ///
    /// When one has ended already.
    pub(crate) fn signal(&self, signal: Signal) -> anyhow::Result<()> {
        for process in &self.processes {
            let id = process.id().and_then(|id| Pid::from_raw(id as i32));
            kill_process(id.context("the process has ended")?, signal)?;
        }
        Ok(())
    }

    /// Ends them, one after the other.
    ///
    /// # Errors
    ///
    /// When one does not end, or not well.
    pub async fn stop(mut self) -> anyhow::Result<()> {
        for process in &mut self.processes {
            drop(process.stdin.take());
            let ended = tokio::time::timeout(PATIENCE, process.wait()).await;
            let status = ended.context("a node does not end")??;
            if !status.success() {
                bail!("a node ended with {status}");
            }
        }
        Ok(())
    }
}

/// The program, from where `cargo xtask bench` has built it.
///
/// # Errors
///
/// When `RAKELIGHT_BIN_DIR` is not set.
pub fn rakelight() -> anyhow::Result<PathBuf> {
    let folder = std::env::var_os("RAKELIGHT_BIN_DIR").map(PathBuf::from);
    let folder = folder.context("RAKELIGHT_BIN_DIR is not set; start this with `cargo xtask bench`")?;
    Ok(folder.join("rakelight"))
}

/// Of the clone that this was built from.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Of loopback, for this process alone.
fn cameras() -> [Ipv4Addr; 2] {
    [1, 2].map(address)
}

fn arm_address() -> Ipv4Addr {
    address(3)
}

fn address(last: u8) -> Ipv4Addr {
    let [.., middle, low] = std::process::id().to_be_bytes();
    Ipv4Addr::new(127, 64 + (middle & 63), low, last)
}
