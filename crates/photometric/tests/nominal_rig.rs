//! The rig as drawn, against the drawing's own numbers.

use photometric::{PhotometricError, nominal_panels};

#[test]
fn panels_stand_on_a_hexagon_and_face_the_workspace() {
    for panel in nominal_panels() {
        let offset = panel.centre - nalgebra::Point3::new(0.43, 0.0, 0.0);
        if panel.channel == 7 {
            assert!((offset - nalgebra::Vector3::new(0.0, 0.0, 0.9)).norm() < 1e-12);
            assert!((panel.facing.z + 1.0).abs() < 1e-12);
            continue;
        }
        assert!((offset.xy().norm() - 0.5).abs() < 1e-12);
        assert!((offset.z - 0.15).abs() < 1e-12);
        let azimuth = offset.y.atan2(offset.x).to_degrees().rem_euclid(360.0);
        assert!(
            (azimuth - (f64::from(panel.channel) * 60.0 - 30.0)).abs() < 1e-9,
            "L{} at {azimuth}",
            panel.channel
        );
        let hit = panel.centre + panel.facing.into_inner() * (0.5_f64.powi(2) + 0.13_f64.powi(2)).sqrt();
        assert!((hit - nalgebra::Point3::new(0.43, 0.0, 0.02)).norm() < 1e-12);
    }
}

#[test]
fn strength_follows_distance_and_the_panels_own_cosine() {
    let [first, .., overhead] = nominal_panels();
    let below = overhead.directional_light([0.43, 0.0, 0.0]).unwrap();
    assert!((below.intensity() - 1.0 / 0.81).abs() < 1e-12);
    let aside = overhead.directional_light([0.43, 0.9, 0.0]).unwrap();
    assert!((aside.intensity() - 0.5_f64.sqrt() / 1.62).abs() < 1e-12);
    let aim = first.directional_light([0.43, 0.0, 0.02]).unwrap();
    assert!((aim.intensity() - 1.0 / (0.25 + 0.0169)).abs() < 1e-12);
    assert!((aim.direction().into_inner() + first.facing.into_inner()).norm() < 1e-12);
}

#[test]
fn a_point_behind_a_panel_is_refused() {
    let [.., overhead] = nominal_panels();
    assert!(matches!(
        overhead.directional_light([0.43, 0.0, 1.0]),
        Err(PhotometricError::BehindPanel { channel: 7, .. })
    ));
    assert!(matches!(
        overhead.directional_light([f64::NAN; 3]),
        Err(PhotometricError::BehindPanel { .. })
    ));
}
