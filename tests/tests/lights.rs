//! The node of the lights as other nodes see it, with the real firmware on a simulated board behind a terminal. What was
//! lit is seen on the board's pins.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use interfaces::builtin_interfaces::msg::{Duration as DurationMessage, Time};
use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use interfaces::rakelight_msgs::msg::LightState;
use interfaces::rakelight_msgs::srv::{
    RunLightSequence, RunLightSequenceRequest, RunLightSequenceResponse, SetLights, SetLightsRequest, SetLightsResponse,
};
use ros::{Node, Qos, ServiceClient, Subscription};
use scenarios::{Domain, TIMEOUT, eventually, within};
use sim::SimError;
use sim::board::{BoardConfig, BoardError, Edge, LightBoard, Pin};
use tokio::task::JoinHandle;

const CHANNELS: [u8; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// A board, the node that drives it, and another node that looks on.
struct Scene {
    board: LightBoard,
    edges: Arc<Mutex<Vec<Edge>>>,
    sequencer: Node,
    sequencing: JoinHandle<Result<(), light_sequencer::Error>>,
    viewer: Node,
    states: Subscription<LightState>,
    run: ServiceClient<RunLightSequence>,
    set: ServiceClient<SetLights>,
    _domain: Domain,
}

impl Scene {
    /// Connected; none, and a loud word, where the board's tools are not installed.
    async fn start() -> Option<Self> {
        let edges = Arc::new(Mutex::new(Vec::new()));
        let kept = Arc::clone(&edges);
        let started = LightBoard::start(&BoardConfig::default(), move |edge| {
            kept.lock().unwrap_or_else(PoisonError::into_inner).push(edge);
        });
        let board = match started {
            Ok(board) => board,
            Err(SimError::Board(error @ BoardError::NotBuilt { .. })) => {
                println!("SKIPPED: {error} (cargo xtask setup)");
                return None;
            }
            Err(error) => panic!("{error}"),
        };
        let domain = Domain::claim();
        let viewer = domain.node("viewer").await;
        let states = viewer.subscription("lights/state", Qos::STREAM).unwrap();
        let port = board.port().display().to_string();
        let sequencer = Node::start(domain.options("light_sequencer").parameter("port", port))
            .await
            .unwrap();
        let mut scene = Self {
            sequencing: tokio::spawn(light_sequencer::run(sequencer.clone())),
            sequencer,
            run: viewer.service_client("lights/run_sequence").unwrap(),
            set: viewer.service_client("lights/set").unwrap(),
            states,
            viewer,
            board,
            edges,
            _domain: domain,
        };
        scene.state("a link", |state| state.mode == LightState::IDLE).await;
        Some(scene)
    }

    async fn state(&mut self, what: &str, wanted: impl Fn(&LightState) -> bool) -> Arc<LightState> {
        within(what, async {
            loop {
                let state = self.states.next().await.expect("the node runs").message;
                if wanted(&state) {
                    return state;
                }
            }
        })
        .await
    }

    fn edges(&self) -> Vec<Edge> {
        assert!(self.board.wait_until(Instant::now(), TIMEOUT), "the board keeps up");
        self.edges.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn is_lit(&self, number: u8) -> bool {
        let edges = self.edges();
        let last = edges.iter().rfind(|edge| edge.pin == Pin::Panel(number));
        last.is_some_and(|edge| edge.high)
    }

    fn is_dark(&self) -> bool {
        !(1..=7).any(|number| self.is_lit(number))
    }

    async fn end(self) {
        self.sequencer.shutdown().await;
        within("the node's end", self.sequencing).await.unwrap().unwrap();
        self.viewer.shutdown().await;
    }
}

async fn run_sequence(
    client: &ServiceClient<RunLightSequence>,
    capture_id: &str,
    on_micros: u32,
) -> Arc<RunLightSequenceResponse> {
    let request = RunLightSequenceRequest {
        capture_id: capture_id.into(),
        channels: CHANNELS.to_vec().into(),
        on_time: micros(on_micros),
        gap: micros(500),
    };
    client.call(request, TIMEOUT).await.unwrap()
}

async fn set(client: &ServiceClient<SetLights>, on: [bool; 7], duration: DurationMessage) -> Arc<SetLightsResponse> {
    client.call(SetLightsRequest { on, duration }, TIMEOUT).await.unwrap()
}

fn micros(micros: u32) -> DurationMessage {
    DurationMessage::from_nanos(i64::from(micros) * 1000).unwrap()
}

fn only(number: usize) -> [bool; 7] {
    std::array::from_fn(|index| index + 1 == number)
}

/// The pins' times are the monotonic clock's, the messages' the system's.
fn system_nanos(at: Instant) -> i64 {
    let (system, monotonic) = (SystemTime::now(), Instant::now());
    let now = system.duration_since(UNIX_EPOCH).unwrap().as_nanos() as i64;
    now - monotonic.saturating_duration_since(at).as_nanos() as i64
}

fn apart(time: Time, edge: &Edge) -> f64 {
    (time.to_nanos() - system_nanos(edge.at)).abs() as f64 / 1000.0
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sequence_is_answered_with_its_times_and_shown_in_the_state() {
    let Some(mut scene) = Scene::start().await else { return };
    let answer = run_sequence(&scene.run, "first", 2500).await;
    assert!(answer.success, "{}", answer.message);
    let channels: Vec<u8> = answer.steps.iter().map(|step| step.channel).collect();
    assert_eq!(channels, CHANNELS);
    let edges = scene.edges();
    let edge = |pin, high| edges.iter().filter(move |edge| edge.pin == pin && edge.high == high);
    let (mut worst, mut worst_length) = (0.0_f64, 0);
    for (step, trigger) in answer.steps.iter().zip(edge(Pin::Trigger(1), true)) {
        worst = worst.max(apart(step.triggered_at, trigger));
        let Some(on) = edge(Pin::Panel(step.channel), true).next() else {
            assert_eq!(step.channel, 0, "the dark step lights nothing");
            continue;
        };
        let off = edge(Pin::Panel(step.channel), false).next().expect("it went off");
        worst = worst.max(apart(step.switched_at, on)).max(apart(step.ended_at, off));
        let lit = step.ended_at.to_nanos() - step.switched_at.to_nanos();
        worst_length = worst_length.max((lit - 2_500_000).abs());
    }
    let said = answer.clock_uncertainty.to_nanos() as f64 / 1000.0;
    let slips = scene.board.slips();
    println!(
        "largest error of a time on the ROS clock {worst:.0} us, said to be {said:.0} us; of a length {worst_length} ns; \
         {slips:?}"
    );
    // A board that this machine held up has stood still meanwhile, and its clock with it.
    if slips.count == 0 {
        assert!(worst_length < 5_000, "{worst_length} ns");
        assert!(worst < 3.0 * said + 100.0, "{worst} us");
    }
    let state = scene.state("the steps", |state| !state.steps.is_empty()).await;
    assert_eq!((state.capture_id.as_str(), state.mode), ("first", LightState::IDLE));
    assert_eq!(
        (&state.steps, state.firmware_version.as_str()),
        (&answer.steps, "1.0.0")
    );
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn panels_are_set_by_hand_until_their_time_is_over() {
    let Some(mut scene) = Scene::start().await else { return };
    let answer = set(&scene.set, only(3), micros(800_000)).await;
    assert!(answer.success, "{}", answer.message);
    let state = scene.state("L3", |state| state.mode == LightState::MANUAL).await;
    assert_eq!(state.on, only(3));
    let left = state.expires_in.to_nanos();
    assert!((1..=1_300_000_000).contains(&left), "{left} ns left");
    scene
        .state("the end", |state| {
            state.mode == LightState::IDLE && state.on == [false; 7]
        })
        .await;
    assert!(scene.is_dark());

    assert!(set(&scene.set, only(4), micros(5_000_000)).await.success);
    assert!(scene.is_lit(4));
    // Without a panel the duration does not matter.
    assert!(set(&scene.set, [false; 7], micros(0)).await.success);
    assert!(scene.is_dark());
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn off_goes_past_a_running_sequence_and_aborts_it() {
    let Some(mut scene) = Scene::start().await else { return };
    let (run, off) = (scene.run.clone(), scene.set.clone());
    let first = run_sequence(&run, "aborted", 500_000);
    let (aborted, (second, off)) = tokio::join!(first, async {
        scene
            .state("a sequence", |state| state.mode == LightState::SEQUENCE)
            .await;
        let second = run_sequence(&run, "second", 2500).await;
        (second, set(&off, [false; 7], micros(0)).await)
    });
    assert_eq!(
        (second.success, second.message.as_str()),
        (false, "the lights are busy: a sequence is running")
    );
    assert!(off.success, "{}", off.message);
    assert!(!aborted.success && aborted.steps.is_empty());
    assert!(
        aborted.message.contains("did not run whole") && aborted.message.ends_with("stopped by the host"),
        "{}",
        aborted.message
    );
    assert!(scene.is_dark());
    let state = scene.state("the fault", |state| state.mode == LightState::FAULT).await;
    assert_eq!((state.capture_id.as_str(), &state.fault), ("aborted", &aborted.message));
    assert!(run_sequence(&scene.run, "third", 2500).await.success);
    scene
        .state("no fault", |state| {
            state.mode == LightState::IDLE && state.capture_id == "third"
        })
        .await;
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_out_of_range_is_refused_with_the_range() {
    let Some(scene) = Scene::start().await else { return };
    for (on_micros, text) in [
        (150, "the on-time of step 0 is 150 us, allowed are 200 to 1000000 us"),
        (
            2_000_000,
            "the on-time of step 0 is 2000000 us, allowed are 200 to 1000000 us",
        ),
    ] {
        let answer = run_sequence(&scene.run, "wrong", on_micros).await;
        assert_eq!((answer.success, answer.message.as_str()), (false, text));
    }
    let no_panel = RunLightSequenceRequest {
        channels: vec![8].into(),
        on_time: micros(2500),
        gap: micros(500),
        ..RunLightSequenceRequest::default()
    };
    let answer = scene.run.call(no_panel, TIMEOUT).await.unwrap();
    assert_eq!(answer.message, "channel of step 0 is 8, allowed are 0 (dark) to 7 (L7)");
    for wrong in [micros(0), DurationMessage { sec: 61, nanosec: 0 }] {
        let answer = set(&scene.set, only(1), wrong).await;
        assert!(
            !answer.success && answer.message.ends_with("allowed is more than 0 and at most 60 s"),
            "{}",
            answer.message
        );
    }
    assert!(scene.edges().iter().all(|edge| !edge.high), "nothing was lit");
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_unplugged_controller_is_told_and_found_again() {
    let Some(mut scene) = Scene::start().await else { return };
    let mut diagnostics = scene
        .viewer
        .subscription::<DiagnosticArray>("/diagnostics", Qos::reliable(10))
        .unwrap();
    let run = scene.run.clone();
    let (answer, ()) = tokio::join!(run_sequence(&run, "unplugged", 200_000), async {
        scene
            .state("a sequence", |state| state.mode == LightState::SEQUENCE)
            .await;
        scene.board.unplug().unwrap();
    });
    assert!(
        !answer.success && answer.message.contains("was lost"),
        "{}",
        answer.message
    );
    let state = scene
        .state("its loss", |state| state.mode == LightState::DISCONNECTED)
        .await;
    assert!(
        !state.fault.is_empty() && state.firmware_version.is_empty(),
        "{state:?}"
    );
    eventually("darkness", || scene.is_dark()).await;
    let refused = run_sequence(&scene.run, "refused", 2500).await;
    assert!(
        refused.message.starts_with("the light controller does not answer: "),
        "{}",
        refused.message
    );
    let told = within("a diagnostic", async {
        loop {
            let array = diagnostics.next().await.expect("the viewer runs").message;
            let status = array
                .status
                .iter()
                .find(|status| status.name.ends_with("light_sequencer: light controller"));
            if let Some(status) = status.filter(|status| status.level == DiagnosticStatus::ERROR) {
                return status.clone();
            }
        }
    })
    .await;
    assert!(
        told.values
            .iter()
            .any(|value| value.key == "last fault" && value.value != "none"),
        "{told:?}"
    );
    scene.board.plug().unwrap();
    scene
        .state("its return", |state| state.firmware_version == "1.0.0")
        .await;
    assert!(run_sequence(&scene.run, "again", 2500).await.success);
    scene.end().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_node_that_ends_leaves_the_lights_off() {
    let Some(scene) = Scene::start().await else { return };
    assert!(set(&scene.set, [true; 7], micros(30_000_000)).await.success);
    assert!(scene.is_lit(7));
    let Scene {
        board,
        edges,
        sequencer,
        sequencing,
        viewer,
        ..
    } = scene;
    sequencer.shutdown().await;
    within("the node's end", sequencing).await.unwrap().unwrap();
    assert!(board.wait_until(Instant::now(), Duration::from_secs(5)));
    let edges = edges.lock().unwrap().clone();
    let last_on = edges.iter().filter(|edge| edge.high).count();
    assert_eq!(last_on, 7);
    assert_eq!(edges.len(), 14, "all of them went off: {edges:?}");
    viewer.shutdown().await;
}
