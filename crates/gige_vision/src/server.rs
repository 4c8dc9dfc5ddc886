//! Serves a [`Device`] over UDP with three plain threads: control port, broadcast discovery, stream.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use socket2::{Domain, Protocol, SockAddr, Socket, Type};

use crate::config::{Counters, DeviceConfig, Faults};
use crate::device::{Device, Step};
use crate::frame_source::FrameSource;
use crate::gvcp::{Command, GVCP_PORT, Request};
use crate::{GigeVisionError, Register};

/// How often a thread that hears nothing looks whether it shall end.
const LOOK_AROUND: Duration = Duration::from_millis(50);
/// The largest datagram there is.
const DATAGRAM_BYTES: usize = 65536;

/// What the threads share.
struct Shared {
    device: Mutex<Device>,
    changed: Condvar,
    ended: AtomicBool,
    started: Instant,
}

impl Shared {
    /// A frame source that panicked must not take the control port with it.
    fn device(&self) -> MutexGuard<'_, Device> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Acquire)
    }
}

/// A device on the network. Dropping it is the device's sudden death: it says nothing to its client.
pub struct Server {
    shared: Arc<Shared>,
    address: SocketAddrV4,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Serves at the configured address and the standard port.
    pub fn start(config: &DeviceConfig, source: impl FrameSource + 'static) -> Result<Self, GigeVisionError> {
        Self::start_on_port(config, GVCP_PORT, source)
    }

    /// Serves at another port (0: any free one), where only clients of your own will look.
    pub fn start_on_port(
        config: &DeviceConfig,
        port: u16,
        source: impl FrameSource + 'static,
    ) -> Result<Self, GigeVisionError> {
        let device = Device::new(config)?;
        let control = bind(SocketAddrV4::new(config.ip, port))?;
        let address = local_address(&control, config.ip);
        let stream = bind(SocketAddrV4::new(config.ip, 0))?;
        let discovery = bind_shared(SocketAddrV4::new(Ipv4Addr::BROADCAST, address.port()))?;
        let answers = control
            .try_clone()
            .map_err(|source| GigeVisionError::Bind { address, source })?;
        let shared = Arc::new(Shared {
            device: Mutex::new(device),
            changed: Condvar::new(),
            ended: AtomicBool::new(false),
            started: Instant::now(),
        });
        let (first, second, third) = (Arc::clone(&shared), Arc::clone(&shared), Arc::clone(&shared));
        let threads = vec![
            std::thread::spawn(move || serve_control(&first, &control)),
            std::thread::spawn(move || serve_discovery(&second, &discovery, &answers)),
            std::thread::spawn(move || serve_stream(&third, &stream, source)),
        ];
        Ok(Self {
            shared,
            address,
            threads,
        })
    }

    /// Where the control port is.
    pub fn address(&self) -> SocketAddrV4 {
        self.address
    }

    /// Device time of an instant; zero for what was before its start.
    pub fn device_time(&self, at: Instant) -> Duration {
        at.saturating_duration_since(self.shared.started)
    }

    /// The rising edge of the trigger line, at an instant that is past or to come.
    pub fn line_trigger(&self, at: Instant) {
        let at = self.device_time(at);
        self.shared.device().line_trigger(at);
        self.shared.changed.notify_all();
    }

    /// Changes what goes wrong, from the next packet on.
    pub fn set_faults(&self, faults: Faults) {
        self.shared.device().set_faults(faults);
        self.shared.changed.notify_all();
    }

    /// What has happened so far.
    pub fn counters(&self) -> Counters {
        self.shared.device().counters()
    }

    /// The client that holds control.
    pub fn controller(&self) -> Option<SocketAddrV4> {
        self.shared.device().controller()
    }

    /// Whether acquisition runs: a trigger would be heard.
    pub fn is_acquiring(&self) -> bool {
        self.shared.device().is_acquiring()
    }

    /// The value of one of the device's registers.
    pub fn register(&self, register: Register) -> u32 {
        self.shared.device().register(register)
    }

    /// The device dies: nothing is said any more, and its ports are free when this returns.
    pub fn die(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Release);
        self.shared.changed.notify_all();
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on standard error.
            let _ = thread.join();
        }
    }
}

