//! The cell in small, with real wires: the firmware on a simulated board, two GigE Vision devices that expose when its
//! pins say so, and the nodes of the lights and cameras.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::net::Ipv4Addr;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use bytes::Bytes;
use gige_vision::{DeviceConfig, Faults, FrameRequest, Server};
use interfaces::rakelight_msgs::srv::{Capture, CaptureRequest, CaptureResponse};
use interfaces::std_srvs::srv::{Trigger, TriggerRequest, TriggerResponse};
use ros::{Node, NodeOptions, ParameterValue, ServiceClient};
use scenarios::{Domain, TIMEOUT, eventually};
use sim::SimError;
use sim::board::{BoardConfig, BoardError, Edge, LightBoard, Pin};
use tokio::task::JoinHandle;

/// Black level of the sensors, digital numbers.
pub(crate) const DARK: f64 = 400.0;

/// What a sensor gathers under one panel in the middle of the image, digital numbers per second.
const RATE: f64 = 8_000_000.0;

/// How much brighter the image is towards the panel, per image width, as a logarithm.
const TILT: f64 = 1.2;

/// The place of both cameras: 0.4 m over the workspace, looking down, x along base y.
pub(crate) const POSE: [f64; 7] = [
    0.43,
    0.0,
    0.4,
    0.707_106_781_186_547_5,
    0.707_106_781_186_547_5,
    0.0,
    0.0,
];

/// Called with a camera (1 or 2) and the number of its trigger pulses so far; says whether this one reaches the camera.
type Hook = Box<dyn FnMut(u8, usize) -> bool + Send>;

/// What the board's outputs do.
#[derive(Default)]
pub(crate) struct Wires {
    state: Mutex<State>,
    hook: Mutex<Option<Hook>>,
    devices: [Mutex<Option<Server>>; 2],
    /// Start of each device's clock.
    zeros: [Mutex<Option<Instant>>; 2],
    /// Which panel each output drives, L1 first; 0: none.
    panels: [AtomicU8; 7],
    /// Pictures of before: the time that a capture takes is to be the cameras', not this file's.
    pictures: Mutex<HashMap<PictureKey, Bytes>>,
}

/// Panels that shine, exposure, gain and black level in bits, columns and rows.
type PictureKey = (Vec<u8>, [u64; 3], [u32; 2]);

