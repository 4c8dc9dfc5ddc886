//! One camera's share of the node.

use std::sync::Arc;
use std::time::{Duration, Instant};

use geometry::{PinholeCamera, RigidTransform};
use interfaces::builtin_interfaces::msg::Time;
use interfaces::rakelight_msgs::msg::Exposure;
use interfaces::sensor_msgs::msg::{CameraInfo, Image};
use interfaces::std_msgs::msg::Header;
use photometric::{LeastSquaresOptions, NormalMapResult, PixelCounts, PixelRays, least_squares_normals};
use ros::{Node, Qos, Subscription, tf};

use crate::assembler::{Assembler, Capture};
use crate::convert;
use crate::error::Error;
use crate::lights::lights_in_base;
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
}

impl CameraSolver {
    pub(crate) fn new(
        node: &Node,
        camera: &str,
        parameters: Arc<Parameters>,
        panels: Option<Arc<NearField>>,
        transforms: Arc<tf::Listener>,
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
                    Some(exposure) => self.assembler.add_exposure(exposure.message),
                    None => return,
                },
                info = self.infos.next() => match info {
                    Some(info) => self.info = Some(info.message),
                    None => return,
                },
                () = tokio::time::sleep(patience) => self.assembler.give_up_all("nothing more came"),
            }
            let whole = self.assembler.take_whole();
            for void in self.assembler.take_voids() {
                tracing::warn!(camera = self.camera, "{void}");
            }
            if let Some(capture) = whole {
                let id = capture.id.clone();
                if let Err(error) = self.solve(capture).await {
                    tracing::error!(camera = self.camera, capture_id = id, %error, "not solved");
                }
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

    async fn solve(&mut self, capture: Capture) -> Result<(), Error> {
        let Some(header) = capture.frames.first().map(|frame| frame.image.header.clone()) else {
            return Ok(());
        };
        if let Some(panels) = self.panels.clone() {
            let solved = self.solve_near(capture, &header, panels).await?;
            return self.results.publish(header, solved);
        }
        let normals = self.solve_far(capture, header.stamp).await?;
        self.results.publish_normals(header, normals)
    }

    /// With lights far away.
    async fn solve_far(&self, capture: Capture, stamp: Time) -> Result<imaging::Image<[f32; 3]>, Error> {
        let started = Instant::now();
        let (id, frames) = (capture.id.clone(), capture.frames.len());
        let base_from_lights = self.base_from_lights(stamp).await?;
        let parameters = Arc::clone(&self.parameters);
        let solved = tokio::task::spawn_blocking(move || solve(&capture, &parameters, &base_from_lights)).await;
        let result = solved.expect("the solver does not panic")?;
        report(&self.camera, &id, frames, result.counts, started.elapsed());
        Ok(result.normals)
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

fn solve(
    capture: &Capture,
    parameters: &Parameters,
    base_from_lights: &RigidTransform,
) -> Result<NormalMapResult, Error> {
    let lights = lights_in_base(
        &parameters.light_directions.get(),
        &parameters.light_intensities.get(),
        base_from_lights,
    )?;
    // The parameter's range is that of a u16.
    let stack = convert::exposure_stack(capture, &lights, parameters.saturation.get() as u16)?;
    let minimum_signal = parameters.minimum_signal.get() as f32;
    let options = LeastSquaresOptions {
        minimum_signal,
        ..LeastSquaresOptions::default()
    };
    Ok(least_squares_normals(&stack, &lights, &options)?)
}

fn report(camera: &str, capture_id: &str, images: usize, counts: PixelCounts, took: Duration) {
    let PixelCounts {
        solved,
        too_dark,
        too_few_lights,
        saturated,
    } = counts;
    let took_ms = took.as_millis();
    tracing::info!(
        camera,
        capture_id,
        images,
        solved,
        too_dark,
        too_few_lights,
        saturated,
        took_ms,
        "solved"
    );
}
