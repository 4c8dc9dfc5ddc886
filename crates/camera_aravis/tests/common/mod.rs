//! A served camera and an opened one.

#![allow(dead_code, reason = "every test binary uses a part of it")]

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::{Duration, Instant};

use bytes::Bytes;
use camera_aravis::{AravisCamera, CameraConfig};
use devices::{
    AppliedSettings, Binning, Camera, CameraLink, CameraSettings, Frame, FrameEvent, FrameFault, Frames, TriggerMode,
};
use gige_vision::{DeviceConfig, FrameRequest, GigeVisionError, Server};

/// For everything that must happen, on a busy machine too.
pub(crate) const PATIENCE: Duration = Duration::from_secs(30);
/// Side of the small sensor.
pub(crate) const SIDE: u32 = 128;
/// Between two triggers: slow enough for a machine that is busy with other tests.
pub(crate) const PERIOD: Duration = Duration::from_millis(10);

/// An address of loopback for this process, so that runs side by side do not meet.
pub(crate) fn address(last: u8) -> Ipv4Addr {
    let [.., middle, low] = std::process::id().to_be_bytes();
    Ipv4Addr::new(127, 128 + (middle & 63), low, last)
}

/// Every frame differs from every other, in every pixel.
pub(crate) fn pixel(index: u32, place: usize) -> u16 {
    (place as u32).wrapping_mul(40503).wrapping_add(index * 257) as u16
}

fn picture(request: &FrameRequest) -> Bytes {
    let pixels = request.image_bytes() / 2;
    let samples: Vec<u16> = (0..pixels).map(|place| pixel(request.index, place)).collect();
    request.pixel_format.pack(&samples).into()
}

pub(crate) fn device(last: u8) -> DeviceConfig {
    DeviceConfig {
        sensor_width: SIDE,
        sensor_height: SIDE,
        ..DeviceConfig::new(format!("T{:x}-{last}", std::process::id()), address(last))
    }
}

