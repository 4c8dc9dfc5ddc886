//! A camera from its opening to its loss.

use std::rc::Rc;
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

use aravis::prelude::*;
use aravis::{Buffer, BufferStatus, Camera, Device};
use devices::{AppliedSettings, CameraError, CameraIdentity, CameraLink, CameraSettings, Frames, TriggerMode};

use super::Report;
use super::buffers::{self, Buffers};
use super::clock::Clock;
use super::features::Features;
use super::opening::{self, Opened};
use super::stream::{Streaming, frame_bytes};
use crate::CameraConfig;
use crate::armed::{Armed, Image};
use crate::camera::Event;
use crate::frame_order::Step;

/// An open camera, its stream, and who waits for frames. Fields are dropped in this order: the stream before the
/// camera that sends it.
pub(super) struct Session {
    armed: Option<Armed>,
    streaming: Option<Streaming>,
    buffers: Option<Rc<Buffers>>,
    clock: Clock,
    device: Device,
    camera: Camera,
    identity: CameraIdentity,
    number: u64,
    config: CameraConfig,
    reports: Sender<Event>,
    /// Of streams that have been replaced.
    earlier: Vec<(String, u64)>,
}

impl Session {
    /// The reason why not is for people.
    pub(super) fn open(config: &CameraConfig, reports: &Sender<Event>, number: u64) -> Result<Self, String> {
        let Opened {
            camera,
            device,
            identity,
        } = opening::open(config)?;
        let clock = Clock::of(&device)
            .map_err(|error| format!("its clock cannot be read: {error}"))?
            .ok_or("it has no clock (tick frequency 0), so stale frames could not be told from new ones")?;
        let lost = reports.clone();
        device.connect_control_lost(move |_| {
            let report = Report::ControlLost { session: number };
            // A driver that has ended does not care.
            let _ = lost.send(Event::Report(report));
        });
        Ok(Self {
            armed: None,
            streaming: None,
            buffers: None,
            clock,
            device,
            camera,
            identity,
            number,
            config: config.clone(),
            reports: reports.clone(),
            earlier: Vec::new(),
        })
    }

    pub(super) fn identity(&self) -> &CameraIdentity {
        &self.identity
    }

    pub(super) fn link(&self) -> CameraLink {
        let mut statistics = self.streaming.as_ref().map(Streaming::statistics).unwrap_or_default();
        for (name, value) in &mut statistics {
            let earlier = self.earlier.iter().find(|(other, _)| other == name);
            if let Some((_, before)) = earlier {
                *value += before;
            }
        }
        CameraLink::Open {
            identity: self.identity.clone(),
            statistics,
        }
    }

    /// Whether frames are awaited.
    pub(super) fn is_armed(&mut self) -> bool {
        self.armed = self.armed.take().filter(|armed| !armed.has_ended());
        self.armed.is_some()
    }

    pub(super) fn disarm(&mut self) {
        self.armed = None;
    }

    /// Leaves the camera quiet and free.
    pub(super) fn close(mut self) {
        if let Err(error) = self.stop() {
            tracing::warn!(%error, "the camera was left as it was");
        }
    }

    fn features(&self) -> Features<'_> {
        Features {
            guid: &self.config.guid,
            camera: &self.camera,
        }
    }

    /// A new stream for every set of settings: block ids begin anew with it, whatever the camera makes of a stopped
    /// acquisition.
    pub(super) fn configure(&mut self, settings: CameraSettings, number: u64) -> Result<AppliedSettings, CameraError> {
        self.stop()?;
        let applied = self.features().apply(&settings, &self.config.trigger_line)?;
        let buffers = self.buffers_of(frame_bytes(&applied));
        let (features, reports) = (self.features(), &self.reports);
        self.streaming = Some(Streaming::start(
            features,
            &self.config,
            applied,
            reports,
            number,
            buffers,
        )?);
        Ok(applied)
    }

    /// The memory of the stream before, where it fits.
    fn buffers_of(&mut self, bytes: usize) -> Rc<Buffers> {
        let kept = self.buffers.take().filter(|buffers| buffers.bytes() == bytes);
        let buffers = kept.unwrap_or_else(|| Rc::new(Buffers::new(bytes, self.config.buffers)));
        self.buffers = Some(Rc::clone(&buffers));
        buffers
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.armed = None;
        let CameraLink::Open { statistics, .. } = self.link() else {
            return Ok(());
        };
        let Some(streaming) = self.streaming.take() else {
            return Ok(());
        };
        self.earlier = statistics
            .into_iter()
            .filter(|(name, _)| name != "packet_socket")
            .collect();
        let stopped = self.camera.stop_acquisition();
        drop(streaming);
        stopped.map_err(|error| self.features().failed("stopping the acquisition", &error))
    }

    pub(super) fn arm(&mut self, count: usize) -> Result<Frames, CameraError> {
        self.armed = None;
        let streaming = self.require_settings("arming")?;
        let now = self.clock.now(&self.device);
        let since = now.map_err(|error| self.features().failed("reading its clock", &error))?;
        let (armed, frames) = Armed::new(count, since, streaming.on_their_way());
        self.armed = Some(armed);
        Ok(frames)
    }

    pub(super) fn trigger(&mut self) -> Result<(), CameraError> {
        let streaming = self.require_settings("a software trigger")?;
        if streaming.applied.settings.trigger != TriggerMode::Software {
            let reason = "the camera listens to its trigger line; allowed with TriggerSource = Software".into();
            return Err(self.features().refused("TriggerSoftware", &"execute", reason));
        }
        let triggered = self.camera.software_trigger();
        triggered.map_err(|error| self.features().failed("a software trigger", &error))
    }

    fn require_settings(&self, action: &'static str) -> Result<&Streaming, CameraError> {
        self.streaming.as_ref().ok_or_else(|| CameraError::Failed {
            guid: self.config.guid.clone(),
            action,
            reason: "it has not been configured yet".into(),
        })
    }

    /// Fails when the camera is lost.
    pub(super) fn take(&mut self, report: Report) -> Result<(), String> {
        match report {
            Report::ControlLost { session } if session == self.number => {
                let silence = "it does not answer, or another client has taken it";
                Err(format!("control of the camera is lost: {silence}"))
            }
            Report::ControlLost { .. } => Ok(()),
            Report::Buffer { stream, buffer, at } => {
                self.receive(stream, buffer, at);
                Ok(())
            }
        }
    }

    fn receive(&mut self, stream: u64, buffer: Buffer, received_at: Instant) {
        let Some(streaming) = self.streaming.as_mut().filter(|streaming| streaming.number == stream) else {
            return;
        };
        if buffer.status() == BufferStatus::Aborted {
            return;
        }
        streaming.note_return();
        let arrival = streaming.examine(&buffer);
        let Step::New { missing } = streaming.order.next(arrival.id) else {
            tracing::warn!(guid = self.config.guid, id = arrival.id, "a frame came twice");
            return streaming.give_back(buffer);
        };
        let armed = self.armed.as_mut();
        let Some(armed) = armed.and_then(|armed| (!armed.is_stale(arrival.exposed_at)).then_some(armed)) else {
            return streaming.give_back(buffer);
        };
        armed.missing(missing);
        if let Some(fault) = arrival.fault {
            armed.fault(fault);
            streaming.give_back(buffer);
        } else {
            streaming.replenish();
            armed.image(Image {
                exposed_at: arrival.exposed_at.unwrap_or(Duration::ZERO),
                received_at,
                width: streaming.applied.width,
                height: streaming.applied.height,
                pixels: buffers::share(buffer),
            });
        }
        if armed.has_ended() {
            self.armed = None;
        }
    }
}