fn bind(address: SocketAddrV4) -> Result<UdpSocket, GigeVisionError> {
    let socket = UdpSocket::bind(address).map_err(|source| GigeVisionError::Bind { address, source })?;
    socket
        .set_read_timeout(Some(LOOK_AROUND))
        .map_err(|source| GigeVisionError::Bind { address, source })?;
    Ok(socket)
}

/// Every device of the host hears the same broadcasts.
fn bind_shared(address: SocketAddrV4) -> Result<UdpSocket, GigeVisionError> {
    let open = || -> std::io::Result<UdpSocket> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        socket.set_reuse_address(true)?;
        socket.set_read_timeout(Some(LOOK_AROUND))?;
        socket.bind(&SockAddr::from(address))?;
        Ok(socket.into())
    };
    open().map_err(|source| GigeVisionError::Bind { address, source })
}

fn local_address(socket: &UdpSocket, ip: Ipv4Addr) -> SocketAddrV4 {
    let port = socket.local_addr().map_or(0, |address| address.port());
    SocketAddrV4::new(ip, port)
}

/// Errors that only say that nothing was heard.
fn is_silence(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}

fn serve_control(shared: &Shared, socket: &UdpSocket) {
    let mut datagram = vec![0; DATAGRAM_BYTES];
    while !shared.has_ended() {
        match socket.recv_from(&mut datagram) {
            Ok((length, SocketAddr::V4(from))) => answer(shared, socket, from, &datagram[..length]),
            Ok(_) => {}
            Err(error) if is_silence(&error) => {}
            // The peer of an earlier answer is gone, or the interface is: hear on, without spinning.
            Err(_) => std::thread::sleep(LOOK_AROUND),
        }
    }
}

fn answer(shared: &Shared, socket: &UdpSocket, from: SocketAddrV4, datagram: &[u8]) {
    let answer = shared.device().handle_command(shared.now(), from, datagram);
    if let Some(answer) = answer
        && socket.send_to(&answer, from).is_err()
    {
        shared.device().note_send_error();
    }
    shared.changed.notify_all();
}

/// A broadcast is answered from the control port, so that the host learns the device's own address.
///
/// Hosts ask on each of their interfaces, and the system hands all of that to this socket. A device on loopback must
/// not be found through another interface: the host would then wait for the stream there.
fn serve_discovery(shared: &Shared, broadcasts: &UdpSocket, control: &UdpSocket) {
    let mut datagram = [0; 64];
    let ip = shared.device().ip();
    while !shared.has_ended() {
        match broadcasts.recv_from(&mut datagram) {
            Ok((length, SocketAddr::V4(from))) => {
                let heard = &datagram[..length];
                let is_our_link = from.ip().is_loopback() || !ip.is_loopback();
                if is_our_link && Request::decode(heard).is_ok_and(|request| request.command == Command::Discovery) {
                    answer(shared, control, from, heard);
                }
            }
            Ok(_) => {}
            Err(error) if is_silence(&error) => {}
            Err(_) => std::thread::sleep(LOOK_AROUND),
        }
    }
}

fn serve_stream(shared: &Shared, socket: &UdpSocket, mut source: impl FrameSource) {
    let mut datagram = Vec::with_capacity(DATAGRAM_BYTES);
    let mut device = shared.device();
    while !shared.has_ended() {
        let now = shared.now();
        match device.next_step(now, &mut datagram) {
            Step::Send(destination) => {
                drop(device);
                let sent = socket.send_to(&datagram, destination);
                device = shared.device();
                if sent.is_err() {
                    device.note_send_error();
                }
            }
            Step::Expose(request) => {
                drop(device);
                let image = source.frame(&request);
                device = shared.device();
                // A refused image is counted by the device; a stale one is nobody's any more.
                let _ = device.deliver(&request, image);
            }
            Step::Wait(until) => device = wait(shared, device, until.saturating_sub(now).min(LOOK_AROUND)),
            Step::Idle => device = wait(shared, device, LOOK_AROUND),
        }
    }
}

fn wait<'a>(shared: &Shared, device: MutexGuard<'a, Device>, time: Duration) -> MutexGuard<'a, Device> {
    let woken = shared.changed.wait_timeout(device, time);
    woken.unwrap_or_else(PoisonError::into_inner).0
}