/// None, and a loud line, where the address cannot be had.
pub(crate) fn serve(last: u8) -> Option<Server> {
    match Server::start(&device(last), picture) {
        Ok(server) => Some(server),
        Err(GigeVisionError::Bind { address, source }) => {
            println!("SKIPPED: {address} cannot be served here: {source}");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

pub(crate) fn config(last: u8) -> CameraConfig {
    CameraConfig::new(address(last).to_string())
}

/// Received by a packet socket, where that is possible.
pub(crate) fn packet_socket(last: u8) -> CameraConfig {
    CameraConfig {
        packet_socket: true,
        ..config(last)
    }
}

pub(crate) fn settings(trigger: TriggerMode) -> CameraSettings {
    CameraSettings {
        region: None,
        binning: Binning {
            horizontal: 1,
            vertical: 1,
        },
        exposure: Duration::from_micros(500),
        gain_db: 0.0,
        black_level: 0.0,
        trigger,
    }
}

pub(crate) async fn wait_for(camera: &AravisCamera, what: &str, wanted: impl FnMut(&CameraLink) -> bool) -> CameraLink {
    let mut link = camera.link();
    let found = tokio::time::timeout(PATIENCE, link.wait_for(wanted)).await;
    found.unwrap_or_else(|_| panic!("{what}")).unwrap().clone()
}

pub(crate) async fn wait_open(camera: &AravisCamera) {
    wait_for(camera, "the camera does not open", |link| {
        matches!(link, CameraLink::Open { .. })
    })
    .await;
}

pub(crate) async fn wait_lost(camera: &AravisCamera) -> String {
    let lost = |link: &CameraLink| matches!(link, CameraLink::Lost { reason } if !reason.contains("is being opened"));
    match wait_for(camera, "the camera is not lost", lost).await {
        CameraLink::Lost { reason } => reason,
        CameraLink::Open { .. } => unreachable!(),
    }
}

pub(crate) async fn open(config: CameraConfig, trigger: TriggerMode) -> (AravisCamera, AppliedSettings) {
    let camera = AravisCamera::open(config);
    wait_open(&camera).await;
    let applied = camera.configure(settings(trigger)).await.unwrap();
    (camera, applied)
}

/// The next event; `None` at the end.
pub(crate) async fn next(frames: &mut Frames) -> Option<FrameEvent> {
    let event = tokio::time::timeout(PATIENCE, frames.recv()).await;
    event.expect("no frame, no fault and no end")
}

pub(crate) async fn next_frame(frames: &mut Frames) -> Frame {
    match next(frames).await {
        Some(FrameEvent::Frame(frame)) => frame,
        Some(FrameEvent::Fault(fault)) => panic!("in place of a frame: {fault}"),
        None => panic!("the end in place of a frame"),
    }
}

pub(crate) async fn next_fault(frames: &mut Frames) -> FrameFault {
    match next(frames).await {
        Some(FrameEvent::Fault(fault)) => fault,
        Some(FrameEvent::Frame(frame)) => panic!("frame {} in place of a fault", frame.index),
        None => panic!("the end in place of a fault"),
    }
}

/// Whether these are the pixels of the frame of this index, counted by the device.
pub(crate) fn is_picture(frame: &Frame, index: u32) -> bool {
    let pixels = frame.pixels.chunks_exact(2).enumerate();
    frame.pixels.len() == frame.width as usize * frame.height as usize * 2
        && pixels
            .map(|(place, bytes)| (place, u16::from_le_bytes([bytes[0], bytes[1]])))
            .all(|(place, value)| value == pixel(index, place))
}

/// Pulses the line, like the light controller does.
pub(crate) fn pulse(servers: &[&Server], count: u32) {
    let start = Instant::now() + Duration::from_millis(2);
    for step in 0..count {
        for server in servers {
            server.line_trigger(start + step * PERIOD);
        }
    }
}

/// Until the device has sent so many frames in all.
pub(crate) async fn wait_sent(server: &Server, frames: u64) {
    let end = Instant::now() + PATIENCE;
    while server.counters().frames_sent < frames {
        assert!(Instant::now() < end, "the device sends nothing");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

pub(crate) fn statistic(camera: &AravisCamera, name: &str) -> u64 {
    match &*camera.link().borrow() {
        CameraLink::Open { statistics, .. } => {
            let found = statistics.iter().find(|(other, _)| other == name);
            found.unwrap_or_else(|| panic!("no {name} in {statistics:?}")).1
        }
        CameraLink::Lost { reason } => panic!("the camera is lost: {reason}"),
    }
}

/// Another client of the device, which holds control until the device has not heard of it for a minute.
pub(crate) struct Rival(std::net::UdpSocket);

impl Rival {
    pub(crate) fn take(server: SocketAddrV4) -> Self {
        let socket = std::net::UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        socket.connect(server).unwrap();
        socket.set_read_timeout(Some(PATIENCE)).unwrap();
        let rival = Self(socket);
        rival.write(gige_vision::bootstrap::CONTROL_PRIVILEGE, 2);
        rival.write(gige_vision::bootstrap::HEARTBEAT_TIMEOUT, 60_000);
        rival
    }

    pub(crate) fn let_go(&self) {
        self.write(gige_vision::bootstrap::CONTROL_PRIVILEGE, 0);
    }

    fn write(&self, address: u32, value: u32) {
        use gige_vision::gvcp::{Answer, Command, Request};
        let request = Request {
            id: 7,
            acknowledge: true,
            command: Command::WriteRegisters(vec![(address, value)]),
        };
        self.0.send(&request.encode()).unwrap();
        let mut datagram = [0; 64];
        let length = self.0.recv(&mut datagram).unwrap();
        let (_, answer) = Answer::decode(&datagram[..length]).unwrap();
        assert_eq!(answer, Answer::WriteRegisters(1));
    }
}

/// Traffic of others on this host: a stream of frames that is none of our camera's. Ends when it is dropped.
pub(crate) struct Noise {
    ended: std::sync::Arc<std::sync::atomic::AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Noise {
    pub(crate) fn start(last: u8) -> Self {
        use gige_vision::gvsp::{Content, Packet, STATUS_OK};
        use std::sync::atomic::Ordering;

        let socket = std::net::UdpSocket::bind((address(last), 0)).unwrap();
        let to = socket.local_addr().unwrap();
        let ended = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
        let asked_to_end = std::sync::Arc::clone(&ended);
        let thread = std::thread::spawn(move || {
            let mut datagram = Vec::new();
            let mut packet_id = 0;
            while !asked_to_end.load(Ordering::Acquire) {
                packet_id = packet_id % 9 + 1;
                Packet {
                    status: STATUS_OK,
                    block_id: 50,
                    packet_id,
                    content: Content::Payload(&[0xaa; 500]),
                }
                .encode(&mut datagram);
                socket.send_to(&datagram, to).unwrap();
                std::thread::yield_now();
            }
        });
        Self {
            ended,
            thread: Some(thread),
        }
    }
}

impl Drop for Noise {
    fn drop(&mut self) {
        self.ended.store(true, std::sync::atomic::Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}
