//! `scene.json` of a capture, and the scene it describes.

use std::collections::HashMap;
use std::path::Path;

use ::sim::objects::{Ball, MeshFile, Shape};
use ::sim::scene::{AMBIENT_RADIANCE, Albedo, Body, Panel, Room, Scene, View};
use anyhow::{Context, anyhow};
use geometry::nalgebra::{Point3, Unit, Vector3};
use geometry::{PinholeCamera, PlumbBob, RigidTransform, TriangleMesh};
use serde::Deserialize;

use super::prints::Print;

/// Segments of a hemisphere: its facets turn by 0.6 degrees.
const HEMISPHERE_SEGMENTS: u32 = 600;

#[derive(Deserialize)]
pub(super) struct Description {
    workspace: Workspace,
    objects: Vec<Object>,
    pub(super) views: Vec<ViewEntry>,
    lights_reference: Vec<Light>,
    pub(super) sensor: Sensor,
}

#[derive(Deserialize)]
struct Workspace {
    #[serde(rename = "W")]
    centre: [f64; 3],
    mat: [f64; 2],
    albedo: SurfaceAlbedos,
}

#[derive(Deserialize)]
struct SurfaceAlbedos {
    mat: f64,
    table: f64,
    wall: f64,
}

#[derive(Deserialize)]
struct Object {
    mesh: Option<String>,
    #[serde(rename = "T_base_obj")]
    pose: Option<[[f64; 4]; 4]>,
    /// Of a hemisphere on the mat, which has neither mesh nor pose.
    centre_m: Option<[f64; 3]>,
    radius_m: Option<f64>,
    albedo: ObjectAlbedo,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum ObjectAlbedo {
    Uniform(f64),
    /// A random print; what it looks like is known per pixel only.
    Print {
        cell_mm: f64,
    },
}

/// The middle of what printed cells reflect.
pub(super) const PRINT_ALBEDO: f64 = 0.435;

#[derive(Deserialize)]
pub(super) struct ViewEntry {
    pub(super) camera: String,
    pub(super) size: [usize; 2],
    #[serde(rename = "K")]
    k: [[f64; 3]; 3],
    dist_k1k2: [f64; 2],
    #[serde(rename = "T_base_cam")]
    pose: [[f64; 4]; 4],
    pub(super) dn_per_radiance: f64,
}

#[derive(Deserialize)]
struct Light {
    centre: [f64; 3],
    normal: [f64; 3],
    right: [f64; 3],
    size_right_up_m: [f64; 2],
    radiance_rel: f64,
}

#[derive(Deserialize)]
pub(super) struct Sensor {
    pub(super) full_well_e: f64,
    pub(super) read_noise_e: f64,
    pub(super) full_scale_dn: f64,
}

impl Description {
    pub(super) fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join("scene.json");
        let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        serde_json::from_str(&text).with_context(|| format!("cannot understand {}", path.display()))
    }

    /// What stands there. Table, wall and ceiling are those of the rig: captures do not say where they are.
    pub(super) fn scene(&self, folder: &Path) -> anyhow::Result<Scene> {
        let mut room = Room::rig();
        room.mat_centre = [self.workspace.centre[0], self.workspace.centre[1]];
        room.mat_size = self.workspace.mat;
        room.mat_albedo = self.workspace.albedo.mat;
        room.table_albedo = self.workspace.albedo.table;
        for wall in &mut room.walls {
            wall.albedo = self.workspace.albedo.wall;
        }
        let bodies = self.objects.iter().map(|object| object.body(folder));
        Ok(Scene {
            bodies: bodies.collect::<anyhow::Result<_>>()?,
            room,
            panels: self.panels()?,
            ambient_radiance: AMBIENT_RADIANCE,
        })
    }

    pub(super) fn panels(&self) -> anyhow::Result<[Panel; 7]> {
        let panels: Vec<Panel> = self.lights_reference.iter().map(Light::panel).collect();
        let found = panels.len();
        panels
            .try_into()
            .map_err(|_| anyhow!("lights_reference names {found} lights; understood are 7"))
    }

    /// Printed objects, by the labels of a rendered view.
    pub(super) fn prints(&self) -> anyhow::Result<HashMap<u8, Print>> {
        let numbered = (1..=u8::MAX).zip(&self.objects);
        let print = |(label, object): (u8, &Object)| {
            let (ObjectAlbedo::Print { cell_mm }, Some(pose)) = (&object.albedo, object.pose) else {
                return None;
            };
            let cell = cell_mm * 1e-3;
            let pose = RigidTransform::from_matrix(&pose);
            Some(pose.map(|base_from_object| (label, Print { base_from_object, cell })))
        };
        Ok(numbered.filter_map(print).collect::<Result<_, _>>()?)
    }

    /// Whether the object is a hemisphere that hides none of itself.
    pub(super) fn is_hemisphere(&self) -> bool {
        self.objects.iter().all(|object| object.radius_m.is_some())
    }
}

impl Light {
    fn panel(&self) -> Panel {
        let unit = |direction: [f64; 3]| Unit::new_normalize(Vector3::from(direction));
        Panel {
            centre: Point3::from(self.centre),
            facing: unit(self.normal),
            right: unit(self.right),
            size: self.size_right_up_m,
            radiance: self.radiance_rel,
        }
    }
}

impl Object {
    fn body(&self, folder: &Path) -> anyhow::Result<Body> {
        let (mesh, base_from_body) = self.placed(folder)?;
        Ok(Body {
            name: self.mesh.clone().unwrap_or_else(|| "hemisphere".to_owned()),
            mesh: mesh.transformed(&base_from_body),
            base_from_body,
            albedo: Albedo::Uniform(match self.albedo {
                ObjectAlbedo::Uniform(albedo) => albedo,
                ObjectAlbedo::Print { .. } => PRINT_ALBEDO,
            }),
        })
    }

    fn placed(&self, folder: &Path) -> anyhow::Result<(TriangleMesh, RigidTransform)> {
        match (&self.mesh, self.pose, self.centre_m) {
            (Some(mesh), Some(pose), _) => {
                // Meshes lie beside the groups of scenes.
                let root = folder.join("../..");
                let shape = Shape::Mesh(MeshFile {
                    file: mesh.into(),
                    scale: 1.0,
                });
                Ok((shape.mesh(&root)?, RigidTransform::from_matrix(&pose)?))
            }
            (None, _, Some(centre)) => {
                let shape = Shape::Hemisphere(Ball {
                    radius: self.radius_m,
                    segments: Some(HEMISPHERE_SEGMENTS),
                });
                let upright = RigidTransform::from_quaternion_xyzw(centre, [0.0, 0.0, 0.0, 1.0])?;
                Ok((shape.mesh(folder)?, upright))
            }
            _ => Err(anyhow!("an object has neither mesh and pose nor centre and radius")),
        }
    }
}

impl ViewEntry {
    /// The camera, with `bin` x `bin` of its pixels in one.
    pub(super) fn view(&self, bin: usize) -> anyhow::Result<View> {
        let [[fx, _, cx], [_, fy, cy], _] = self.k;
        let [k1, k2] = self.dist_k1k2;
        let lens = PlumbBob {
            k1,
            k2,
            ..PlumbBob::default()
        };
        let camera = PinholeCamera::new(self.size[0], self.size[1], [fx, fy], [cx, cy])?.with_distortion(lens);
        Ok(View {
            camera: camera.binned(bin)?,
            base_from_camera: RigidTransform::from_matrix(&self.pose)?,
        })
    }
}
