//! `rakelight sim` as a person and a supervisor use it.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU8, Ordering};

use scenarios::{Domain, Program, eventually};
use tempfile::TempDir;

/// The program under test.
const RAKELIGHT: &str = env!("CARGO_BIN_EXE_rakelight");

/// Worlds of this process so far.
static WORLDS: AtomicU8 = AtomicU8::new(0);

/// A small world in a folder of its own, at addresses of its own.
struct World {
    folder: TempDir,
    /// Last number of C1's address; that of C2 is the next.
    first: u8,
}

impl World {
    fn new() -> Self {
        let world = Self {
            folder: tempfile::tempdir().unwrap(),
            first: 2 * WORLDS.fetch_add(1, Ordering::Relaxed) + 2,
        };
        world.write("{}");
        world
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, object: &str) {
        let camera = |last: u8| {
            let [.., high, low] = std::process::id().to_be_bytes();
            format!(
                "{{width: 64, height: 64, address: 127.{}.{low}.{last}}}",
                128 + (high & 63)
            )
        };
        let text = format!(
            "lights: {{port: tty}}\ncameras:\n  c1: {}\n  c2: {}\nobjects:\n- {{shape: pyramid, pose: {object}}}\n",
            camera(self.first),
            camera(self.first + 1)
        );
        // In one go: half a file is not a world.
        std::fs::write(self.path("new.yaml"), text).unwrap();
        std::fs::rename(self.path("new.yaml"), self.path("world.yaml")).unwrap();
    }

    fn sim(&self, arguments: &[&str]) -> Program {
        let world = self.path("world.yaml");
        let arguments = [&["sim", world.to_str().unwrap()], arguments].concat();
        Program::start(&Domain::claim(), RAKELIGHT, &arguments)
    }

    /// None, and a loud word, where the board's tools are not installed.
    async fn served(&self) -> Option<Program> {
        let mut sim = self.sim(&["--end-with-stdin"]);
        eventually("the lights or the end", || {
            sim.count_lines("lights ") == 1 || sim.has_ended().is_some()
        })
        .await;
        if sim.stderr().contains("cargo xtask setup") {
            println!("SKIPPED: {} (cargo xtask setup)", sim.stderr());
            return None;
        }
        Some(sim)
    }
}

#[tokio::test]
async fn it_names_its_devices_says_when_it_is_ready_and_ends_with_its_input() {
    let world = World::new();
    let Some(mut sim) = world.served().await else { return };
    assert!(
        sim.wait_for_line("camera c1")
            .starts_with("camera c1 RAKELIGHT-C1 127.")
    );
    assert!(
        sim.wait_for_line("camera c2")
            .starts_with("camera c2 RAKELIGHT-C2 127.")
    );
    let port = world.path("tty");
    assert_eq!(sim.wait_for_line("lights"), format!("lights {}", port.display()));
    assert!(port.exists(), "the link leads to a port");
    assert!(sim.wait_for_line("rendered in").ends_with(" s"));
    sim.wait_for_line("ready");
    assert!(sim.finish().success());
    assert!(!port.is_symlink(), "the link goes with the board");
}

#[tokio::test]
async fn it_follows_its_file_and_stays_with_the_old_world_when_that_is_wrong() {
    let world = World::new();
    let Some(mut sim) = world.served().await else { return };
    sim.wait_for_line("ready");
    world.write("{x: 0.45}");
    eventually("the changed world", || sim.stderr().contains("world.yaml again")).await;
    world.write("{x: here}");
    eventually("a word about the wrong world", || {
        sim.stderr().contains("the world stays as it was") && sim.stderr().contains("objects[0].pose.x")
    })
    .await;
    assert!(sim.has_ended().is_none());
    world.write("{x: 0.44}");
    eventually("the mended world", || {
        sim.stderr().matches("world.yaml again").count() == 2
    })
    .await;
    assert!(sim.finish().success());
}

#[test]
fn pictures_of_every_light_and_of_the_truth_are_written_without_any_device() {
    let world = World::new();
    let folder = world.path("pictures");
    let mut sim = world.sim(&["--png", folder.to_str().unwrap()]);
    assert!(sim.wait().success(), "{}", sim.stderr());
    for camera in ["c1", "c2"] {
        for name in ["dark", "L1", "L7", "lights", "normals", "depth", "labels"] {
            let path = folder.join(camera).join(format!("{name}.png"));
            let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            assert!(imaging::decode_png(&bytes).is_ok(), "{}", path.display());
        }
    }
}

#[test]
fn a_world_that_is_none_ends_with_the_exit_code_of_bad_usage() {
    let world = World::new();
    world.write("{y: nowhere}");
    let mut sim = world.sim(&[]);
    assert_eq!(sim.wait().code(), Some(2));
    assert!(
        sim.stderr().contains("world.yaml: objects[0].pose.y"),
        "{}",
        sim.stderr()
    );
    let mut sim = world.sim(&["--camera", "c1"]);
    assert_eq!(sim.wait().code(), Some(2));
}
