//! One camera's share of the node.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::{PinholeCamera, RigidTransform};
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::std_msgs::msg::Header;
use photometric::{NormalMapResult, PixelRays};
use ros::{Clock, Node, Qos, Subscription, tf};

use crate::assembler::{Assembler, Capture};
use crate::captures::{Captures, Done};
use crate::error::Error;
use crate::far_field;
use crate::near_field::{NearField, Solved, Viewpoint};
use crate::parameters::Parameters;
use crate::results::Results;

/// How long a transform may come after the images that need it.
const TRANSFORM_PATIENCE: Duration = Duration::from_secs(1);

pub(crate) struct CameraSolver {
    camera: String,
    parameters: Arc<Parameters>,
    /// None: lights are far away.
    panels: Option<Arc<NearField>>,
    transforms: Arc<tf::Listener>,
    infos: Subscription<CameraInfo>,
    info: Option<Arc<CameraInfo>>,
    /// Of the last camera that was solved.
    rays: Option<(PinholeCamera, Arc<PixelRays>)>,
    images: Subscription<Image>,
    exposures: Subscription<Exposure>,
    results: Results,
    assembler: Assembler,
    captures: Captures,
    clock: Clock,
}

impl CameraSolver {
    pub(crate) fn new(
        node: &Node,
        camera: &str,
        parameters: Arc<Parameters>,
        panels: Option<Arc<NearField>>,
        transforms: Arc<tf::Listener>,
        captures: Captures,
    ) -> Result<Self, Error> {
        Ok(Self {
            camera: camera.to_owned(),
            parameters,
            panels,
            transforms,
            infos: node.subscription(&format!("{camera}/camera_info"), Qos::LATCHED)?,
            info: None,
            rays: None,
            images: node.subscription(&format!("{camera}/image_raw"), Qos::IMAGE)?,
            exposures: node.subscription(&format!("{camera}/exposure"), Qos::STREAM)?,
            results: Results::new(node, camera)?,
            assembler: Assembler::default(),
            captures,
            clock: node.clock().clone(),
        })
    }

    /// Solves captures until the node is shut down.
    pub(crate) async fn run(mut self) {
        loop {
            let patience = Duration::from_secs_f64(self.parameters.capture_timeout.get());
            tokio::select! {
                image = self.images.next() => match image {
                    Some(image) => self.take_image(image.message),
                    None => return,
                },
                exposure = self.exposures.next() => match exposure {
                    Some(exposure) => self.take_exposure(exposure.message),
                    None => return,
                },
                info = self.infos.next() => match info {
                    Some(info) => self.info = Some(info.message),
                    None => return,
                },
                () = tokio::time::sleep(patience) => self.assembler.give_up_all("nothing more came"),
            }
            let whole = self.assembler.take_whole();
            self.tell_voids();
            if let Some(capture) = whole {
                self.settle(capture).await;
            }
        }
    }

    fn take_exposure(&mut self, exposure: Arc<Exposure>) {
        let id = exposure.capture_id.clone();
        let begins = self.assembler.add_exposure(exposure);
        // What it had begun before under the same id is void, and void before it begins.
        self.tell_voids();
        if begins {
            self.captures.begin(&id, &self.camera);
        }
    }

    fn tell_voids(&mut self) {
        for void in self.assembler.take_voids() {
            tracing::warn!(camera = self.camera, "{void}");
            let reason = format!("void: {}", void.reason);
            self.captures.failed(&void.capture_id, &self.camera, reason);
        }
    }

    /// Solves a capture, publishes what came of it, and tells those who wait.
    async fn settle(&mut self, capture: Capture) {
        let id = capture.id.clone();
        self.captures.solving(&id, &self.camera);
        let (started, started_at) = (Instant::now(), self.clock.now());
        match self.solve(capture).await {
            Ok((valid_fraction, note)) => {
                let done = Done {
                    valid_fraction,
                    started_at,
                    took: started.elapsed(),
                    note,
                };
                self.captures.solved(&id, &self.camera, done);
            }
            Err(error) => {
                tracing::error!(camera = self.camera, capture_id = id, %error, "not solved");
                self.captures.failed(&id, &self.camera, error.to_string());
            }
        }
    }

    fn take_image(&mut self, image: Arc<Image>) {
        let given_up = self.assembler.add_image(image);
        if given_up > 0 {
            tracing::warn!(
                camera = self.camera,
                given_up,
                "images that no exposure names were given up"
            );
        }
    }

