//! Normals, edges and grasps as pictures: what was recorded to the left, what came of it today to the right.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use geometry::PinholeCamera;
use geometry::nalgebra::{Point3, Vector3};
use grasp::{Cup, Overlay};
use imaging::{Image, contact_sheet, encode_png, gray_to_rgb, normal_picture};
use interfaces::rakelight_msgs::msg::GraspArray;
use interfaces::sensor_msgs::msg::Image as ImageMessage;
use recording::Bag;

use super::bench::Results;
use super::settings::Settings;
use crate::bag::captures::Capture;
use crate::captured::Places;
use crate::image_message::{normal_map, pixels};

/// White pixels between two pictures.
const GAP: usize = 6;

/// Where they go, and where the cameras were.
pub(super) struct Pictures {
    folder: PathBuf,
    places: Places,
    cup_radius: f64,
}

impl Pictures {
    pub(super) fn new(folder: &Path, bag: &Bag, settings: &Settings) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(Self {
            folder: folder.to_owned(),
            places: Places::read(bag)?,
            cup_radius: settings.cup_diameter().unwrap_or(Cup::default().diameter) / 2.0,
        })
    }

    /// `FOLDER/ID_c1_normals.png` and so on.
    pub(super) fn write(&self, capture: &Capture, results: &Results) -> anyhow::Result<()> {
        for (camera, normals) in &results.normals {
            let name = camera.rsplit('/').next().unwrap_or(camera);
            let put = |what: &str, pictures: Vec<Image<[u8; 3]>>| {
                let path = self.folder.join(format!("{}_{name}_{what}.png", capture.id));
                write(&path, &pictures)
            };
            let recorded = results.recorded.normals.get(camera);
            let both = recorded.into_iter().chain([normals.as_ref()]);
            let colours = |map: &ImageMessage| Ok(normal_picture(&normal_map(map)?));
            put("normals", both.map(colours).collect::<anyhow::Result<_>>()?)?;
            let edges = results.edges.get(camera).map(AsRef::as_ref);
            let both = results.recorded.edges.get(camera).into_iter().chain(edges);
            let gray = |map: &ImageMessage| Ok(gray_to_rgb(&pixels(map)?));
            put("edges", both.map(gray).collect::<anyhow::Result<_>>()?)?;
            let plans = [&results.recorded.grasps, &results.grasps];
            let drawn = |array: &GraspArray| self.grasps(camera, normals, array);
            put(
                "grasps",
                plans.into_iter().flatten().map(drawn).collect::<anyhow::Result<_>>()?,
            )?;
        }
        Ok(())
    }

    /// Into a relief of the new normals, so that what differs is the grasps alone.
    fn grasps(&self, camera: &str, map: &ImageMessage, array: &GraspArray) -> anyhow::Result<Image<[u8; 3]>> {
        let lens: PinholeCamera = self.places.camera(camera)?;
        let place = self
            .places
            .base_from(&map.header.frame_id, map.header.stamp.to_nanos())?;
        let mut overlay = Overlay::on_normals(&normal_map(map)?, lens, &place);
        for (rank, grasp) in array.grasps.iter().enumerate().rev() {
            let (contact, normal) = (&grasp.contact, &grasp.normal);
            overlay.grasp(
                &Point3::new(contact.x, contact.y, contact.z),
                &Vector3::new(normal.x, normal.y, normal.z),
                self.cup_radius,
                rank,
            );
        }
        Ok(overlay.picture().clone())
    }
}

/// Side by side; nothing when there is none.
fn write(path: &Path, pictures: &[Image<[u8; 3]>]) -> anyhow::Result<()> {
    let Some(sheet) = contact_sheet(pictures, 2, GAP) else {
        return Ok(());
    };
    fs::write(path, encode_png(&sheet)?).with_context(|| format!("cannot write {}", path.display()))
}
