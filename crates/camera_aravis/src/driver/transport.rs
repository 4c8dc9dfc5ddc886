//! How packets travel from the camera to the stream.

use std::time::Duration;

use aravis::glib::object::Cast;
use aravis::prelude::*;
use aravis::{GvPacketSizeAdjustment, GvStream, GvStreamOption, GvStreamSocketBuffer, Stream};
use devices::CameraError;

use super::features::Features;
use crate::CameraConfig;

/// A packet socket hears every packet of the host until its filter is in place, and Aravis takes them for parts of
/// frames. As long as the kernel may hold back what it heard, and a thread may take to look at it.
const SETTLING: Duration = Duration::from_millis(25);
/// Quiet moments are short on a busy host.
const ATTEMPTS: usize = 4;

/// Bytes of a socket buffer that no kernel grants without being told to; it gives what it may.
const AMPLE_BUFFER: u32 = 64 << 20;

/// A stream that has received nothing, and whether it is received by a packet socket.
pub(super) fn open(features: Features<'_>, config: &CameraConfig) -> Result<(Stream, bool), CameraError> {
    if config.packet_socket && may_use_packet_sockets() {
        for _ in 0..ATTEMPTS {
            let stream = create(features, config, true)?;
            std::thread::sleep(SETTLING);
            // The camera does not send yet: whatever came is somebody else's.
            if stream.info_uint64_by_name("n_received_packets") == 0 {
                return Ok((stream, true));
            }
        }
        tracing::warn!(
            guid = features.guid,
            "the host is too busy for a packet socket; frames are received by UDP"
        );
    }
    Ok((create(features, config, false)?, false))
}

fn create(features: Features<'_>, config: &CameraConfig, packet_socket: bool) -> Result<Stream, CameraError> {
    let camera = features.camera;
    camera.gv_set_packet_size_adjustment(GvPacketSizeAdjustment::Never);
    camera.gv_set_stream_options(if packet_socket {
        GvStreamOption::NONE
    } else {
        GvStreamOption::PACKET_SOCKET_DISABLED
    });
    features.set_integer("GevSCPSPacketSize", i64::from(config.packet_size))?;
    // The buffer of a UDP socket takes a few packets; the ring of a packet socket takes six frames, but not the eight
    // of a capture at whatever speed they come.
    let delay = if packet_socket {
        config.packet_delay / 2
    } else {
        config.packet_delay
    };
    camera
        .gv_set_packet_delay(delay.as_nanos() as i64)
        .map_err(|error| features.refusal("GevSCPD", &format!("{delay:?}"), &error))?;
    let stream = camera
        .create_stream()
        .map_err(|error| features.failed("opening the stream", &error))?;
    if let Some(stream) = stream.downcast_ref::<GvStream>() {
        tune(stream, config);
    }
    Ok(stream)
}

fn tune(stream: &GvStream, config: &CameraConfig) {
    let micros = |time: Duration| time.as_micros() as u32;
    // Every packet of a frame may be asked for again: a capture needs all of its frames.
    stream.set_packet_request_ratio(1.0);
    stream.set_initial_packet_timeout(micros(config.packet_patience));
    stream.set_packet_timeout(micros(config.resend_patience));
    stream.set_frame_retention(micros(config.frame_retention));
    // Aravis' own choice is the size of a frame, which for small ones is less than the kernel's default.
    stream.set_socket_buffer(GvStreamSocketBuffer::Fixed);
    stream.set_socket_buffer_size(config.socket_buffer.unwrap_or(AMPLE_BUFFER) as i32);
}

/// Aravis tries the same, and says nothing when it fails.
fn may_use_packet_sockets() -> bool {
    use rustix::net::{AddressFamily, SocketType, eth, socket};
    socket(AddressFamily::PACKET, SocketType::RAW, Some(eth::ALL)).is_ok()
}