#[derive(Default)]
struct State {
    lit: [bool; 7],
    /// Every state since the start.
    history: Vec<(Instant, [bool; 7])>,
    triggers: [usize; 2],
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Wires {
    fn take(&self, edge: Edge) {
        match edge.pin {
            Pin::Panel(panel) => {
                let mut state = lock(&self.state);
                state.lit[usize::from(panel) - 1] = edge.high;
                let lit = state.lit;
                state.history.push((edge.at, lit));
            }
            Pin::Trigger(camera) if edge.high => self.trigger(camera, edge.at),
            Pin::Trigger(_) => {}
        }
    }

    fn trigger(&self, camera: u8, at: Instant) {
        let index = usize::from(camera) - 1;
        let count = {
            let mut state = lock(&self.state);
            state.triggers[index] += 1;
            state.triggers[index]
        };
        let passes = lock(&self.hook).as_mut().is_none_or(|hook| hook(camera, count));
        if passes && let Some(device) = &*lock(&self.devices[index]) {
            device.line_trigger(at);
        }
    }

    /// Outputs that are high, L1 first.
    pub(crate) fn lit(&self) -> [bool; 7] {
        lock(&self.state).lit
    }

    /// Outputs that were high then.
    fn lit_at(&self, at: Instant) -> [bool; 7] {
        let state = lock(&self.state);
        let before = state.history.iter().rev().find(|(since, _)| *since <= at);
        before.map_or([false; 7], |(_, lit)| *lit)
    }

    /// From now on, triggers are counted from 1 and pass only where `hook` says so.
    pub(crate) fn hook(&self, hook: impl FnMut(u8, usize) -> bool + Send + 'static) {
        lock(&self.state).triggers = [0; 2];
        *lock(&self.hook) = Some(Box::new(hook));
    }

    pub(crate) fn unhook(&self) {
        *lock(&self.hook) = None;
    }

    /// Lets output L`output` drive another panel; 0: none.
    pub(crate) fn rewire(&self, output: u8, panel: u8) {
        self.panels[usize::from(output) - 1].store(panel, Ordering::Relaxed);
    }

    /// The device of camera 1 or 2, if it lives.
    pub(crate) fn device<T>(&self, camera: u8, ask: impl FnOnce(&Server) -> T) -> Option<T> {
        lock(&self.devices[usize::from(camera) - 1]).as_ref().map(ask)
    }

    /// The device of camera 1 or 2 dies.
    pub(crate) fn kill(&self, camera: u8) {
        let device = lock(&self.devices[usize::from(camera) - 1]).take();
        drop(device);
    }

    /// What camera 1 or 2 sees.
    fn picture(&self, camera: u8, request: &FrameRequest) -> Bytes {
        let zero = lock(&self.zeros[usize::from(camera) - 1]).unwrap_or_else(Instant::now);
        let lit = self.lit_at(zero + request.triggered_at + request.exposure / 2);
        let on = (0..7).filter(|output| lit[*output]);
        let panels: Vec<u8> = on.map(|output| self.panels[output].load(Ordering::Relaxed)).collect();
        let light = [
            request.exposure.as_nanos() as u64,
            request.gain_decibels.to_bits(),
            u64::from(request.black_level),
        ];
        let key = (panels, light, [request.width, request.height]);
        if let Some(known) = lock(&self.pictures).get(&key) {
            return known.clone();
        }
        let picture = draw(&key.0, request);
        lock(&self.pictures).insert(key, picture.clone());
        picture
    }
}

/// What a camera sees of these panels.
fn draw(panels: &[u8], request: &FrameRequest) -> Bytes {
    let gathered = RATE * request.exposure.as_secs_f64() * 10_f64.powf(request.gain_decibels / 20.0);
    let (width, height) = (request.width as usize, request.height as usize);
    // Brightness is the same along lines across the panel's direction, so two tables say all.
    let mut columns = vec![0.0; width];
    let mut rows = vec![0.0; height];
    let mut pixels = vec![f64::from(request.black_level) + DARK; width * height];
    for panel in panels.iter().filter(|panel| **panel > 0) {
        let [right, down] = direction(*panel);
        let table = |values: &mut [f64], slope: f64| {
            let length = values.len() as f64;
            for (at, value) in values.iter_mut().enumerate() {
                *value = (TILT * slope * (at as f64 / length - 0.5)).exp();
            }
        };
        table(&mut columns, right);
        table(&mut rows, down);
        for (row, down) in pixels.chunks_exact_mut(width).zip(&rows) {
            for (pixel, right) in row.iter_mut().zip(&columns) {
                *pixel += gathered * down * right;
            }
        }
    }
    let quantised = pixels.iter().map(|value| value.min(65_520.0) as u16 & 0xfff0);
    quantised.flat_map(u16::to_le_bytes).collect::<Vec<u8>>().into()
}

/// Towards a panel in the image, right and down; nowhere for the one overhead.
fn direction(panel: u8) -> [f64; 2] {
    if panel == 7 {
        return [0.0; 2];
    }
    let azimuth = TAU * (30.0 + 60.0 * f64::from(panel - 1)) / 360.0;
    [azimuth.sin(), azimuth.cos()]
}

/// How the rig is built.
pub(crate) struct Plan {
    pub(crate) size: [u32; 2],
    /// More parameters of `camera_capture`.
    pub(crate) parameters: Vec<(&'static str, ParameterValue)>,
    /// Whether the node of the lights runs.
    pub(crate) lights: bool,
    /// Whether the node knows the first camera only.
    pub(crate) only_first: bool,
}

impl Default for Plan {
    fn default() -> Self {
        Self {
            // A whole sequence of such frames fits into the kernel's own socket buffer: on a machine that is busy with
            // other tests none is lost.
            size: [96, 64],
            parameters: Vec::new(),
            lights: true,
            only_first: false,
        }
    }
}

/// The running rig.
pub(crate) struct Rig {
    pub(crate) wires: Arc<Wires>,
    pub(crate) board: Arc<LightBoard>,
    pub(crate) viewer: Node,
    pub(crate) captures: ServiceClient<Capture>,
    pub(crate) camera_node: Node,
    pub(crate) camera_task: Option<JoinHandle<Result<(), camera_capture::Error>>>,
    light_node: Option<Node>,
    addresses: [Ipv4Addr; 2],
    size: [u32; 2],
    options: NodeOptions,
    _folder: tempfile::TempDir,
    pub(crate) domain: Domain,
}

/// Addresses of loopback that no other test uses: those of this process, counted.
fn address() -> Ipv4Addr {
    static NEXT: AtomicU8 = AtomicU8::new(1);
    let [.., middle, low] = std::process::id().to_be_bytes();
    Ipv4Addr::new(127, 128 + (middle & 63), low, NEXT.fetch_add(1, Ordering::Relaxed))
}

impl Rig {
    /// Switches everything on and waits until a capture could be taken; `None`, with a loud line, where something of
    /// the system is missing.
    pub(crate) async fn start(plan: Plan) -> Option<Self> {
        let cameras = if plan.only_first { 1..=1 } else { 1..=2 };
        let rig = Self::assemble(plan).await?;
        for camera in cameras {
            rig.wait_until_open(camera).await;
        }
        Some(rig)
    }

