//! The `cameras:` of a world file, and where the rig has them.

use std::f64::consts::FRAC_PI_2;
use std::net::Ipv4Addr;

use geometry::nalgebra::{UnitQuaternion, Vector3};
use geometry::{PinholeCamera, PlumbBob, RigidTransform};
use gige_vision::{Device, DeviceConfig};
use serde::Deserialize;

use super::file::within;
use super::pose::PoseFile;
use super::{Camera, Mount};
use crate::SimError;
use crate::scene::View;
use crate::sensor::Sensor;

/// Binnings that the cameras have.
const BINNINGS: [u32; 3] = [1, 2, 4];

/// What the rig has where the file says nothing.
struct RigCamera {
    name: &'static str,
    last_octet: u8,
    trigger_line: u8,
    view: View,
    mount: Mount,
}

fn rig_c1() -> Result<RigCamera, SimError> {
    Ok(RigCamera {
        name: "c1",
        last_octet: 2,
        trigger_line: 1,
        view: View::rig_c1()?,
        mount: Mount::Flange {
            flange_from_camera: rig_flange_from_c1(),
        },
    })
}

fn rig_c2() -> Result<RigCamera, SimError> {
    let view = View::rig_c2()?;
    Ok(RigCamera {
        name: "c2",
        last_octet: 3,
        trigger_line: 2,
        view,
        mount: Mount::Table {
            base_from_camera: view.base_from_camera,
        },
    })
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct CamerasFile {
    c1: CameraFile,
    c2: CameraFile,
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct CameraFile {
    serial: Option<String>,
    address: Option<Ipv4Addr>,
    width: Option<u32>,
    height: Option<u32>,
    focal: Option<[f64; 2]>,
    principal: Option<[f64; 2]>,
    distortion: [f64; 5],
    base_from_camera: Option<PoseFile>,
    flange_from_camera: Option<PoseFile>,
    trigger_line: Option<u8>,
    read_noise: Option<f64>,
    full_well: Option<f64>,
    dn_per_radiance_second: Option<f64>,
    binning: Option<u32>,
}

impl CamerasFile {
    pub(super) fn resolve(&self) -> Result<Vec<Camera>, SimError> {
        let c1 = self.c1.resolve(&rig_c1()?).map_err(|error| error.within("c1"))?;
        let c2 = self.c2.resolve(&rig_c2()?).map_err(|error| error.within("c2"))?;
        if c1.address == c2.address {
            return Err(SimError::value(
                "c2.address",
                c2.address.to_string(),
                "another than that of c1",
            ));
        }
        if c1.serial == c2.serial {
            return Err(SimError::value("c2.serial", c2.serial, "another than that of c1"));
        }
        Ok(vec![c1, c2])
    }
}

impl CameraFile {
    fn resolve(&self, rig: &RigCamera) -> Result<Camera, SimError> {
        let trigger_line = self.trigger_line.unwrap_or(rig.trigger_line);
        within("trigger_line", f64::from(trigger_line), 1.0, 2.0)?;
        let binning = self.binning.unwrap_or(1);
        if !BINNINGS.contains(&binning) {
            return Err(SimError::value("binning", binning.to_string(), "1, 2 or 4"));
        }
        let serial = || format!("RAKELIGHT-{}", rig.name.to_uppercase());
        let camera = Camera {
            name: rig.name.to_owned(),
            serial: self.serial.clone().unwrap_or_else(serial),
            address: self.address.unwrap_or(Ipv4Addr::new(127, 0, 0, rig.last_octet)),
            lens: self.lens(rig)?,
            mount: self.mount(rig)?,
            trigger_line,
            sensor: self.sensor()?,
            binning,
        };
        // The device knows what names and sensors it can have.
        Device::new(&camera.device_config()).map_err(|reason| SimError::Camera {
            name: rig.name.to_owned(),
            reason,
        })?;
        Ok(camera)
    }

    /// A sensor of another size has the rig's field of view, unless the file says otherwise.
    fn lens(&self, rig: &RigCamera) -> Result<PinholeCamera, SimError> {
        let lens = rig.view.camera;
        let [width, height] = [lens.width(), lens.height()];
        let size = [self.width.unwrap_or(width as u32), self.height.unwrap_or(height as u32)];
        let scale = [f64::from(size[0]) / width as f64, f64::from(size[1]) / height as f64];
        let scaled = |axis: usize, value: f64| value * scale[axis];
        let principal = lens.principal().map(|coordinate| coordinate + 0.5);
        let camera = PinholeCamera::new(
            size[0] as usize,
            size[1] as usize,
            self.focal
                .unwrap_or([0, 1].map(|axis| scaled(axis, lens.focal()[axis]))),
            self.principal
                .unwrap_or([0, 1].map(|axis| scaled(axis, principal[axis]) - 0.5)),
        )?;
        let [k1, k2, p1, p2, k3] = self.distortion;
        for (index, coefficient) in self.distortion.into_iter().enumerate() {
            within(&format!("distortion[{index}]"), coefficient, -1e3, 1e3)?;
        }
        Ok(camera.with_distortion(PlumbBob { k1, k2, p1, p2, k3 }))
    }

    fn mount(&self, rig: &RigCamera) -> Result<Mount, SimError> {
        match (self.base_from_camera, self.flange_from_camera) {
            (Some(_), Some(_)) => Err(SimError::value(
                "flange_from_camera",
                "given beside base_from_camera",
                "one of both",
            )),
            (Some(pose), None) => Ok(Mount::Table {
                base_from_camera: pose
                    .resolve([0.0; 3])
                    .map_err(|error| error.within("base_from_camera"))?,
            }),
            (None, Some(pose)) => Ok(Mount::Flange {
                flange_from_camera: pose
                    .resolve([0.0; 3])
                    .map_err(|error| error.within("flange_from_camera"))?,
            }),
            (None, None) => Ok(rig.mount),
        }
    }

    fn sensor(&self) -> Result<Sensor, SimError> {
        let rig = Sensor::default();
        let sensor = Sensor {
            read_noise: self.read_noise.unwrap_or(rig.read_noise),
            full_well: self.full_well.unwrap_or(rig.full_well),
            dn_per_radiance_second: self.dn_per_radiance_second.unwrap_or(rig.dn_per_radiance_second),
        };
        within("read_noise", sensor.read_noise, 0.0, 1e4)?;
        within("full_well", sensor.full_well, 100.0, 1e7)?;
        within("dn_per_radiance_second", sensor.dn_per_radiance_second, 0.0, 1e15)?;
        Ok(sensor)
    }
}

impl Camera {
    /// As it is served.
    pub(crate) fn device_config(&self) -> DeviceConfig {
        DeviceConfig {
            user_name: self.name.clone(),
            sensor_width: self.lens.width() as u32,
            sensor_height: self.lens.height() as u32,
            ..DeviceConfig::new(&self.serial, self.address)
        }
    }
}

/// Beside the cup, looking along it; its columns run along the flange's -y.
fn rig_flange_from_c1() -> RigidTransform {
    let quarter_turn_back = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -FRAC_PI_2);
    RigidTransform::from_parts(Vector3::new(0.07, 0.0, 0.02), quarter_turn_back)
}

/// Where the flange has to be for C1 to look at the mat.
pub(super) fn rig_flange() -> Result<RigidTransform, SimError> {
    Ok(View::rig_c1()?.base_from_camera * rig_flange_from_c1().inverse())
}
