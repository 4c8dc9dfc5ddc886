//! The whole simulated cell by the commands that a user has: up, picks, replays of what was recorded.

use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::time::Instant;

use anyhow::{Context, anyhow};
use tokio::process::Command;

use super::cell::Cell;
use super::summary::{self, Outcome};
use crate::failure::Failure;
use crate::up::locate;

const WORLD: &str = "launch_configs/worlds/pick.yaml";

/// More runs than anybody keeps.
const MOST_RUNS: u32 = 10_000;

pub(super) async fn run(output: &Path, count: u32, world: Option<PathBuf>) -> Result<(), Failure> {
    let started = Instant::now();
    let world = match world {
        Some(world) => world,
        None => default_world()?,
    };
    let folder = new_run(output)?;
    let bags = folder.join("bags");
    std::fs::create_dir_all(&bags).with_context(|| format!("cannot create {}", bags.display()))?;

    let (bags_text, world, count) = (
        bags.display().to_string(),
        world.display().to_string(),
        count.to_string(),
    );
    let up = ["up", "--world", &world];
    say(
        1,
        "the simulated cell: lights' firmware, cameras, arm, and every node",
        &up,
    );
    let log = folder.join("up.log");
    let (cell, seconds) = Cell::up(&up, &log).await?;
    println!("  ready after {seconds:.1} s; what its nodes say: {}", log.display());

    let pick = ["pick", "--count", &count, "--record", &bags_text];
    say(2, "capture, solve, plan, pick, verify, once for each object", &pick);
    let (picked, lines) = own_with_output(&pick, &["--json"]).await?;
    cell.down().await?;

    say(
        3,
        "what was recorded, solved and planned anew",
        &["replay", "BAG", "--resolve", "--png", "DIR"],
    );
    let mut replays = Vec::new();
    for bag in recorded(&bags)? {
        replays.push(replay(&bag, &folder).await?);
    }
    let outcome = Outcome {
        lines,
        replays,
        folder,
        seconds: started.elapsed().as_secs_f64(),
    };
    println!("\n{}", summary::text(&outcome));
    if !picked.success() {
        return Err(anyhow!("not everything is in the bin; the lines above say why").into());
    }
    if outcome.replays.iter().any(|replay| !replay.same) {
        return Err(anyhow!("a replay gave other results than were recorded; the lines above say which").into());
    }
    Ok(())
}

fn default_world() -> anyhow::Result<PathBuf> {
    let repository = locate::repository();
    let repository =
        repository.with_context(|| format!("no {WORLD} here or above this program; name one with --world"))?;
    Ok(repository.join(WORLD))
}

/// A folder that no other run has.
fn new_run(output: &Path) -> anyhow::Result<PathBuf> {
    for number in 1..=MOST_RUNS {
        let folder = output.join(format!("run_{number}"));
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(std::path::absolute(folder)?),
            Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error).with_context(|| format!("cannot create {}", folder.display())),
        }
    }
    Err(anyhow!("{} holds {MOST_RUNS} runs; remove some", output.display()))
}

fn say(step: u32, what: &str, command: &[&str]) {
    println!("\n{step}/3 {what}\n  $ rakelight {}", command.join(" "));
}

/// This program with other arguments; what it writes is read, what it says of its progress is shown.
async fn own_with_output(arguments: &[&str], more: &[&str]) -> anyhow::Result<(ExitStatus, Vec<serde_json::Value>)> {
    let child = Command::new(std::env::current_exe()?)
        .args(arguments)
        .args(more)
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .kill_on_drop(true)
        .output();
    let output = child.await?;
    let text = String::from_utf8_lossy(&output.stdout);
    let lines = text
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    Ok((output.status, lines))
}

/// A bag that was recorded, solved and planned again.
pub(super) struct Replay {
    pub(super) bag: PathBuf,
    pub(super) pictures: PathBuf,
    pub(super) same: bool,
}

async fn replay(bag: &Path, folder: &Path) -> anyhow::Result<Replay> {
    let name = bag.file_name().map(|name| name.to_string_lossy().into_owned());
    let pictures = folder.join("pictures").join(name.unwrap_or_default());
    std::fs::create_dir_all(&pictures).with_context(|| format!("cannot create {}", pictures.display()))?;
    println!(
        "  $ rakelight replay {} --resolve --png {}",
        bag.display(),
        pictures.display()
    );
    let status = Command::new(std::env::current_exe()?)
        .arg("replay")
        .arg(bag)
        .args(["--resolve", "--png"])
        .arg(&pictures)
        .stdin(Stdio::null())
        .kill_on_drop(true)
        .status()
        .await?;
    Ok(Replay {
        bag: bag.to_owned(),
        pictures,
        same: status.success(),
    })
}

fn recorded(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut bags: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.is_dir())
        .collect();
    bags.sort();
    Ok(bags)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_run_has_a_folder_of_its_own() {
        let output = tempfile::tempdir().unwrap();
        let [first, second] = [1, 2].map(|_| new_run(output.path()).unwrap());
        assert!(first.ends_with("run_1") && second.ends_with("run_2"));
        assert!(new_run(&output.path().join("nowhere")).is_err());
    }

    #[test]
    fn bags_are_folders_in_order() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["cycle_2", "cycle_1"] {
            std::fs::create_dir(folder.path().join(name)).unwrap();
        }
        std::fs::write(folder.path().join("notes.txt"), "").unwrap();
        let names: Vec<_> = recorded(folder.path()).unwrap();
        assert_eq!(names, ["cycle_1", "cycle_2"].map(|name| folder.path().join(name)));
    }
}
