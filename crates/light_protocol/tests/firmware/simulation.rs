//! A conversation with the firmware on the simulated board, in simulated time only.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use light_protocol::{Host, Message, Received};

use crate::build;

const CYCLES_PER_MICRO: f64 = 16.0;

/// An output that changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    /// Microseconds since the simulation began, to a sixteenth.
    pub(crate) at: f64,
    /// Number of the Uno's pin, 4 to 12.
    pub(crate) pin: u8,
    pub(crate) high: bool,
}

/// The board, running only while [`Simulation::run`] does.
pub(crate) struct Simulation {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    pub(crate) host: Host,
    pub(crate) received: Vec<Received>,
    pub(crate) edges: Vec<Edge>,
}

impl Simulation {
    /// A board that was just switched on.
    pub(crate) fn start() -> Self {
        let built = build::simulation();
        let mut child = Command::new(&built.host)
            .arg(&built.firmware)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the simulation starts");
        Self {
            input: child.stdin.take().expect("piped"),
            output: BufReader::new(child.stdout.take().expect("piped")),
            child,
            host: Host::new(),
            received: Vec::new(),
            edges: Vec::new(),
        }
    }

    /// Greeted, with nothing seen yet.
    pub(crate) fn greeted() -> Self {
        let mut simulation = Self::start();
        simulation.run(5000);
        simulation.send(&light_protocol::Command::HELLO);
        simulation.run(10_000);
        let last = simulation.received.last().expect("HELLO is answered");
        assert!(matches!(last.message, Message::Hello(_)), "{last:?}");
        simulation.received.clear();
        simulation.edges.clear();
        simulation
    }

    fn order(&mut self, line: &str) {
        writeln!(self.input, "{line}").expect("the simulation reads");
    }

    pub(crate) fn send(&mut self, command: &light_protocol::Command) -> u8 {
        let (number, bytes) = self.host.send(command);
        self.send_bytes(&bytes);
        number
    }

    pub(crate) fn send_bytes(&mut self, bytes: &[u8]) {
        let mut line = String::from("send ");
        for byte in bytes {
            let _ = write!(line, "{byte:02x}");
        }
        self.order(&line);
    }

    /// The main loop gets nowhere from now on, until the next reset.
    pub(crate) fn hang(&mut self) {
        self.order("hang");
    }

    pub(crate) fn run(&mut self, micros: u32) {
        self.order(&format!("run {micros}"));
        let mut line = String::new();
        loop {
            line.clear();
            let length = self.output.read_line(&mut line).expect("the simulation writes");
            assert!(length > 0, "the simulation ended");
            if !self.take(&line) {
                return;
            }
        }
    }

    /// False at the end of a run.
    fn take(&mut self, line: &str) -> bool {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["uart", _, digits] => {
                let byte = u8::from_str_radix(digits, 16).expect("a byte");
                if let Some(received) = self.host.receive(byte) {
                    self.received.push(received.expect("the firmware sends whole frames"));
                }
            }
            ["pin", cycle, name, level] => self.edges.push(Edge {
                at: cycle.parse::<f64>().expect("a number") / CYCLES_PER_MICRO,
                pin: name[1..].parse().expect("a pin"),
                high: level == "1",
            }),
            ["ran", _] => return false,
            // simavr's own words.
            _ => {}
        }
        true
    }

    /// Since the last look: what came.
    pub(crate) fn messages(&mut self) -> Vec<Message> {
        self.received.drain(..).map(|received| received.message).collect()
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
