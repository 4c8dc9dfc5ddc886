//! A camera's sensor: gives the image of an exposure.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use bytes::Bytes;
use gige_vision::{FrameRequest, FrameSource};

use super::darkroom::Darkroom;
use super::gallery::{Exhibit, Gallery};
use super::settings::Settings;
use super::wires::Wires;
use crate::sensor::LightState;

pub(super) struct Eye {
    pub(super) camera: usize,
    pub(super) gallery: Arc<Gallery>,
    pub(super) darkroom: Arc<Darkroom>,
    pub(super) wires: Arc<Wires>,
    /// The instant of device time zero.
    pub(super) started: Arc<OnceLock<Instant>>,
    /// How long a frame waits for its view to be rendered.
    pub(super) patience: Duration,
}

impl FrameSource for Eye {
    fn frame(&mut self, request: &FrameRequest) -> Bytes {
        self.image(request).unwrap_or_else(|reason| {
            tracing::warn!("camera {} sends no frame: {reason}", self.camera + 1);
            // Of no image's size: the device refuses it and goes on.
            Bytes::new()
        })
    }
}

impl Eye {
    fn image(&self, request: &FrameRequest) -> Result<Bytes, String> {
        let settings = Settings::of_request(request);
        let from = *self.started.wait() + request.triggered_at;
        let shares = self
            .wires
            .shares(from, request.exposure)
            .ok_or("the light controller has died")?;
        let exhibit = self
            .gallery
            .wait_for(self.camera, settings.binning, self.patience, true)
            .map_err(|error| error.to_string())?;
        let lights = lights(&exhibit, shares);
        let image = self.darkroom.image(&exhibit, lights, &settings);
        image.map_err(|error| error.to_string())
    }
}

/// Which panels shone, by what hangs on the outputs.
fn lights(exhibit: &Exhibit, shares: [f64; 7]) -> LightState {
    let mut panels = [0.0; 7];
    for (panel, share) in exhibit.world.lights.wiring.iter().zip(shares) {
        if let Some(panel) = panel {
            panels[usize::from(*panel) - 1] = share;
        }
    }
    LightState::from_shares(panels)
}
