//! The simulated light controller, spoken to through its terminal by a client that knows nothing but the protocol.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use light_protocol::{Command, EndReason, Host, Message, Panels, Sequence, Step, TriggerPulse, Triggers};
use rustix::fs::OFlags;
use sim::SimError;
use sim::board::{BoardConfig, BoardError, BoardFirmware, Edge, LightBoard, Pin};

const PATIENCE: Duration = Duration::from_secs(5);
const CYCLES_PER_MICRO: f64 = 16.0;

/// None, and a loud word, where the board's tools are not installed.
fn start(config: &BoardConfig) -> Option<(LightBoard, mpsc::Receiver<Edge>)> {
    let (sender, edges) = mpsc::channel();
    // Nobody listens at the end of a test.
    match LightBoard::start(config, move |edge| _ = sender.send(edge)) {
        Ok(board) => Some((board, edges)),
        Err(SimError::Board(error @ BoardError::NotBuilt { .. })) => {
            println!("SKIPPED: {error} (cargo xtask setup)");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

struct Client {
    port: File,
    host: Host,
}

impl Client {
    fn open(board: &LightBoard) -> Self {
        let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
        let mut options = OpenOptions::new();
        options.read(true).write(true).custom_flags(flags.bits() as i32);
        Self {
            port: options.open(board.port()).expect("the terminal opens"),
            host: Host::new(),
        }
    }

    fn send(&mut self, command: &Command) {
        let (_, bytes) = self.host.send(command);
        self.port.write_all(&bytes).expect("the terminal takes a frame");
    }

    /// The next message that is wanted; what comes before it is skipped.
    fn wait_for<T>(&mut self, wanted: impl Fn(&Message) -> Option<T>) -> T {
        self.look_for(PATIENCE, wanted).expect("the firmware says it")
    }

    fn look_for<T>(&mut self, patience: Duration, wanted: impl Fn(&Message) -> Option<T>) -> Option<T> {
        let deadline = Instant::now() + patience;
        let mut byte = [0];
        while Instant::now() < deadline {
            match self.port.read(&mut byte) {
                Ok(1) => {
                    let message = self.host.receive(byte[0]).and_then(Result::ok);
                    if let Some(found) = message.and_then(|received| wanted(&received.message)) {
                        return Some(found);
                    }
                }
                Ok(_) => panic!("the terminal hung up"),
                Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::yield_now(),
                Err(error) => panic!("{error}"),
            }
        }
        None
    }

    /// A board that is just starting hears nothing, so it is greeted again.
    fn greet(&mut self) {
        let greeted = (0..20).any(|_| {
            self.send(&Command::HELLO);
            let hello = |message: &Message| matches!(message, Message::Hello(_)).then_some(());
            self.look_for(Duration::from_millis(250), hello).is_some()
        });
        assert!(greeted, "the firmware answers HELLO");
    }
}

fn ended(message: &Message) -> Option<EndReason> {
    match message {
        Message::Ended(ended) => Some(ended.reason),
        _ => None,
    }
}

/// A capture: dark, then L1..L7.
fn capture() -> Command {
    let dark = Step {
        panels: Panels::NONE,
        triggers: Triggers::BOTH,
        on_micros: 2500,
        gap_micros: 500,
    };
    let mut steps = [dark; 8];
    for number in 1..=7 {
        steps[usize::from(number)].panels = Panels::single(number).expect("exists");
    }
    let pulse = TriggerPulse {
        delay_micros: 300,
        width_micros: 500,
    };
    Command::Sequence(Sequence::new(pulse, &steps).expect("in range"))
}

fn lit_again_and_again(edges: &[Edge]) -> Vec<(u8, f64)> {
    let mut on_times = Vec::new();
    for (position, on) in edges.iter().enumerate() {
        let Pin::Panel(number) = on.pin else { continue };
        let off = edges[position..].iter().find(|edge| edge.pin == on.pin && !edge.high);
        if let (true, Some(off)) = (on.high, off) {
            on_times.push((number, (off.cycle - on.cycle) as f64 / CYCLES_PER_MICRO));
        }
    }
    on_times
}

#[test]
fn a_capture_is_seen_on_the_pins_in_time_and_in_order() {
    let Some((board, edges)) = start(&BoardConfig::default()) else {
        return;
    };
    let mut client = Client::open(&board);
    client.greet();
    let sent = Instant::now();
    client.send(&capture());
    assert_eq!(client.wait_for(ended), EndReason::Complete);
    let done = Instant::now();
    assert!(board.wait_until(done, PATIENCE), "the board keeps up");
    let edges: Vec<Edge> = edges.try_iter().collect();
    assert!(edges.is_sorted_by_key(|edge| edge.at) && edges.is_sorted_by_key(|edge| edge.cycle));
    assert!(edges.iter().all(|edge| edge.at > sent && edge.at < done));
    let lit = lit_again_and_again(&edges);
    let numbers: Vec<u8> = lit.iter().map(|(number, _)| *number).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5, 6, 7]);
    let worst = lit
        .iter()
        .map(|(_, micros)| (micros - 2500.0).abs())
        .fold(0.0, f64::max);
    println!("largest error of the on-time: {worst:.2} us; {:?}", board.slips());
    assert!(worst <= 2.0);
    let triggers = edges
        .iter()
        .filter(|edge| edge.high && matches!(edge.pin, Pin::Trigger(_)));
    assert_eq!(triggers.count(), 16);
}

#[test]
fn an_edge_is_handed_out_soon_after_it_happened() {
    let (sender, edges) = mpsc::channel();
    let handed_out = move |edge: Edge| _ = sender.send(edge.at.elapsed());
    let board = match LightBoard::start(&BoardConfig::default(), handed_out) {
        Ok(board) => board,
        Err(SimError::Board(error @ BoardError::NotBuilt { .. })) => return println!("SKIPPED: {error}"),
        Err(error) => panic!("{error}"),
    };
    let mut client = Client::open(&board);
    client.greet();
    for _ in 0..5 {
        client.send(&capture());
        assert_eq!(client.wait_for(ended), EndReason::Complete);
    }
    assert!(board.wait_until(Instant::now(), PATIENCE));
    let mut latencies: Vec<Duration> = edges.try_iter().collect();
    latencies.sort_unstable();
    let median = latencies[latencies.len() / 2];
    println!(
        "latency of {} edges: median {median:?}, worst {:?}",
        latencies.len(),
        latencies[latencies.len() - 1]
    );
    assert!(median < Duration::from_millis(5));
}

/// Of the child process, not of this one.
#[test]
fn an_idle_board_costs_little() {
    let Some((board, _)) = start(&BoardConfig::default()) else {
        return;
    };
    let cpu_time = || -> Duration {
        let path = format!("/proc/{}/schedstat", board.process_id());
        let text = std::fs::read_to_string(path).expect("the kernel tells");
        let nanos = text.split(' ').next().and_then(|word| word.parse().ok());
        Duration::from_nanos(nanos.expect("a number"))
    };
    let mut client = Client::open(&board);
    client.greet();
    let (began, used) = (Instant::now(), cpu_time());
    assert!(board.wait_until(began + Duration::from_millis(800), PATIENCE));
    let share = cpu_time().saturating_sub(used).as_secs_f64() / began.elapsed().as_secs_f64();
    println!("an idle board takes {:.1} % of a core", 100.0 * share);
    assert!(share < 0.15);
}

#[test]
fn an_unplugged_board_hangs_up_and_turns_its_lights_off() {
    let Some((board, edges)) = start(&BoardConfig::default()) else {
        return;
    };
    let mut client = Client::open(&board);
    client.greet();
    client.send(&Command::set(Panels::ALL, 10_000).expect("in range"));
    client.wait_for(|message| matches!(message, Message::Ack(ack) if ack.lit == Panels::ALL).then_some(()));
    board.unplug().expect("it can be unplugged");
    assert!(!board.port().exists());
    let hung_up = match client.port.read(&mut [0; 64]) {
        Ok(0) => true,
        Ok(_) => client.port.read(&mut [0; 64]).is_ok_and(|length| length == 0),
        Err(error) => error.raw_os_error() == Some(rustix::io::Errno::IO.raw_os_error()),
    };
    assert!(hung_up);
    assert!(board.wait_until(Instant::now() + Duration::from_millis(600), PATIENCE));
    let edges: Vec<Edge> = edges.try_iter().collect();
    for number in 1..=7 {
        let last = edges.iter().rfind(|edge| edge.pin == Pin::Panel(number));
        assert!(last.is_some_and(|edge| !edge.high), "L{number} is off");
    }
    board.plug().expect("it can be plugged");
    Client::open(&board).greet();
}

#[test]
fn a_reset_turns_the_lights_off_at_once_and_is_silent_for_a_while() {
    let Some((board, edges)) = start(&BoardConfig::default()) else {
        return;
    };
    let mut client = Client::open(&board);
    client.greet();
    client.send(&Command::set(Panels::ALL, 10_000).expect("in range"));
    client.wait_for(|message| matches!(message, Message::Ack(ack) if ack.lit == Panels::ALL).then_some(()));
    let silence = Duration::from_millis(200);
    let asked = Instant::now();
    board.reset(silence).expect("it can be reset");
    let cause = client.wait_for(|message| match message {
        Message::Boot(hello) => Some(hello.reset_cause.to_string()),
        _ => None,
    });
    assert_eq!(cause, "reset line");
    assert!(asked.elapsed() >= silence, "silent for {:?}", asked.elapsed());
    let off = edges.try_iter().filter(|edge| !edge.high).count();
    assert_eq!(off, 7, "every panel went off");
}

#[test]
fn opening_the_port_of_a_real_uno_resets_it() {
    let silence = Duration::from_millis(100);
    let config = BoardConfig {
        reset_on_open: Some(silence),
        ..BoardConfig::default()
    };
    let Some((board, _)) = start(&config) else { return };
    for _ in 0..2 {
        let opened = Instant::now();
        let mut client = Client::open(&board);
        client.wait_for(|message| {
            let boot = matches!(message, Message::Boot(hello) if hello.reset_cause.to_string() == "reset line");
            (boot && opened.elapsed() >= silence).then_some(())
        });
    }
}

#[test]
fn the_other_firmware_speaks_another_protocol() {
    let config = BoardConfig {
        firmware: BoardFirmware::OtherProtocol,
        ..BoardConfig::default()
    };
    let Some((board, _)) = start(&config) else { return };
    let mut client = Client::open(&board);
    let deadline = Instant::now() + PATIENCE;
    let mut byte = [0];
    let mut error = None;
    // What it says when it starts names its version, too.
    while error.is_none() && Instant::now() < deadline {
        if client.port.read(&mut byte).is_ok() {
            error = client.host.receive(byte[0]).and_then(Result::err);
        }
    }
    let text = error.expect("it is refused").to_string();
    assert!(
        text.contains("speaks light protocol 1") && text.contains("speaks 250"),
        "{text}"
    );
}

#[test]
fn a_link_goes_where_it_was_asked_for_and_goes_with_the_board() {
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("lights");
    std::os::unix::fs::symlink("/nowhere", &link).expect("left behind by an earlier board");
    let config = BoardConfig {
        link: Some(link.clone()),
        ..BoardConfig::default()
    };
    let Some((board, _)) = start(&config) else { return };
    assert_eq!(board.port(), link);
    Client::open(&board).greet();
    drop(board);
    assert!(link.symlink_metadata().is_err());
    std::fs::write(&link, "somebody's").expect("a file");
    let error = LightBoard::start(&config, |_| {}).expect_err("it is in the way");
    assert!(error.to_string().ends_with("something else is there"), "{error}");
}
