//! The rig as it stands: what a world has unless its file says otherwise.

use std::array::from_fn;

use geometry::nalgebra::{Point3, Unit, Vector3};
use geometry::{GeometryError, PinholeCamera, RigidTransform};

use super::{Panel, Room, View, Wall};

/// Middle of the mat.
const WORKSPACE: Point3<f64> = Point3::new(0.43, 0.0, 0.0);
/// Long and short side of a panel.
const PANEL_SIZE: [f64; 2] = [0.25, 0.1];

/// Radiance of the ambient light of the rig, in the panels' unit: with it, a level surface on the mat gets 3 % of what L1
/// gives a surface that faces it there.
pub const AMBIENT_RADIANCE: f64 = 1.29e-3;

/// Where camera 1 hangs when the wrist is over the middle of the mat.
const C1_TRANSLATION: [f64; 3] = [0.412_294_794_6, -0.008_256_072_9, 0.331_403_135_5];
const C1_QUATERNION_XYZW: [f64; 4] = [0.731_104_102_3, 0.681_582_123_3, 0.029_045_118_7, 0.009_433_020_3];
const C2_TRANSLATION: [f64; 3] = [0.328_690_518_0, 0.129_670_223_8, 0.409_268_199_0];
const C2_QUATERNION_XYZW: [f64; 4] = [0.689_882_928_0, 0.697_137_943_3, -0.024_788_032_5, 0.193_509_139_8];

impl Room {
    /// The surroundings of the rig: mat, table, a wall at +y and a ceiling.
    ///
    /// The captures of the rig do not say where table, wall and ceiling end. These are the places and sizes that explain
    /// best, with [`AMBIENT_RADIANCE`], the light on the unlit sides of four hemispheres all over the mat.
    pub fn rig() -> Self {
        Self {
            mat_centre: [WORKSPACE.x, WORKSPACE.y],
            mat_size: [0.46, 0.61],
            mat_albedo: 0.04,
            table_centre: [0.6, 0.32],
            table_size: [2.1, 2.1],
            table_albedo: 0.3,
            walls: vec![
                Wall {
                    centre: Point3::new(0.43, 0.875, 1.04),
                    normal: -Vector3::y_axis(),
                    right: Vector3::x_axis(),
                    size: [3.2, 2.08],
                    albedo: 0.7,
                },
                Wall {
                    centre: Point3::new(0.43, 0.0, 1.84),
                    normal: -Vector3::z_axis(),
                    right: Vector3::x_axis(),
                    size: [2.7, 2.7],
                    albedo: 0.7,
                },
            ],
        }
    }
}

impl Panel {
    /// The seven panels of the rig, as bright as they are: six at grazing height around the mat, one over it.
    pub fn rig() -> [Self; 7] {
        let radiances = [1.0, 0.93, 1.08, 0.96, 1.05, 0.91];
        from_fn(|index| match radiances.get(index) {
            Some(&radiance) => Self::grazing(30.0 + 60.0 * index as f64, radiance),
            None => Self {
                centre: WORKSPACE + Vector3::new(0.0, 0.0, 0.9),
                facing: -Vector3::z_axis(),
                right: Vector3::y_axis(),
                size: PANEL_SIZE,
                radiance: 0.557_438_716_059_075_2,
            },
        })
    }

    /// Half a metre from the middle of the mat, 150 mm high, aimed at 20 mm above it.
    fn grazing(azimuth_degrees: f64, radiance: f64) -> Self {
        let (sin, cos) = azimuth_degrees.to_radians().sin_cos();
        let centre = WORKSPACE + Vector3::new(0.5 * cos, 0.5 * sin, 0.15);
        Self {
            centre,
            facing: Unit::new_normalize(WORKSPACE + Vector3::new(0.0, 0.0, 0.02) - centre),
            right: Unit::new_normalize(Vector3::new(-sin, cos, 0.0)),
            size: PANEL_SIZE,
            radiance,
        }
    }
}

impl View {
    /// Camera 1 of the rig over the middle of the mat, at full resolution.
    pub fn rig_c1() -> Result<Self, GeometryError> {
        Self::rig(2181.8, [771.3, 763.8], C1_TRANSLATION, C1_QUATERNION_XYZW)
    }

    /// Camera 2 of the rig, fixed over the table, at full resolution.
    pub fn rig_c2() -> Result<Self, GeometryError> {
        Self::rig(2909.1, [760.2, 774.9], C2_TRANSLATION, C2_QUATERNION_XYZW)
    }

    fn rig(focal: f64, principal: [f64; 2], translation: [f64; 3], xyzw: [f64; 4]) -> Result<Self, GeometryError> {
        Ok(Self {
            camera: PinholeCamera::new(1536, 1536, [focal, focal], principal)?,
            base_from_camera: RigidTransform::from_quaternion_xyzw(translation, xyzw)?,
        })
    }
}
