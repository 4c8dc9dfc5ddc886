use light_protocol::{
    Ack, Command, EndReason, Ended, Message, Panels, RefusalReason, Sequence, Step, StepReport, TriggerPulse, Triggers,
};

use crate::build;
use crate::simulation::{Edge, Simulation};

/// Times of edges may differ by this from the plan, microseconds.
const TOLERANCE_MICROS: f64 = 2.0;
const ON_MICROS: u32 = 2500;
const GAP_MICROS: u32 = 500;
const PULSE: TriggerPulse = TriggerPulse {
    delay_micros: 300,
    width_micros: 500,
};
const C1_PIN: u8 = 11;
const C2_PIN: u8 = 12;

fn skipped() -> bool {
    build::skip_without(&build::simulation_needs())
}

/// A capture: dark, then L1..L7, both cameras.
fn capture() -> Sequence {
    let dark = Step {
        panels: Panels::NONE,
        triggers: Triggers::BOTH,
        on_micros: ON_MICROS,
        gap_micros: GAP_MICROS,
    };
    let mut steps = [dark; 8];
    for number in 1..=7 {
        steps[usize::from(number)].panels = Panels::single(number).expect("exists");
    }
    Sequence::new(PULSE, &steps).expect("in range")
}

fn set(panel: u8, millis: u16) -> Command {
    Command::set(Panels::single(panel).expect("exists"), millis).expect("in range")
}

fn edges_of(edges: &[Edge], pin: u8, high: bool) -> Vec<f64> {
    let wanted = edges.iter().filter(|edge| edge.pin == pin && edge.high == high);
    wanted.map(|edge| edge.at).collect()
}

fn panel_pin(number: u8) -> u8 {
    3 + number
}

fn endings(messages: &[Message]) -> Vec<EndReason> {
    let endings = messages.iter().filter_map(|message| match message {
        Message::Ended(Ended { reason, .. }) => Some(*reason),
        _ => None,
    });
    endings.collect()
}

fn reports(messages: &[Message]) -> Vec<StepReport> {
    let reports = messages.iter().filter_map(|message| match message {
        Message::Step(report) => Some(*report),
        _ => None,
    });
    reports.collect()
}

/// Of L1..L7, each of which was lit once: on and off.
fn lit_times(edges: &[Edge]) -> [(f64, f64); 7] {
    [1, 2, 3, 4, 5, 6, 7].map(|panel| {
        let on = edges_of(edges, panel_pin(panel), true);
        let off = edges_of(edges, panel_pin(panel), false);
        assert_eq!((on.len(), off.len()), (1, 1), "panel {panel} is lit once");
        (on[0], off[0])
    })
}

/// Largest distance between what was and what should have been.
fn worst_error(measured: &[f64], planned: impl IntoIterator<Item = f64>) -> f64 {
    let errors = measured.iter().zip(planned).map(|(was, should)| (was - should).abs());
    errors.fold(0.0, f64::max)
}

#[test]
fn it_announces_itself_and_answers_hello() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::start();
    simulation.run(5000);
    let Some(Message::Boot(boot)) = simulation.messages().first().copied() else {
        panic!("no BOOT");
    };
    assert_eq!((boot.panels, boot.triggers, boot.max_steps), (7, 2, 16));
    let number = simulation.send(&Command::HELLO);
    simulation.run(10_000);
    assert_eq!(simulation.received[0].sequence_number, number);
    assert!(matches!(simulation.received[0].message, Message::Hello(hello) if hello.watchdog_millis == 500));
}

#[test]
fn a_capture_makes_its_edges_in_time_and_reports_them() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::greeted();
    simulation.send(&Command::Sequence(capture()));
    // Frames and garbage arrive meanwhile: neither may move an edge.
    simulation.send(&Command::Ping);
    simulation.send_bytes(&[0x55; 40]);
    simulation.send(&Command::Ping);
    simulation.run(80_000);

    let period = f64::from(ON_MICROS + GAP_MICROS);
    let triggered = edges_of(&simulation.edges, C1_PIN, true);
    assert_eq!(triggered.len(), 8);
    assert_eq!(
        edges_of(&simulation.edges, C2_PIN, true),
        triggered,
        "both cameras at once"
    );
    let start = triggered[0] - f64::from(PULSE.delay_micros);
    let of_step = |offset: u16| (0..8).map(move |step| start + f64::from(step) * period + f64::from(offset));
    let trigger_error = worst_error(&triggered, of_step(PULSE.delay_micros));
    let widths = edges_of(&simulation.edges, C1_PIN, false);
    assert_eq!(widths.len(), 8);
    let width_error = worst_error(&widths, of_step(PULSE.delay_micros + PULSE.width_micros));

    let lit = lit_times(&simulation.edges);
    let rising: Vec<f64> = lit.iter().map(|(on, _)| *on).collect();
    let on_times: Vec<f64> = lit.iter().map(|(on, off)| off - on).collect();
    let start_error = worst_error(&rising, of_step(0).skip(1));
    let on_time_error = worst_error(&on_times, [f64::from(ON_MICROS); 7]);

    let messages = simulation.messages();
    let steps = reports(&messages);
    assert_eq!(steps.len(), 8);
    let reported: Vec<f64> = steps
        .iter()
        .map(|step| f64::from(step.on_at.micros_since(steps[0].on_at)))
        .collect();
    let report_error = worst_error(&reported, (0..8).map(|step| f64::from(step) * period));
    println!(
        "largest errors in us: on-time {on_time_error:.2}, start of a step {start_error:.2}, trigger {trigger_error:.2}, \
         end of the pulse {width_error:.2}, reported start {report_error:.2}"
    );
    for error in [on_time_error, start_error, trigger_error, width_error, report_error] {
        assert!(error <= TOLERANCE_MICROS, "{error} us, see the line above");
    }
    assert!(
        steps
            .iter()
            .zip(0..)
            .all(|(step, index)| step.index == index && step.triggers == Triggers::BOTH)
    );
    assert_eq!(endings(&messages), [EndReason::Complete]);
    let pings = messages
        .iter()
        .filter(|m| matches!(m, Message::Ack(ack) if ack.command == Command::Ping.kind()));
    assert_eq!(pings.count(), 2, "garbage costs no frame before or behind it");
}

