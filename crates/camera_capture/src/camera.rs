//! One camera: its link, its settings, its frames.

use std::sync::Arc;
use std::time::Duration;

use camera_aravis::{AravisCamera, CalibrationFile};
use devices::{AppliedSettings, Camera, CameraError, CameraLink, FrameEvent, Frames, TriggerMode};
use interfaces::sensor_msgs::msg::CameraInfo;
use interfaces::std_msgs::msg::Header;
use ros::Node;
use tokio::sync::watch;
use tokio::time::Instant;

use crate::camera_parameters::{CameraParameters, ImageValues};
use crate::convert;
use crate::error::{CaptureFailure, Error};
use crate::join::TakeEnd;
use crate::place::Place;
use crate::record::CameraRecord;

/// A camera of the cell.
pub(crate) struct CaptureCamera {
    pub(crate) name: String,
    pub(crate) parameters: CameraParameters,
    /// If it is known here.
    pub(crate) place: Option<Place>,
    pub(crate) record: CameraRecord,
    device: Arc<dyn Camera>,
    calibration: Option<CalibrationFile>,
    settled: Option<Settled>,
}

/// What the camera was set to last.
#[derive(Debug, Clone)]
pub(crate) struct Settled {
    wanted: (ImageValues, TriggerMode),
    /// The camera's own opening that it was set in.
    opening: u64,
    pub(crate) applied: AppliedSettings,
    /// Without stamp.
    pub(crate) info: Arc<CameraInfo>,
}

impl CaptureCamera {
    /// Begins to open the camera; returns at once.
    pub(crate) fn open(node: &Node, name: &str) -> Result<Self, Error> {
        let parameters = CameraParameters::declare(node, name)?;
        let failed = |problem| Error::Camera {
            camera: name.to_owned(),
            problem,
        };
        let config = parameters.config()?;
        let url = parameters.camera_info_url.get();
        let calibration = match url.as_str() {
            "" => None,
            url => Some(CalibrationFile::read(url).map_err(failed)?),
        };
        parameters
            .image
            .values()
            .settings(TriggerMode::Line)
            .map_err(|problem| Error::Settings {
                camera: name.to_owned(),
                problem,
            })?;
        let place = parameters.place()?;
        let guid = config.guid.clone();
        let device: Arc<dyn Camera> = Arc::new(AravisCamera::open(config));
        let record = CameraRecord::new(node, name, &guid, device.link());
        Ok(Self {
            name: name.to_owned(),
            parameters,
            place,
            record,
            device,
            calibration,
            settled: None,
        })
    }

    pub(crate) fn link(&self) -> watch::Receiver<CameraLink> {
        self.device.link()
    }

    /// Makes the camera take images as its parameters say, if it does not yet.
    ///
    /// Parameters that it refuses are put back to what it does, with a warning, and the camera goes on as before. Only
    /// one that was never set is an error.
    pub(crate) async fn settle(&mut self, trigger: TriggerMode) -> Result<&Settled, CaptureFailure> {
        let opening = self.record.opening();
        if let CameraLink::Lost { .. } = &*self.device.link().borrow() {
            self.settled = None;
        }
        let values = self.parameters.image.values();
        let is_settled = |settled: &Settled| settled.opening == opening && settled.wanted == (values, trigger);
        if !self.settled.as_ref().is_some_and(is_settled) {
            let refused = match self.apply(values, trigger).await {
                Ok((applied, info)) => {
                    self.record.refusal(None);
                    self.settled = Some(Settled {
                        wanted: (values, trigger),
                        opening,
                        applied,
                        info,
                    });
                    None
                }
                Err(failure) => Some(failure),
            };
            if let Some(failure) = refused {
                self.fall_back(failure, values, trigger).await?;
            }
        }
        self.settled.as_ref().ok_or_else(|| CaptureFailure::Settings {
            camera: self.name.clone(),
            problem: "it was never set".into(),
        })
    }

