//! The stream of frames: how it is set up, and what is kept of it.

use std::rc::Rc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use aravis::prelude::*;
use aravis::{BufferPayloadType, BufferStatus, PixelFormat, Stream};
use devices::{AppliedSettings, CameraError, FrameFault};

use super::Report;
use super::buffers::{Buffers, clear};
use super::features::Features;
use super::transport;
use crate::CameraConfig;
use crate::camera::Event;
use crate::frame_order::FrameOrder;

/// Statistics of Aravis that are worth telling, and what they are called here.
const COUNTERS: [(&str, &str); 8] = [
    ("n_completed_buffers", "frames_completed"),
    ("n_failures", "frames_failed"),
    ("n_missing_frames", "frames_missing"),
    ("n_underruns", "frames_without_buffer"),
    ("n_received_packets", "packets_received"),
    ("n_missing_packets", "packets_missing"),
    ("n_resend_requests", "packets_asked_again"),
    ("n_resent_packets", "packets_resent"),
];

/// A running stream.
pub(super) struct Streaming {
    stream: Stream,
    pub(super) number: u64,
    pub(super) applied: AppliedSettings,
    pub(super) order: FrameOrder,
    buffers: Rc<Buffers>,
    /// Whether the kernel's UDP is passed by.
    packet_socket: bool,
    /// Buffers given to the stream and not yet seen again.
    lent: usize,
}

/// A frame as it came out of the stream.
pub(super) struct Arrival {
    pub(super) id: Option<u64>,
    pub(super) exposed_at: Option<Duration>,
    pub(super) fault: Option<FrameFault>,
}

impl Streaming {
    /// Opens the stream, gives it its buffers and starts the acquisition.
    pub(super) fn start(
        features: Features<'_>,
        config: &CameraConfig,
        applied: AppliedSettings,
        reports: &Sender<Event>,
        number: u64,
        buffers: Rc<Buffers>,
    ) -> Result<Self, CameraError> {
        let camera = features.camera;
        let (stream, packet_socket) = transport::open(features, config)?;
        for _ in 0..config.buffers {
            stream.push_buffer(buffers.take());
        }
        report_buffers(&stream, reports, number);
        camera
            .start_acquisition()
            .map_err(|error| features.failed("starting the acquisition", &error))?;
        Ok(Self {
            stream,
            number,
            applied,
            order: FrameOrder::default(),
            buffers,
            packet_socket,
            lent: config.buffers,
        })
    }

    /// Frames that have begun to arrive and have not been looked at.
    pub(super) fn on_their_way(&self) -> usize {
        let (waiting, _) = self.stream.n_buffers();
        self.lent.saturating_sub(waiting.max(0) as usize)
    }

    pub(super) fn note_return(&mut self) {
        self.lent = self.lent.saturating_sub(1);
    }

    /// What came, against what was set.
    pub(super) fn examine(&self, buffer: &aravis::Buffer) -> Arrival {
        let known = |value: u64| (value != 0).then_some(value);
        Arrival {
            id: known(buffer.frame_id()),
            exposed_at: known(buffer.timestamp()).map(Duration::from_nanos),
            fault: self.find_fault(buffer),
        }
    }

    fn find_fault(&self, buffer: &aravis::Buffer) -> Option<FrameFault> {
        let expected = PIXEL_FORMAT_NAME;
        if buffer.status() != BufferStatus::Success {
            let status = status_name(buffer.status());
            return Some(FrameFault::Incomplete { status });
        }
        if buffer.payload_type() != BufferPayloadType::Image {
            let found = format!("none: the payload is {:?}", buffer.payload_type());
            return Some(FrameFault::Format { found, expected });
        }
        if buffer.image_pixel_format() != PixelFormat::MONO_16 {
            let found = format_name(buffer.image_pixel_format());
            return Some(FrameFault::Format { found, expected });
        }
        let (width, height) = (self.applied.width, self.applied.height);
        let (_, found) = buffer.data();
        let size = (i64::from(buffer.image_width()), i64::from(buffer.image_height()));
        if size != (i64::from(width), i64::from(height)) || found != self.buffers.bytes() {
            return Some(FrameFault::Size {
                found,
                expected: self.buffers.bytes(),
                width,
                height,
            });
        }
        None
    }

    /// Gives the stream a buffer in place of one that it filled.
    pub(super) fn replenish(&mut self) {
        self.lent += 1;
        self.stream.push_buffer(self.buffers.take());
    }

    /// Gives the buffer itself back.
    pub(super) fn give_back(&mut self, buffer: aravis::Buffer) {
        self.lent += 1;
        clear(&buffer);
        self.stream.push_buffer(buffer);
    }

    pub(super) fn statistics(&self) -> Vec<(String, u64)> {
        let mut statistics: Vec<(String, u64)> = COUNTERS
            .iter()
            .map(|(name, ours)| ((*ours).to_owned(), self.stream.info_uint64_by_name(name)))
            .collect();
        statistics.push(("packet_socket".into(), u64::from(self.packet_socket)));
        statistics
    }
}

impl Drop for Streaming {
    fn drop(&mut self) {
        self.stream.set_emit_signals(false);
    }
}

const PIXEL_FORMAT_NAME: &str = "Mono16";

pub(super) fn frame_bytes(applied: &AppliedSettings) -> usize {
    applied.width as usize * applied.height as usize * 2
}

/// Frames are taken out on Aravis' own thread, at once, and handled on ours.
fn report_buffers(stream: &Stream, reports: &Sender<Event>, number: u64) {
    let reports = reports.clone();
    stream.connect_new_buffer(move |stream| {
        let at = Instant::now();
        while let Some(buffer) = stream.try_pop_buffer() {
            let report = Report::Buffer {
                stream: number,
                buffer,
                at,
            };
            // A driver that has ended wants no frames.
            let _ = reports.send(Event::Report(report));
        }
    });
    stream.set_emit_signals(true);
}

fn status_name(status: BufferStatus) -> String {
    match status {
        BufferStatus::Timeout => "the rest of it did not come in time".into(),
        BufferStatus::MissingPackets => "packets are missing".into(),
        BufferStatus::WrongPacketId => "it has more packets than it should".into(),
        BufferStatus::SizeMismatch => "it does not fit its buffer".into(),
        BufferStatus::Aborted => "the stream was closed".into(),
        other => format!("{other:?}"),
    }
}

fn format_name(format: PixelFormat) -> String {
    match format {
        PixelFormat::MONO_8 => "Mono8".into(),
        PixelFormat::MONO_10 => "Mono10".into(),
        PixelFormat::MONO_12 => "Mono12".into(),
        PixelFormat::MONO_14 => "Mono14".into(),
        other => format!("{:#010x}", other.raw()),
    }
}
