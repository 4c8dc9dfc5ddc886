//! What becomes of the processes.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use scenarios::{Domain, Program, TIMEOUT};
use serde_json::Value;

use super::{Config, rakelight};

/// A running cell, followed by its `--json` events.
struct Cell {
    up: Program,
}

impl Cell {
    fn up(domain: &Domain, config: &Config) -> Self {
        let up = rakelight(domain, &["up", "--config", config.as_str(), "--json"]);
        Self { up }
    }

    /// The next event of this kind.
    fn event(&mut self, kind: &str) -> Value {
        let line = self.up.wait_for_line(&format!(r#"{{"event":"{kind}""#));
        serde_json::from_str(&line).unwrap()
    }

    /// The process ids of the next two processes that start.
    fn started(&mut self) -> [u32; 2] {
        [(); 2].map(|()| pid(&self.event("started")))
    }

    fn signal(&self, signal: Signal) {
        send(self.up.pid(), signal);
    }
}

fn pid(event: &Value) -> u32 {
    u32::try_from(event["pid"].as_u64().unwrap()).unwrap()
}

fn send(pid: u32, signal: Signal) {
    let pid = Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    kill_process(pid, signal).unwrap();
}

/// A process that nobody has waited for yet is a zombie: dead, too.
fn is_alive(pid: u32) -> bool {
    let status = std::fs::read_to_string(Path::new("/proc").join(pid.to_string()).join("stat"));
    status.is_ok_and(|status| !status.rsplit(')').next().unwrap_or("").trim_start().starts_with('Z'))
}

fn wait_until_gone(pids: &[u32]) {
    let deadline = Instant::now() + TIMEOUT;
    while let Some(pid) = pids.iter().find(|pid| is_alive(**pid)) {
        assert!(Instant::now() < deadline, "process {pid} lives on");
        thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_process_that_dies_is_started_again_and_an_interrupt_ends_all() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut cell = Cell::up(&domain, &config);
    let [player, vision] = cell.started();
    let ready = cell.event("ready");
    assert_eq!(ready["domain_id"], domain.number());
    assert_eq!(ready["nodes"][1], "/cell/normal_solver");

    send(vision, Signal::KILL);
    let died = cell.event("died");
    assert_eq!((&died["process"], &died["how"]), (&"vision".into(), &"signal 9".into()));
    assert_eq!(died["restart_in_seconds"], 0.5);
    let again = pid(&cell.event("started"));
    assert_ne!(again, vision);
    cell.event("ready");
    assert!(is_alive(player), "the other process is left alone");

    cell.signal(Signal::INT);
    cell.event("stopped");
    assert_eq!(cell.up.wait().code(), Some(0));
    wait_until_gone(&[player, vision, again]);
    assert_eq!(cell.up.count_lines(r#"{"event":"killed""#), 0, "all ended when asked");
}

#[test]
fn terminate_ends_all_as_well() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut cell = Cell::up(&domain, &config);
    let pids = cell.started();
    cell.signal(Signal::TERM);
    assert_eq!(cell.up.wait().code(), Some(0));
    wait_until_gone(&pids);
}

#[test]
fn processes_die_with_a_supervisor_that_is_killed() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut cell = Cell::up(&domain, &config);
    let pids = cell.started();
    cell.event("ready");
    cell.up.kill();
    wait_until_gone(&pids);
}

#[test]
fn a_process_that_does_not_end_is_killed_in_bounded_time() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut cell = Cell::up(&domain, &config);
    let [player, vision] = cell.started();
    cell.event("ready");
    send(vision, Signal::STOP);
    cell.signal(Signal::INT);
    assert_eq!(cell.event("killed")["process"], "vision");
    assert_eq!(cell.up.wait().code(), Some(0));
    wait_until_gone(&[player, vision]);
}

#[test]
fn a_second_interrupt_kills_at_once() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut cell = Cell::up(&domain, &config);
    let [player, vision] = cell.started();
    send(vision, Signal::STOP);
    cell.signal(Signal::INT);
    cell.event("stopping");
    let asked_again = Instant::now();
    cell.signal(Signal::INT);
    assert_eq!(cell.up.wait().code(), Some(0));
    assert!(
        asked_again.elapsed() < Duration::from_secs(4),
        "did not wait for its patience to end"
    );
    wait_until_gone(&[player, vision]);
}

#[test]
fn a_second_cell_in_the_same_place_is_refused() {
    let (domain, config) = (Domain::claim(), Config::replay());
    let mut first = Cell::up(&domain, &config);
    first.event("ready");
    let mut second = rakelight(&domain, &["up", "--config", config.as_str()]);
    assert_eq!(second.wait().code(), Some(1));
    let said = second.stderr();
    let pid = format!("process {}", first.up.pid());
    assert!(
        said.contains("runs already in namespace /cell") && said.contains(&pid),
        "{said}"
    );
    first.signal(Signal::INT);
    assert_eq!(first.up.wait().code(), Some(0));
}

#[test]
fn a_cell_whose_nodes_have_finished_ends() {
    let domain = Domain::claim();
    let bag = super::repository().join("bags/octagon2");
    let config = Config::new(&format!(
        "cell: {{processes: {{player: [bag_player]}}}}\nbag_player: {{ros__parameters: {{bag: {}, rate: 100.0}}}}\n",
        bag.display()
    ));
    let mut cell = Cell::up(&domain, &config);
    assert_eq!(cell.event("finished")["process"], "player");
    assert_eq!(cell.up.wait().code(), Some(0));
}
