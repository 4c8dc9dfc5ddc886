//! The `room:` of a world file.

use geometry::nalgebra::{Point3, Unit, Vector3};
use serde::Deserialize;

use super::file::within;
use super::pose::PoseFile;
use crate::SimError;
use crate::scene::{Room, Wall};

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RoomFile {
    mat_centre: Option<[f64; 2]>,
    mat_size: Option<[f64; 2]>,
    mat_albedo: Option<f64>,
    table_centre: Option<[f64; 2]>,
    table_size: Option<[f64; 2]>,
    table_albedo: Option<f64>,
    walls: Option<Vec<WallFile>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WallFile {
    /// Of the frame in the middle of the wall: z out of the reflecting side, x along the first side.
    pose: PoseFile,
    size: [f64; 2],
    albedo: f64,
}

/// Metres: further away nothing matters.
const FAR: f64 = 100.0;

impl RoomFile {
    pub(super) fn resolve(&self) -> Result<Room, SimError> {
        let rig = Room::rig();
        let room = Room {
            mat_centre: pair("mat_centre", self.mat_centre, rig.mat_centre, -FAR)?,
            mat_size: pair("mat_size", self.mat_size, rig.mat_size, 0.0)?,
            mat_albedo: albedo("mat_albedo", self.mat_albedo.unwrap_or(rig.mat_albedo))?,
            table_centre: pair("table_centre", self.table_centre, rig.table_centre, -FAR)?,
            table_size: pair("table_size", self.table_size, rig.table_size, 0.0)?,
            table_albedo: albedo("table_albedo", self.table_albedo.unwrap_or(rig.table_albedo))?,
            walls: rig.walls,
        };
        let Some(walls) = &self.walls else {
            return Ok(room);
        };
        let walls = walls
            .iter()
            .enumerate()
            .map(|(index, wall)| wall.resolve().map_err(|error| error.within(&format!("walls[{index}]"))));
        Ok(Room {
            walls: walls.collect::<Result<_, _>>()?,
            ..room
        })
    }
}

fn pair(place: &str, value: Option<[f64; 2]>, rig: [f64; 2], least: f64) -> Result<[f64; 2], SimError> {
    let value = value.unwrap_or(rig);
    for side in value {
        within(place, side, least, FAR)?;
    }
    Ok(value)
}

fn albedo(place: &str, value: f64) -> Result<f64, SimError> {
    within(place, value, 0.0, 1.0)?;
    Ok(value)
}

impl WallFile {
    fn resolve(&self) -> Result<Wall, SimError> {
        let base_from_wall = self.pose.resolve([0.0; 3]).map_err(|error| error.within("pose"))?;
        let axis = |axis: Vector3<f64>| Unit::new_normalize(base_from_wall.transform_direction(&axis));
        Ok(Wall {
            centre: Point3::from(base_from_wall.translation()),
            normal: axis(Vector3::z()),
            right: axis(Vector3::x()),
            size: pair("size", Some(self.size), [0.0; 2], 1e-3)?,
            albedo: albedo("albedo", self.albedo)?,
        })
    }
}