    /// The same without waiting for the cameras.
    pub(crate) async fn assemble(plan: Plan) -> Option<Self> {
        let wires = Arc::new(Wires::default());
        (1..=7).for_each(|panel| wires.rewire(panel, panel));
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let taken = Arc::clone(&wires);
        let config = BoardConfig {
            link: Some(folder.path().join("lights")),
            ..BoardConfig::default()
        };
        let board = match LightBoard::start(&config, move |edge| taken.take(edge)) {
            Ok(board) => Arc::new(board),
            Err(SimError::Board(BoardError::NotBuilt { missing })) => {
                println!("SKIPPED: the simulated board needs {missing} (cargo xtask setup)");
                return None;
            }
            Err(error) => panic!("{error}"),
        };
        let addresses = [address(), address()];
        let domain = Domain::claim();
        let mut options = domain.options(camera_capture::NAME);
        // By UDP: not every machine lets tests past it (CAP_NET_RAW).
        let known = if plan.only_first { 1 } else { 2 };
        for (name, address) in ["c1", "c2"].into_iter().zip(addresses).take(known) {
            options = options
                .parameter(&format!("{name}.guid"), address.to_string())
                .parameter(&format!("{name}.pose"), POSE.to_vec())
                .parameter(&format!("{name}.TransportLayerControl.packet_socket"), false);
        }
        for (name, value) in plan.parameters {
            options = options.parameter(name, value);
        }
        let light_node = if plan.lights {
            Some(start_lights(&domain, board.port().display().to_string()).await)
        } else {
            None
        };
        let viewer = domain.node("viewer").await;
        let mut rig = Self {
            captures: viewer.service_client("capture").expect("a client can be made"),
            camera_node: viewer.clone(),
            camera_task: None,
            light_node,
            viewer,
            wires,
            board,
            addresses,
            size: plan.size,
            options: options.clone(),
            _folder: folder,
            domain,
        };
        rig.serve(1);
        rig.serve(2);
        rig.start_cameras().await;
        Some(rig)
    }

    /// Starts the node of the cameras.
    pub(crate) async fn start_cameras(&mut self) {
        let node = Node::start(self.options.clone()).await.expect("the node starts");
        self.camera_node = node.clone();
        self.camera_task = Some(tokio::spawn(camera_capture::run(node)));
    }

