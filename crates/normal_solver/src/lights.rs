//! The configured lights, in the base frame.

use geometry::RigidTransform;
use geometry::nalgebra::Vector3;
use photometric::DirectionalLight;

use crate::error::Error;

/// Lights L1, L2, ... from flat lists; `base_from_lights` turns the directions into the base frame.
pub(crate) fn lights_in_base(
    directions: &[f64],
    intensities: &[f64],
    base_from_lights: &RigidTransform,
) -> Result<Vec<DirectionalLight>, Error> {
    let (triples, rest) = directions.as_chunks::<3>();
    let fits = rest.is_empty() && triples.len() == intensities.len() && (3..=255).contains(&triples.len());
    if !fits {
        return Err(Error::LightLists {
            directions: directions.len(),
            intensities: intensities.len(),
        });
    }
    let light = |(channel, (direction, intensity)): (u8, (&[f64; 3], &f64))| {
        let direction_in_base = base_from_lights.transform_direction(&Vector3::from(*direction));
        DirectionalLight::new(channel, direction_in_base.into(), *intensity).map_err(Error::from)
    };
    (1..=u8::MAX).zip(triples.iter().zip(intensities)).map(light).collect()
}

#[cfg(test)]
mod tests {
    use geometry::nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    #[test]
    fn directions_turn_with_their_frame() {
        let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
        let base_from_camera = RigidTransform::from_parts(Vector3::new(1.0, 2.0, 3.0), half_turn);
        let directions = [0.0, 0.0, -2.0, 1.0, 0.0, -1.0, 0.0, 1.0, -1.0];
        let lights = lights_in_base(&directions, &[1.0, 2.0, 3.0], &base_from_camera).unwrap();
        let first = lights[0].direction();
        assert!((first.into_inner() - Vector3::z()).norm() < 1e-12, "{first:?}");
        assert_eq!(
            lights.iter().map(DirectionalLight::channel).collect::<Vec<_>>(),
            [1, 2, 3]
        );
    }

    #[test]
    fn lists_that_do_not_fit_are_refused_with_their_lengths() {
        let error = lights_in_base(&[0.0; 8], &[1.0; 3], &RigidTransform::identity())
            .unwrap_err()
            .to_string();
        assert!(error.contains("8 numbers") && error.contains('3'), "{error}");
        assert!(lights_in_base(&[1.0; 6], &[1.0; 2], &RigidTransform::identity()).is_err());
    }
}
