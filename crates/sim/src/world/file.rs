//! The world file as it stands in YAML.

use std::path::Path;

use serde::Deserialize;

use super::arm::ArmFile;
use super::bin::Bin;
use super::cameras::CamerasFile;
use super::lights::LightsFile;
use super::objects::{ObjectFile, bodies, require_few};
use super::pose::PoseFile;
use super::room::RoomFile;
use super::scatter::Scatter;
use super::{World, cameras};
use crate::SimError;
use crate::arm::flange_of;
use crate::scene::Scene;

/// 3 % of what L1 gives a surface in the middle of the mat that faces it, from everywhere.
const AMBIENT: f64 = 8.76e-4;

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct WorldFile {
    seed: u64,
    objects: Vec<ObjectFile>,
    lights: LightsFile,
    cameras: CamerasFile,
    flange: Option<PoseFile>,
    arm: Option<ArmFile>,
    room: RoomFile,
    ambient: Option<f64>,
    bin: Bin,
    scatter: Option<Scatter>,
}

impl WorldFile {
    pub(super) fn resolve(&self, folder: &Path) -> Result<World, SimError> {
        let flange = |pose: PoseFile| pose.resolve([0.0; 3]).map_err(|error| error.within("flange"));
        let base_from_flange = self.flange.map_or_else(cameras::rig_flange, flange)?;
        let arm = self.arm.as_ref().map(|arm| arm.resolve(&base_from_flange));
        let arm = arm.transpose().map_err(|error| error.within("arm"))?;
        let held = arm.as_ref().map(|arm| flange_of(&arm.config())).transpose()?;
        Ok(World {
            seed: self.seed,
            lights: self.lights.resolve(folder).map_err(|error| error.within("lights"))?,
            cameras: self.cameras.resolve().map_err(|error| error.within("cameras"))?,
            base_from_flange: held.unwrap_or(base_from_flange),
            arm,
            bin: self.bin.checked().map_err(|error| error.within("bin"))?,
            scene: self.scene(folder)?,
        })
    }

    fn scene(&self, folder: &Path) -> Result<Scene, SimError> {
        let ambient_radiance = self.ambient.unwrap_or(AMBIENT);
        within("ambient", ambient_radiance, 0.0, 1000.0)?;
        let mut bodies = bodies(&self.objects, folder)?;
        if let Some(scatter) = &self.scatter {
            let more = scatter.bodies(&bodies).map_err(|error| error.within("scatter"))?;
            bodies.extend(more);
            require_few(bodies.len())?;
        }
        Ok(Scene {
            bodies,
            room: self.room.resolve().map_err(|error| error.within("room"))?,
            panels: self.lights.panels().map_err(|error| error.within("lights.panels"))?,
            ambient_radiance,
        })
    }
}

/// Refuses what lies outside, NaN too.
pub(super) fn within(place: &str, value: f64, least: f64, most: f64) -> Result<(), SimError> {
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(SimError::value(place, value.to_string(), format!("{least} to {most}")))
}
