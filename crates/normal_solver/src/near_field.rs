//! Solving with calibrated panels, which needs to know where the camera is.

use std::path::Path;
use std::sync::Arc;

use calibration_files::LightsFile;
use geometry::{PinholeCamera, RigidTransform};
use imaging::Image;
use interfaces::sensor_msgs::msg::CameraInfo;
use photometric::{LightRig, PixelRays, Quality, SensorNoise, SolveOptions, View, ViewSolution};
use photometric::{dark_channels, solve_view};

use crate::assembler::Capture;
use crate::convert;
use crate::error::Error;

/// Calibrated panels.
pub(crate) struct NearField {
    lights: LightsFile,
    rig: LightRig,
}

/// Where a capture was seen from.
pub(crate) struct Viewpoint {
    pub(crate) camera_name: String,
    pub(crate) info: Arc<CameraInfo>,
    pub(crate) base_from_camera: RigidTransform,
    /// Of an earlier capture, to be used again while the camera is the same.
    pub(crate) rays: Option<(PinholeCamera, Arc<PixelRays>)>,
}

/// What came of a capture.
pub(crate) struct Solved {
    pub(crate) solution: ViewSolution,
    /// From where.
    pub(crate) view: View,
    pub(crate) object_pixels: usize,
    pub(crate) quality: Quality,
    /// Panels that gave no light.
    pub(crate) dark_channels: Vec<u8>,
    pub(crate) rays: (PinholeCamera, Arc<PixelRays>),
}

impl NearField {
    /// None for an empty path.
    pub(crate) fn read(path: &str) -> Result<Option<Self>, Error> {
        if path.is_empty() {
            return Ok(None);
        }
        let read = |path: &str| {
            let lights = LightsFile::read(Path::new(path))?;
            let rig = lights.rig()?;
            Ok(Self { lights, rig })
        };
        let problem = |problem| Error::LightsFile {
            path: path.to_owned(),
            problem: Box::new(problem),
        };
        read(path).map(Some).map_err(problem)
    }

    pub(crate) fn solve(&self, capture: &Capture, viewpoint: Viewpoint, saturation: u16) -> Result<Solved, Error> {
        let stack = convert::stack_of_channels(capture, &self.rig.channels(), saturation)?;
        let camera = camera(&viewpoint.info)?;
        stack.dark().require_size_of(
            &Image::filled(camera.width(), camera.height(), 0_u8),
            "the images beside their camera_info",
        )?;
        let fits = self
            .lights
            .require_camera(&viewpoint.camera_name, camera.width(), camera.height());
        fits.map_err(|problem| Error::LightsFile {
            path: "lights.file".to_owned(),
            problem: Box::new(problem),
        })?;
        let known = viewpoint.rays.filter(|(of, _)| *of == camera).map(|(_, rays)| rays);
        let rays = known.unwrap_or_else(|| Arc::new(PixelRays::new(&camera)));
        let view = View {
            camera,
            base_from_camera: viewpoint.base_from_camera,
        };
        let capture = photometric::Capture {
            stack: &stack,
            view: &view,
            rays: &rays,
            rig: &self.rig,
            noise: SensorNoise::RIG,
        };
        let solution = solve_view(&capture, &SolveOptions::default())?;
        Ok(Solved {
            object_pixels: solution.normals.mask.count(),
            quality: solution.normals.quality(),
            dark_channels: dark_channels(&stack),
            solution,
            view,
            rays: (camera, rays),
        })
    }
}

fn camera(info: &CameraInfo) -> Result<PinholeCamera, Error> {
    let (width, height) = (info.width as usize, info.height as usize);
    Ok(PinholeCamera::from_camera_info(
        width,
        height,
        &info.k,
        &info.distortion_model,
        &info.d,
    )?)
}
