//! Which exposures are taken, and when.

use std::collections::VecDeque;
use std::time::Duration;

use bytes::Bytes;

use super::memory::Memory;
use crate::config::Faults;
use crate::features::{MODE_MULTI_FRAME, MODE_SINGLE_FRAME, SOURCE_LINE0, SOURCE_SOFTWARE};
use crate::frame_source::FrameRequest;
use crate::gvsp::Leader;
use crate::transmit::Frame;
use crate::{PixelFormat, Register};

/// Exposures that wait to be sent at most; the sensor has memory for a whole sequence of lights and more.
const MOST_PENDING: usize = 32;

#[derive(Debug, Default)]
pub(super) struct Acquisition {
    running: bool,
    /// Rises with every start, so that images of an earlier one are known.
    number: u64,
    /// Frames that may still be exposed, in the modes that count them.
    remaining: Option<u32>,
    exposed: u32,
    /// Exposed or about to be, not yet handed out.
    pending: VecDeque<FrameRequest>,
    /// Handed out, not yet delivered.
    in_hand: bool,
    /// End of the last exposure.
    busy_until: Duration,
    /// When the next frame without trigger begins.
    free_run_at: Option<Duration>,
    /// The last one given.
    block_id: u16,
}

impl Acquisition {
    pub(super) fn is_running(&self) -> bool {
        self.running
    }

    pub(super) fn start(&mut self, now: Duration, memory: &Memory) {
        self.stop();
        self.running = true;
        self.number += 1;
        self.exposed = 0;
        self.remaining = match memory.get(Register::AcquisitionMode) {
            MODE_SINGLE_FRAME => Some(1),
            MODE_MULTI_FRAME => Some(memory.get(Register::AcquisitionFrameCount)),
            _ => None,
        };
        self.free_run_at = Some(now);
    }

    /// What has not been exposed is not; a frame on its way arrives.
    pub(super) fn stop(&mut self) {
        self.running = false;
        self.pending.clear();
        self.in_hand = false;
        self.busy_until = Duration::ZERO;
        self.free_run_at = None;
    }

    pub(super) fn restart_block_ids(&mut self) {
        self.block_id = 0;
    }

    pub(super) fn software_trigger(&mut self, at: Duration, memory: &Memory) -> bool {
        memory.get(Register::TriggerSource) == SOURCE_SOFTWARE && self.trigger(at, memory)
    }

    pub(super) fn line_trigger(&mut self, at: Duration, memory: &Memory) -> bool {
        memory.get(Register::TriggerSource) == SOURCE_LINE0 && self.trigger(at, memory)
    }

    fn trigger(&mut self, at: Duration, memory: &Memory) -> bool {
        memory.get(Register::TriggerMode) == 1 && self.expose(at, memory)
    }

    /// A sensor that collects light cannot begin again; whether the frame is taken.
    fn expose(&mut self, at: Duration, memory: &Memory) -> bool {
        let full = self.pending.len() >= MOST_PENDING;
        if !self.running || full || self.remaining == Some(0) || at < self.busy_until {
            return false;
        }
        let exposure = Duration::from_nanos(u64::from(memory.get(Register::ExposureTime)));
        let gain_millidecibels = memory.get(Register::Gain);
        self.pending.push_back(FrameRequest {
            triggered_at: at,
            exposure,
            gain_decibels: f64::from(gain_millidecibels) / 1000.0,
            black_level: memory.get(Register::BlackLevel),
            pixel_format: memory.pixel_format(),
            width: memory.get(Register::Width),
            height: memory.get(Register::Height),
            offset_x: memory.get(Register::OffsetX),
            offset_y: memory.get(Register::OffsetY),
            binning: (
                memory.get(Register::BinningHorizontal),
                memory.get(Register::BinningVertical),
            ),
            index: self.exposed,
            acquisition: self.number,
        });
        self.busy_until = at + exposure;
        self.exposed += 1;
        self.remaining = self.remaining.map(|remaining| remaining - 1);
        true
    }

    /// The exposure that has ended and whose image is wanted now.
    pub(super) fn due_exposure(&mut self, now: Duration, memory: &Memory, delay: Duration) -> Option<FrameRequest> {
        if self.in_hand {
            return None;
        }
        self.run_freely(now, memory);
        let request = *self.pending.front().filter(|request| ready_at(request, delay) <= now)?;
        self.pending.pop_front();
        self.in_hand = true;
        Some(request)
    }

    /// Frames without trigger follow each other at the frame rate, or as fast as they can be sent.
    fn run_freely(&mut self, now: Duration, memory: &Memory) {
        let Some(at) = self.free_run_at.filter(|at| *at <= now) else {
            return;
        };
        if !self.running || memory.get(Register::TriggerMode) != 0 || !self.pending.is_empty() {
            return;
        }
        let period = Duration::from_secs(1000) / memory.get(Register::AcquisitionFrameRate).max(1);
        let begin = at.max(self.busy_until);
        let begin = if begin + period < now { now } else { begin };
        if self.expose(begin, memory) {
            self.free_run_at = Some(begin + period);
        } else {
            self.free_run_at = None;
        }
    }

    /// When there will be something to do.
    pub(super) fn next_exposure(&self, memory: &Memory, delay: Duration) -> Option<Duration> {
        if self.in_hand {
            return None;
        }
        let pending = self.pending.front().map(|request| ready_at(request, delay));
        let runs_freely = self.running && memory.get(Register::TriggerMode) == 0;
        pending.or(self.free_run_at.filter(|_| runs_freely))
    }

    /// The frame of a delivered image, unless its acquisition has ended.
    pub(super) fn frame(
        &mut self,
        request: &FrameRequest,
        image: Bytes,
        packet_size: u32,
        faults: &Faults,
    ) -> Option<Frame> {
        if !self.running || request.acquisition != self.number {
            return None;
        }
        self.in_hand = false;
        if self.remaining == Some(0) && self.pending.is_empty() {
            self.stop();
        }
        self.block_id = self.block_id.checked_add(1).unwrap_or(1);
        let mut leader = Leader {
            timestamp_nanos: request.triggered_at.as_nanos() as u64,
            pixel_format: request.pixel_format,
            width: request.width,
            height: request.height,
            offset_x: request.offset_x,
            offset_y: request.offset_y,
        };
        let image = spoil(&mut leader, image, faults);
        Some(Frame::new(self.block_id, leader, image, packet_size))
    }

    /// No image came for the exposure that was handed out.
    pub(super) fn give_up(&mut self, request: &FrameRequest) {
        if request.acquisition == self.number {
            self.in_hand = false;
        }
    }
}

fn ready_at(request: &FrameRequest, delay: Duration) -> Duration {
    request.triggered_at + request.exposure + delay
}

fn spoil(leader: &mut Leader, mut image: Bytes, faults: &Faults) -> Bytes {
    if faults.short_frames {
        leader.height /= 2;
        image.truncate(leader.height as usize * leader.width as usize * leader.pixel_format.bytes_per_pixel());
    }
    if faults.wrong_pixel_format {
        leader.pixel_format = match leader.pixel_format {
            PixelFormat::Mono8 => PixelFormat::Mono16,
            PixelFormat::Mono12 | PixelFormat::Mono16 => PixelFormat::Mono8,
        };
    }
    image
}