    /// Gives the share of pixels that have a normal, and what was missing.
    async fn solve(&mut self, capture: Capture) -> Result<(f32, String), Error> {
        let Some(header) = capture.frames.first().map(|frame| frame.image.header.clone()) else {
            return Ok((0.0, String::new()));
        };
        if let Some(panels) = self.panels.clone() {
            let solved = self.solve_near(capture, &header, panels).await?;
            let valid_fraction = share(solved.quality.normals, &solved.solution.normals.normals);
            let note = self.without_dark(&solved.dark_channels);
            self.results.publish(header, solved)?;
            return Ok((valid_fraction, note));
        }
        let NormalMapResult { normals, counts, .. } = self.solve_far(capture, header.stamp).await?;
        let valid_fraction = share(counts.solved, &normals);
        self.results.publish_normals(header, normals)?;
        Ok((valid_fraction, String::new()))
    }

    /// Panels that are dark take no part, which whoever picks should know.
    fn without_dark(&self, channels: &[u8]) -> String {
        if channels.is_empty() {
            return String::new();
        }
        let names: Vec<String> = channels.iter().map(|channel| format!("L{channel}")).collect();
        format!(
            "{}: solved without {}, which gives no light",
            self.camera,
            names.join(", ")
        )
    }

    /// With lights far away.
    async fn solve_far(&self, capture: Capture, stamp: Time) -> Result<NormalMapResult, Error> {
        let started = Instant::now();
        let (id, frames) = (capture.id.clone(), capture.frames.len());
        let base_from_lights = self.base_from_lights(stamp).await?;
        let parameters = Arc::clone(&self.parameters);
        let solved =
            tokio::task::spawn_blocking(move || far_field::solve(&capture, &parameters, &base_from_lights)).await;
        let result = solved.expect("the solver does not panic")?;
        far_field::report(&self.camera, &id, frames, result.counts, started.elapsed());
        Ok(result)
    }

    /// With calibrated panels.
    async fn solve_near(&mut self, capture: Capture, header: &Header, panels: Arc<NearField>) -> Result<Solved, Error> {
        let started = Instant::now();
        let capture_id = capture.id.clone();
        let viewpoint = self.viewpoint(header).await?;
        let saturation = self.parameters.saturation.get() as u16;
        let solved = tokio::task::spawn_blocking(move || panels.solve(&capture, viewpoint, saturation)).await;
        let solved = solved.expect("the solver does not panic")?;
        let (object_pixels, quality) = (solved.object_pixels, solved.quality);
        let took_ms = started.elapsed().as_millis();
        tracing::info!(
            camera = self.camera,
            capture_id,
            object_pixels,
            few_lights = quality.few_lights,
            confidence = quality.confidence,
            took_ms,
            "solved"
        );
        if let Some(doubt) = quality.doubt() {
            tracing::warn!(camera = self.camera, capture_id, "doubtful: {doubt}");
        }
        self.rays = Some(solved.rays.clone());
        Ok(solved)
    }

    /// Lens and place of the camera at the time of a capture.
    async fn viewpoint(&mut self, header: &Header) -> Result<Viewpoint, Error> {
        let (base, frame) = (self.parameters.base_frame_id.get(), header.frame_id.clone());
        if self.info.is_none() {
            // It may lie behind the images that came with it.
            let waited = tokio::time::timeout(TRANSFORM_PATIENCE, self.infos.next()).await;
            self.info = waited.ok().flatten().map(|info| info.message);
        }
        let info = self.info.clone().ok_or_else(|| Error::NoCameraInfo {
            camera: self.camera.clone(),
        })?;
        let placed = self
            .transforms
            .wait_for(&base, &frame, header.stamp.to_nanos(), TRANSFORM_PATIENCE)
            .await;
        let base_from_camera = placed.map_err(|problem| Error::CameraFrame {
            frame,
            base,
            problem: Box::new(problem),
        })?;
        Ok(Viewpoint {
            camera_name: self.camera.clone(),
            info,
            base_from_camera,
            rays: self.rays.clone(),
        })
    }

    /// Where the frame of the light directions stands, at the time of the capture.
    async fn base_from_lights(&self, stamp: Time) -> Result<RigidTransform, Error> {
        let (base, lights) = (
            self.parameters.base_frame_id.get(),
            self.parameters.light_frame_id.get(),
        );
        if base == lights {
            return Ok(RigidTransform::identity());
        }
        let found = self
            .transforms
            .wait_for(&base, &lights, stamp.to_nanos(), TRANSFORM_PATIENCE)
            .await;
        found.map_err(|problem| Error::LightFrame {
            frame: lights,
            base,
            problem: Box::new(problem),
        })
    }
}

/// Of an image's pixels, 0 to 1.
fn share(pixels: usize, of: &imaging::Image<[f32; 3]>) -> f32 {
    (pixels as f64 / of.pixels().len().max(1) as f64) as f32
}