    /// Switches the device of camera 1 or 2 on.
    pub(crate) fn serve(&self, camera: u8) {
        let index = usize::from(camera) - 1;
        let wires = Arc::downgrade(&self.wires);
        let config = DeviceConfig {
            sensor_width: self.size[0],
            sensor_height: self.size[1],
            ..DeviceConfig::new(format!("T{camera}"), self.addresses[index])
        };
        let picture = move |request: &FrameRequest| match wires.upgrade() {
            Some(wires) => wires.picture(camera, request),
            None => vec![0; request.image_bytes()].into(),
        };
        let device = Server::start(&config, picture).expect("a device can be served on loopback");
        let now = Instant::now();
        *lock(&self.wires.zeros[index]) = now.checked_sub(device.device_time(now));
        *lock(&self.wires.devices[index]) = Some(device);
    }

    pub(crate) fn address(&self, camera: u8) -> Ipv4Addr {
        self.addresses[usize::from(camera) - 1]
    }

    pub(crate) fn set_faults(&self, camera: u8, faults: Faults) {
        let set = self.wires.device(camera, |device| device.set_faults(faults));
        set.expect("the device lives");
    }

    /// Camera 1 or 2 has heard what to do.
    pub(crate) async fn wait_until_open(&self, camera: u8) {
        let is_ready = || self.wires.device(camera, Server::is_acquiring).unwrap_or_default();
        eventually(&format!("camera {camera}"), is_ready).await;
    }

    /// One capture; empty: of all cameras.
    pub(crate) async fn capture(&self, cameras: &[&str]) -> Arc<CaptureResponse> {
        let cameras = cameras.iter().map(ToString::to_string).collect();
        let answer = self.captures.call(CaptureRequest { cameras }, TIMEOUT).await;
        answer.expect("the node answers")
    }

    /// Why there was no capture. The lights are off then, on the pins.
    pub(crate) async fn failed_capture(&self) -> String {
        let answer = self.capture(&[]).await;
        assert!(!answer.success, "{answer:?}");
        assert_eq!((answer.capture_id.as_str(), answer.timing.succeeded), ("", false));
        eventually("dark panels", || self.wires.lit() == [false; 7]).await;
        answer.message.clone()
    }

    /// Takes captures until one succeeds: what was wrong is over, and the cell has to come back by itself.
    pub(crate) async fn recovered_capture(&self) -> Arc<CaptureResponse> {
        let deadline = Instant::now() + TIMEOUT;
        loop {
            let answer = self.capture(&[]).await;
            if answer.success {
                return answer;
            }
            assert!(Instant::now() < deadline, "still: {}", answer.message);
        }
    }

    /// A service of the camera node that takes nothing.
    pub(crate) async fn ask(&self, service: &str) -> Arc<TriggerResponse> {
        let name = format!("{}/{service}", camera_capture::NAME);
        let client = self
            .viewer
            .service_client::<Trigger>(&name)
            .expect("a client can be made");
        client
            .call(TriggerRequest::default(), TIMEOUT)
            .await
            .expect("the node answers")
    }

    /// Ends the node of the cameras in good order.
    pub(crate) async fn stop_cameras(&mut self) {
        self.camera_node.clone().shutdown().await;
        if let Some(task) = self.camera_task.take() {
            let ended = scenarios::within("the node's end", task).await;
            ended.expect("the node does not panic").expect("the node ends well");
        }
    }

    /// Ends the nodes in good order.
    pub(crate) async fn stop(mut self) {
        self.stop_cameras().await;
        if let Some(node) = self.light_node.take() {
            node.shutdown().await;
        }
        self.viewer.clone().shutdown().await;
    }
}

async fn start_lights(domain: &Domain, port: String) -> Node {
    let options = domain.options(light_sequencer::NAME).parameter("port", port);
    let node = Node::start(options).await.expect("the node starts");
    let served = node.clone();
    tokio::spawn(async move { light_sequencer::run(served).await.expect("the lights' node runs") });
    node
}

/// One rig's thread for what must not hold up the board.
pub(crate) fn aside(work: impl FnOnce() + Send + 'static) {
    std::thread::spawn(work);
}

/// Done once, whoever asks.
pub(crate) fn once(flag: &OnceLock<()>) -> bool {
    flag.set(()).is_ok()
}

/// Long enough for what a camera does within one sequence.
pub(crate) const SHORT: Duration = Duration::from_millis(300);