    async fn apply(
        &self,
        values: ImageValues,
        trigger: TriggerMode,
    ) -> Result<(AppliedSettings, Arc<CameraInfo>), CaptureFailure> {
        let problem = |problem: String| CaptureFailure::Settings {
            camera: self.name.clone(),
            problem,
        };
        let settings = values.settings(trigger).map_err(problem)?;
        let applied = self.device.configure(settings).await.map_err(|e| self.failure(e))?;
        let frame_id = self.parameters.frame_id.get();
        let info = convert::camera_info(self.calibration.as_ref(), &applied, frame_id).map_err(problem)?;
        Ok((applied, Arc::new(info)))
    }

    /// Goes back to the values that hold, when the refused ones are still those that are asked for.
    async fn fall_back(
        &mut self,
        failure: CaptureFailure,
        refused: ImageValues,
        trigger: TriggerMode,
    ) -> Result<(), CaptureFailure> {
        let old = match (&failure, &self.settled) {
            (CaptureFailure::Settings { .. }, Some(settled)) if settled.wanted.0 != refused => settled.wanted.0,
            _ => return Err(failure),
        };
        tracing::warn!(camera = self.name, %failure, "refused; the old values hold");
        self.record.refusal(Some(failure.to_string()));
        if self.parameters.image.values() == refused
            && let Err(error) = self.parameters.image.restore(&old)
        {
            tracing::warn!(camera = self.name, %error, "the parameters do not show what the camera does");
        }
        // A configuration that the camera took but the calibration did not fit has to be taken back in the camera too.
        let (applied, info) = self.apply(old, trigger).await?;
        self.settled = Some(Settled {
            wanted: (old, trigger),
            opening: self.record.opening(),
            applied,
            info,
        });
        Ok(())
    }

    /// Listens to the trigger for `count` frames.
    pub(crate) async fn arm(&self, count: usize) -> Result<Frames, CaptureFailure> {
        self.device.arm(count).await.map_err(|e| self.failure(e))
    }

    /// One software trigger.
    pub(crate) async fn trigger(&self) -> Result<(), CaptureFailure> {
        self.device.trigger().await.map_err(|e| self.failure(e))
    }

    /// What is known of a camera whose frames ended too early.
    pub(crate) fn loss(&self) -> TakeEnd {
        TakeEnd::Lost(match &*self.device.link().borrow() {
            CameraLink::Lost { reason } => reason.clone(),
            CameraLink::Open { .. } => "its driver ended the frames".into(),
        })
    }

    pub(crate) fn header(&self) -> Header {
        Header {
            frame_id: self.parameters.frame_id.get(),
            ..Header::default()
        }
    }

    fn failure(&self, problem: CameraError) -> CaptureFailure {
        let camera = self.name.clone();
        match problem {
            CameraError::Setting { .. } => CaptureFailure::Settings {
                problem: problem.to_string(),
                camera,
            },
            CameraError::Lost { .. } => CaptureFailure::Unavailable { camera, problem },
            problem => CaptureFailure::Void(crate::join::Void::Camera { camera, problem }),
        }
    }
}

/// Takes frames until there are `count`, one is damaged, or none came until `deadline`, `waited` after the last light.
pub(crate) async fn collect(
    camera: &CaptureCamera,
    mut frames: Frames,
    count: usize,
    deadline: Instant,
    waited: Duration,
) -> (Vec<FrameEvent>, TakeEnd) {
    let mut events = Vec::with_capacity(count);
    while events.len() < count {
        match tokio::time::timeout_at(deadline, frames.recv()).await {
            // What comes behind a fault cannot make the capture whole.
            Ok(Some(event @ FrameEvent::Fault(_))) => {
                events.push(event);
                return (events, TakeEnd::Whole);
            }
            Ok(Some(event)) => events.push(event),
            Ok(None) => return (events, camera.loss()),
            Err(_) => return (events, TakeEnd::Silence(waited)),
        }
    }
    (events, TakeEnd::Whole)
}
