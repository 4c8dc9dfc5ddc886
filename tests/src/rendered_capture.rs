//! The capture that solving is timed with: the stepped octagon under the rig.

use geometry::nalgebra::{UnitQuaternion, Vector3};
use geometry::{PinholeCamera, RigidTransform};
use imaging::{ExposureStack, Image};
use photometric::{Capture, LightRig, PixelRays, SensorNoise};
use sim::objects::Shape;
use sim::render::{RenderOptions, RenderedView, render};
use sim::scene::{AMBIENT_RADIANCE, Albedo, Body, Panel, Room, Scene, View};
use sim::sensor::{Exposure, LightState, Region, Sensor};

const SATURATION: u16 = 65_520;

/// A rendered capture of one camera, and what belongs to it.
#[derive(Debug)]
pub struct RenderedCapture {
    stack: ExposureStack,
    view: photometric::View,
    rays: PixelRays,
}

impl RenderedCapture {
    /// A camera of the rig, with `size` pixels along each side.
    ///
    /// # Errors
    ///
    /// When there is no image of that size.
    pub fn render(view: View, size: usize) -> anyhow::Result<Self> {
        let view = resized(view, size)?;
        let seen = render(&scene()?, &view, &RenderOptions { seed: 3 })?;
        let images = (0..=7_u8).map(|light| Ok((light, expose(&seen, light, size)?)));
        let images = images.collect::<anyhow::Result<Vec<_>>>()?;
        Ok(Self {
            stack: ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, SATURATION)?,
            rays: PixelRays::new(&view.camera),
            view: photometric::View {
                camera: view.camera,
                base_from_camera: view.base_from_camera,
            },
        })
    }

    /// The camera.
    pub fn view(&self) -> &photometric::View {
        &self.view
    }

    /// As it is solved.
    pub fn capture<'a>(&'a self, rig: &'a LightRig) -> Capture<'a> {
        Capture {
            stack: &self.stack,
            view: &self.view,
            rays: &self.rays,
            rig,
            noise: SensorNoise::RIG,
        }
    }
}

fn scene() -> anyhow::Result<Scene> {
    let shape: Shape = serde_json::from_value("octagon2".into())?;
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.2);
    let base_from_body = RigidTransform::from_parts(Vector3::new(0.433, -0.004, 0.0), turn);
    let mesh = shape.mesh(std::path::Path::new("."))?.transformed(&base_from_body);
    Ok(Scene {
        bodies: vec![Body {
            name: "octagon2".to_owned(),
            mesh,
            base_from_body,
            albedo: Albedo::Uniform(0.85),
        }],
        room: Room::rig(),
        panels: Panel::rig(),
        ambient_radiance: AMBIENT_RADIANCE,
    })
}

fn resized(view: View, size: usize) -> anyhow::Result<View> {
    let scale = size as f64 / view.camera.width() as f64;
    let centre = |c: f64| (c + 0.5) * scale - 0.5;
    let camera = PinholeCamera::new(
        size,
        size,
        view.camera.focal().map(|f| f * scale),
        view.camera.principal().map(centre),
    )?;
    Ok(View { camera, ..view })
}

fn expose(seen: &RenderedView, light: u8, size: usize) -> anyhow::Result<Image<u16>> {
    let exposure = Exposure {
        seconds: 0.0025,
        gain_decibels: 0.0,
        black_level: 0,
        averaged: 1,
        region: Region {
            x: 0,
            y: 0,
            width: size,
            height: size,
        },
    };
    Ok(Sensor::default().expose(seen, LightState::single(light), &exposure, u64::from(light))?)
}
