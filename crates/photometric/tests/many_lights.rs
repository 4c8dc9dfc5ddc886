//! Many distant lights: matte and glossy balls, symmetries, and what is refused.

mod common;

use common::{angle, sphere_normal};
use geometry::nalgebra::{Unit, Vector3};
use imaging::{Image, Mask};
use photometric::{ManyLightInput, ManyLightOptions, PhotometricError, many_light_normals};

const SIZE: usize = 40;

/// Directions spread over the upper part of the sphere.
fn directions(count: usize) -> Vec<Unit<Vector3<f64>>> {
    let direction = |k: usize| {
        let (z, around) = (1.0 - 0.6 * (k as f64 + 0.5) / count as f64, k as f64 * 2.399_963);
        let radius = (1.0_f64 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(radius * around.cos(), radius * around.sin(), z))
    };
    (0..count).map(direction).collect()
}

/// A ball under each light: matte, with a highlight of some strength.
fn ball(lights: &[Unit<Vector3<f64>>], highlight: f64) -> Vec<Image<f32>> {
    let picture = |light: &Unit<Vector3<f64>>| {
        let half = (light.into_inner() + Vector3::z()).normalize();
        Image::from_fn(SIZE, SIZE, |x, y| {
            let Some(normal) = sphere_normal(x, y, SIZE) else {
                return 0.0;
            };
            let normal = Vector3::from(normal.map(f64::from));
            let matte = normal.dot(light).max(0.0);
            let glossy = if matte > 0.0 {
                highlight * normal.dot(&half).max(0.0).powi(60)
            } else {
                0.0
            };
            (matte + glossy) as f32
        })
    };
    lights.iter().map(picture).collect()
}

fn disc() -> Mask {
    Mask::from_nonzero(&Image::from_fn(SIZE, SIZE, |x, y| {
        u8::from(sphere_normal(x, y, SIZE).is_some())
    }))
}

fn solve(samples: &[Image<f32>], lights: &[Unit<Vector3<f64>>]) -> Result<Image<[f32; 3]>, PhotometricError> {
    let input = ManyLightInput {
        samples,
        directions: lights,
        to_camera: Vector3::z_axis(),
        mask: &disc(),
    };
    many_light_normals(&input, &ManyLightOptions::default())
}

/// Mean angle where the surface does not lean away too far.
fn error(normals: &Image<[f32; 3]>) -> f64 {
    let mut angles = Vec::new();
    for y in 0..SIZE {
        for x in 0..SIZE {
            if let Some(truth) = sphere_normal(x, y, SIZE).filter(|truth| truth[2] > 0.4) {
                angles.push(angle(*normals.get(x, y).unwrap(), truth));
            }
        }
    }
    angles.iter().sum::<f64>() / angles.len() as f64
}

#[test]
fn a_matte_ball_is_exact_and_a_glossy_one_nearly() {
    let lights = directions(60);
    let matte = error(&solve(&ball(&lights, 0.0), &lights).unwrap());
    let glossy = error(&solve(&ball(&lights, 0.8), &lights).unwrap());
    println!("matte {matte:.3}, glossy {glossy:.3} degrees");
    assert!(matte < 0.05 && glossy < 1.5, "{matte} {glossy}");
}

#[test]
fn the_order_of_lights_and_the_brightness_do_not_matter() {
    let lights = directions(40);
    let samples = ball(&lights, 0.5);
    let first = solve(&samples, &lights).unwrap();
    let (mut turned, mut brighter) = (lights.clone(), samples.clone());
    turned.reverse();
    brighter.reverse();
    for image in &mut brighter {
        image.pixels_mut().iter_mut().for_each(|value| *value *= 7.0);
    }
    let second = solve(&brighter, &turned).unwrap();
    for (a, b) in first.pixels().iter().zip(second.pixels()) {
        assert!(a[0].is_nan() && b[0].is_nan() || angle(*a, *b) < 0.05, "{a:?} {b:?}");
    }
}

#[test]
fn what_cannot_be_solved_is_nan_or_refused() {
    let lights = directions(20);
    let samples = ball(&lights, 0.0);
    let few = solve(&samples[..7], &lights[..7]).unwrap_err();
    assert!(
        matches!(few, PhotometricError::TooFewLights { got: 7, needed: 16 }),
        "{few}"
    );
    let odd = solve(&samples, &lights[..18]).unwrap_err().to_string();
    assert!(odd.contains("number of images"), "{odd}");
    let mut other = samples.clone();
    other[3] = Image::filled(5, 5, 1.0);
    assert!(matches!(
        solve(&other, &lights).unwrap_err(),
        PhotometricError::OtherSize { width: 5, .. }
    ));
    let lost: Vec<Image<f32>> = samples.iter().map(|image| image.map(|_| f32::NAN)).collect();
    assert!(solve(&lost, &lights).unwrap().pixels().iter().all(|n| n[0].is_nan()));
    let input = ManyLightInput {
        samples: &samples,
        directions: &lights,
        to_camera: Vector3::z_axis(),
        mask: &disc(),
    };
    let options = ManyLightOptions {
        darkest: f64::NAN,
        ..ManyLightOptions::default()
    };
    assert!(matches!(
        many_light_normals(&input, &options),
        Err(PhotometricError::OutOfRange { .. })
    ));
}
