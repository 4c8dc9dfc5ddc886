//! Normals, depth edges and depth from shading.
//!
//! Brightness of a matte surface under several known lights gives its normal at every pixel. The model, its equations and
//! sources, and what each step gains are in this crate's `README.md`.
//!
//! [`solve_view`] does all of it for one capture; [`calibrate_lights`] finds the panels that it needs. This crate takes
//! exposure stacks and light models and returns maps with diagnostics; it knows no cameras, files or messages. Plain least
//! squares with distant lights are there as well ([`least_squares_normals`]), and tell in a few lines what this is about:
//!
//! ```
//! use imaging::{ExposureStack, Image};
//! use photometric::{LeastSquaresOptions, least_squares_normals, nominal_panels};
//!
//! let reference = [0.43, 0.0, 0.015];
//! let lights: Vec<_> = nominal_panels().iter().map(|panel| panel.directional_light(reference)).collect::<Result<_, _>>()?;
//!
//! // A level white table: every light shines with its strength times the cosine of its angle to base z.
//! let brightness = |z: f64, intensity: f64| (z * intensity * 5_000.0).round() as u16;
//! let images = lights.iter().map(|light| (light.channel(), brightness(light.direction().z, light.intensity())));
//! let images = std::iter::once((0, 0)).chain(images).map(|(channel, value)| (channel, Image::filled(2, 2, value)));
//! let stack = ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, 65_000)?;
//!
//! let result = least_squares_normals(&stack, &lights, &LeastSquaresOptions::default())?;
//! assert!(result.normals.pixels()[0][2] > 0.9999);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod calibration;
mod depth;
mod directional_light;
mod error;
mod exposure_control;
mod half_size;
mod least_squares;
mod light_health;
mod light_matrix;
mod light_rig;
mod many_lights;
mod near_field;
mod nominal_rig;
mod object_mask;
mod occlusion_edges;
mod quality;
mod reference;
mod row_solver;
mod sensor_noise;
mod solution;
mod solve_view;
mod view;
mod window;

pub use calibration::{
    CalibrationOptions, LightCalibration, LightReport, PlacementReport, PolynomialLight, PolynomialRig, TargetView,
    calibrate_lights,
};
pub use depth::{DepthMap, IntegrationInput, IntegrationOptions, SurfacePoint, integrate, surface_points};
pub use directional_light::DirectionalLight;
pub use error::PhotometricError;
pub use exposure_control::{Brightness, ExposureAdvice};
pub use least_squares::{LeastSquaresOptions, NormalMapResult, PixelCounts, least_squares_normals};
pub use light_health::{LightLimits, LightMeasurement, PanelHealth, PanelMeasurement, PanelVerdict, dark_channels};
pub use light_rig::{Bounce, LightRig, PanelModel};
pub use many_lights::{ManyLightInput, ManyLightOptions, many_light_normals};
pub use near_field::{NearFieldOptions, near_field_normals};
pub use nominal_rig::{PanelLight, nominal_panels};
pub use object_mask::{ObjectMaskOptions, object_mask};
pub use occlusion_edges::{EdgeInput, EdgeMap, EdgeOptions, occlusion_edges};
pub use quality::Quality;
pub use reference::{ReferenceOptions, reference_normals};
pub use sensor_noise::SensorNoise;
pub use solution::{Capture, NormalSolution};
pub use solve_view::{SolveOptions, ViewSolution, solve_normals, solve_view, solve_view_by_reference};
pub use view::{PixelRays, View};