#[test]
fn long_exposures_across_turns_of_the_timer_are_as_exact() {
    if skipped() {
        return;
    }
    let step = Step {
        panels: Panels::single(3).expect("exists"),
        triggers: Triggers::C2,
        on_micros: 131_072,
        gap_micros: 65_536,
    };
    let mut simulation = Simulation::greeted();
    simulation.send(&Command::Sequence(Sequence::new(PULSE, &[step; 3]).expect("in range")));
    for _ in 0..3 {
        simulation.run(250_000);
        simulation.send(&Command::Ping);
    }
    let on = edges_of(&simulation.edges, panel_pin(3), true);
    let off = edges_of(&simulation.edges, panel_pin(3), false);
    assert_eq!((on.len(), off.len()), (3, 3));
    for (step, (on, off)) in on.iter().zip(&off).enumerate() {
        let error = (off - on - 131_072.0).abs();
        assert!(error <= TOLERANCE_MICROS, "step {step} is lit for {} us", off - on);
    }
    assert_eq!(
        edges_of(&simulation.edges, C1_PIN, true),
        [] as [f64; 0],
        "only C2 is triggered"
    );
    assert_eq!(endings(&simulation.messages()), [EndReason::Complete]);
}

#[test]
fn a_set_expires_by_itself() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::greeted();
    simulation.send(&set(7, 300));
    simulation.run(400_000);
    let messages = simulation.messages();
    assert!(
        matches!(messages[0], Message::Ack(Ack { lit, .. }) if lit.bits() == 0x40),
        "{messages:?}"
    );
    let on = edges_of(&simulation.edges, panel_pin(7), true);
    let off = edges_of(&simulation.edges, panel_pin(7), false);
    assert!(
        (off[0] - on[0] - 300_000.0).abs() <= 50.0,
        "lit for {} us",
        off[0] - on[0]
    );
    assert_eq!(endings(&messages), [EndReason::Expired]);
}

#[test]
fn silence_turns_the_lights_off_after_half_a_second() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::greeted();
    simulation.send(&set(1, 5000));
    simulation.run(700_000);
    let on = edges_of(&simulation.edges, panel_pin(1), true);
    let off = edges_of(&simulation.edges, panel_pin(1), false);
    let lit = off[0] - on[0];
    println!("lit for {lit:.0} us after the last frame");
    assert!((499_000.0..=501_000.0).contains(&lit), "lit for {lit} us");
    assert_eq!(endings(&simulation.messages()), [EndReason::Silence]);
}

#[test]
fn off_aborts_a_sequence_and_the_next_one_runs() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::greeted();
    simulation.send(&Command::Sequence(capture()));
    simulation.run(20_000);
    simulation.send(&Command::Off);
    simulation.run(30_000);
    let messages = simulation.messages();
    assert_eq!(endings(&messages), [EndReason::Stopped]);
    assert!(reports(&messages).len() < 8, "not every step was done");
    for pin in 4..=12 {
        let last = simulation.edges.iter().rfind(|edge| edge.pin == pin);
        assert!(last.is_none_or(|edge| !edge.high), "pin {pin} is off");
    }
    simulation.send(&Command::Sequence(capture()));
    simulation.run(80_000);
    assert_eq!(reports(&simulation.messages()).len(), 8);
}

#[test]
fn a_hung_firmware_is_reset_with_the_lights_off_and_wants_a_greeting() {
    if skipped() {
        return;
    }
    let mut simulation = Simulation::greeted();
    simulation.send(&set(2, 5000));
    simulation.run(10_000);
    simulation.hang();
    simulation.run(400_000);
    let on = edges_of(&simulation.edges, panel_pin(2), true);
    let off = edges_of(&simulation.edges, panel_pin(2), false);
    assert!(
        !off.is_empty() && off[0] - on[0] < 300_000.0,
        "off within 300 ms: {off:?}"
    );
    let boot = simulation.messages().into_iter().find_map(|message| match message {
        Message::Boot(hello) => Some(hello.reset_cause.to_string()),
        _ => None,
    });
    assert_eq!(boot.as_deref(), Some("hardware watchdog"));
    simulation.send(&Command::Ping);
    simulation.run(10_000);
    let answers = simulation.messages();
    assert!(
        matches!(answers[..], [Message::Nak(refusal)] if refusal.reason == RefusalReason::NoHello),
        "{answers:?}"
    );
}
