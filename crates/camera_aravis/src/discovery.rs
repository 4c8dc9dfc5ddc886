//! Which cameras there are. Nothing here runs unless it is asked for: finding cameras takes broadcasts.

use std::io::ErrorKind;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use devices::CameraIdentity;
use gige_vision::bootstrap as at;
use gige_vision::gvcp::{Answer, Command, GVCP_PORT, Request};

use crate::CameraAravisError;

/// Questions that may get lost.
const ATTEMPTS: u32 = 3;
/// Time for an answer.
const PATIENCE: Duration = Duration::from_millis(300);

/// A camera that answered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CameraSighting {
    /// Who it says it is.
    pub identity: CameraIdentity,
    /// Name that its user gave it.
    pub user_name: String,
    /// Whether some client holds control of it.
    pub in_use: bool,
}

/// Asks one address whether a GigE Vision camera is there, without taking control and without a broadcast. Blocks for
/// a second at most.
pub fn probe(ip: Ipv4Addr) -> Result<CameraSighting, CameraAravisError> {
    let mut conversation = Conversation::open(SocketAddr::from((ip, GVCP_PORT)))?;
    let registers = match conversation.ask(Command::Discovery)? {
        Answer::Discovery(registers) => registers,
        other => return Err(conversation.odd(&format!("{other:?}"))),
    };
    let privilege = conversation.ask(Command::ReadRegisters(vec![at::CONTROL_PRIVILEGE]))?;
    let in_use = match privilege {
        Answer::ReadRegisters(values) => {
            let held = at::PRIVILEGE_CONTROL | at::PRIVILEGE_EXCLUSIVE;
            values.first().is_some_and(|value| value & held != 0)
        }
        // Exclusive control forbids even this.
        _ => true,
    };
    Ok(CameraSighting {
        identity: CameraIdentity {
            vendor: text(&registers, at::VENDOR, 32),
            model: text(&registers, at::MODEL, 32),
            serial: text(&registers, at::SERIAL, 16),
            address: ip.to_string(),
        },
        user_name: text(&registers, at::USER_NAME, 16),
        in_use,
    })
}

fn text(registers: &[u8], address: u32, length: usize) -> String {
    let start = address as usize;
    let bytes = registers.get(start..start + length).unwrap_or_default();
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

struct Conversation {
    socket: UdpSocket,
    address: SocketAddr,
    id: u16,
}

impl Conversation {
    fn open(address: SocketAddr) -> Result<Self, CameraAravisError> {
        let open = || {
            let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
            socket.connect(address)?;
            socket.set_read_timeout(Some(PATIENCE))?;
            Ok(socket)
        };
        let socket = open().map_err(|source| CameraAravisError::Network {
            address,
            action: "open a socket",
            source,
        })?;
        // Cameras and hosts expect this id in discovery, and others elsewhere.
        let id = u16::MAX;
        Ok(Self { socket, address, id })
    }

    fn ask(&mut self, command: Command) -> Result<Answer, CameraAravisError> {
        let request = Request {
            id: self.id,
            acknowledge: true,
            command,
        };
        self.id -= 1;
        for _ in 0..ATTEMPTS {
            // Nobody there is told by the answer that does not come.
            let _ = self.socket.send(&request.encode());
            if let Some(answer) = self.hear(request.id)? {
                return Ok(answer);
            }
        }
        Err(CameraAravisError::Silent {
            address: self.address,
            millis: (PATIENCE * ATTEMPTS).as_millis(),
        })
    }

    fn hear(&self, id: u16) -> Result<Option<Answer>, CameraAravisError> {
        let end = Instant::now() + PATIENCE;
        let mut datagram = [0; 1024];
        while Instant::now() < end {
            match self.socket.recv(&mut datagram) {
                Ok(length) => match Answer::decode(&datagram[..length]) {
                    Ok((heard, answer)) if heard == id => return Ok(Some(answer)),
                    // A late answer to an earlier question.
                    Ok(_) => {}
                    Err(error) => return Err(self.odd(&error.to_string())),
                },
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => return Ok(None),
                // The time is over, or a signal came.
                Err(_) => {}
            }
        }
        Ok(None)
    }

    fn odd(&self, reason: &str) -> CameraAravisError {
        CameraAravisError::Answer {
            address: self.address,
            reason: reason.to_owned(),
        }
    }
}

/// Asks every network of this host which GigE Vision cameras there are, by broadcast. Blocks for about a second.
#[cfg(feature = "aravis")]
pub fn list_cameras() -> Result<Vec<CameraSighting>, CameraAravisError> {
    let sightings = addresses()?.into_iter().filter_map(|(_, address)| {
        let ip = address.parse().ok()?;
        // It may have gone meanwhile.
        probe(ip).ok()
    });
    Ok(sightings.collect())
}

/// Asks every network of this host which GigE Vision cameras there are, by broadcast. Blocks for about a second.
#[cfg(not(feature = "aravis"))]
pub fn list_cameras() -> Result<Vec<CameraSighting>, CameraAravisError> {
    Err(CameraAravisError::WithoutAravis)
}

/// The address of the camera of this name: serial number, MAC address, user's name or Aravis' own id.
#[cfg(feature = "aravis")]
pub(crate) fn find(guid: &str) -> Result<String, CameraAravisError> {
    let guid = guid.trim();
    let mut seen = Vec::new();
    for (names, address) in addresses()? {
        let called = |sighting: &CameraSighting| sighting.identity.serial == guid || sighting.user_name == guid;
        let sighting = address.parse().ok().and_then(|ip| probe(ip).ok());
        if names.iter().any(|name| name == guid) || sighting.as_ref().is_some_and(called) {
            return Ok(address);
        }
        seen.push(sighting.map_or(address, |sighting| sighting.identity.serial));
    }
    Err(CameraAravisError::NoSuchCamera {
        guid: guid.to_owned(),
        seen,
    })
}

/// Names and address of every GigE Vision camera that answers a broadcast.
#[cfg(feature = "aravis")]
fn addresses() -> Result<Vec<([String; 2], String)>, CameraAravisError> {
    use std::sync::{LazyLock, Mutex, PoisonError};

    /// Aravis keeps one list for the whole process.
    static ARAVIS: LazyLock<Option<Mutex<aravis::Aravis>>> =
        LazyLock::new(|| aravis::Aravis::initialize().ok().map(Mutex::new));

    let aravis = ARAVIS.as_ref().ok_or(CameraAravisError::AravisTaken)?;
    let devices = aravis.lock().unwrap_or_else(PoisonError::into_inner).get_device_list();
    let text = |name: &std::ffi::CString| name.to_string_lossy().into_owned();
    let cameras = devices.iter().filter(|device| text(&device.protocol) == "GigEVision");
    Ok(cameras
        .map(|device| ([text(&device.id), text(&device.physical_id)], text(&device.address)))
        .collect())
}
