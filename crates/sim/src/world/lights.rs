//! The `lights:` of a world file.

use std::path::{Path, PathBuf};

use geometry::nalgebra::{Point3, Unit, Vector3};
use serde::Deserialize;

use super::Lights;
use super::file::within;
use super::pose::PoseFile;
use crate::SimError;
use crate::scene::Panel;

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct LightsFile {
    port: Option<PathBuf>,
    panels: PanelsFile,
    dead: Vec<u8>,
    swapped: Vec<[u8; 2]>,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "UPPERCASE")]
struct PanelsFile {
    l1: PanelFile,
    l2: PanelFile,
    l3: PanelFile,
    l4: PanelFile,
    l5: PanelFile,
    l6: PanelFile,
    l7: PanelFile,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct PanelFile {
    radiance: Option<f64>,
    /// Of the frame in the middle of the bright side: z out of it, y along the long side.
    pose: Option<PoseFile>,
    size: Option<[f64; 2]>,
}

impl LightsFile {
    pub(super) fn resolve(&self, folder: &Path) -> Result<Lights, SimError> {
        let mut wiring: [Option<u8>; 7] = std::array::from_fn(|index| Some(index as u8 + 1));
        for (index, [first, second]) in self.swapped.iter().enumerate() {
            let place = format!("swapped[{index}]");
            wiring.swap(output(&place, *first)?, output(&place, *second)?);
        }
        for (index, dead) in self.dead.iter().enumerate() {
            let dead = output(&format!("dead[{index}]"), *dead)? as u8 + 1;
            for panel in wiring.iter_mut().filter(|panel| **panel == Some(dead)) {
                *panel = None;
            }
        }
        Ok(Lights {
            port: self.port.as_ref().map(|port| folder.join(port)),
            wiring,
        })
    }

    pub(super) fn panels(&self) -> Result<[Panel; 7], SimError> {
        let PanelsFile {
            l1,
            l2,
            l3,
            l4,
            l5,
            l6,
            l7,
        } = &self.panels;
        let mut panels = Panel::rig();
        for (index, (panel, file)) in panels.iter_mut().zip([l1, l2, l3, l4, l5, l6, l7]).enumerate() {
            let place = format!("L{}", index + 1);
            file.change(panel).map_err(|error| error.within(&place))?;
        }
        Ok(panels)
    }
}

fn output(place: &str, panel: u8) -> Result<usize, SimError> {
    within(place, f64::from(panel), 1.0, 7.0)?;
    Ok(usize::from(panel) - 1)
}

impl PanelFile {
    fn change(&self, panel: &mut Panel) -> Result<(), SimError> {
        if let Some(radiance) = self.radiance {
            within("radiance", radiance, 0.0, 1000.0)?;
            panel.radiance = radiance;
        }
        if let Some(size) = self.size {
            for side in size {
                within("size", side, 1e-3, 10.0)?;
            }
            panel.size = size;
        }
        if let Some(pose) = self.pose {
            let place = panel.centre;
            let base_from_panel = pose
                .resolve([place.x, place.y, place.z])
                .map_err(|error| error.within("pose"))?;
            let axis = |axis: Vector3<f64>| Unit::new_normalize(base_from_panel.transform_direction(&axis));
            panel.centre = Point3::from(base_from_panel.translation());
            panel.facing = axis(Vector3::z());
            panel.right = axis(Vector3::y());
        }
        Ok(())
    }
}
