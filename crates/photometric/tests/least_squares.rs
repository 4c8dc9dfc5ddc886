//! Plain least squares against a rendered sphere, its symmetries, and what it refuses.

mod common;

use common::{angle, cosine, lights, sphere_normal, sphere_stack};
use imaging::{ExposureStack, Image};
use photometric::{DirectionalLight, LeastSquaresOptions, PhotometricError, least_squares_normals};
use proptest::prelude::*;

const SIZE: usize = 64;

fn options() -> LeastSquaresOptions {
    LeastSquaresOptions::default()
}

#[test]
fn a_sphere_is_recovered_where_every_light_reaches_it() {
    let lights = lights();
    let stack = sphere_stack(&lights, SIZE, 50_000.0, 65_000);
    let result = least_squares_normals(&stack, &lights, &options()).unwrap();
    let mut judged = 0;
    for (y, row) in result.normals.rows().enumerate() {
        for (x, &solved) in row.iter().enumerate() {
            let Some(truth) = sphere_normal(x, y, SIZE) else {
                assert!(
                    solved.iter().all(|n| n.is_nan()),
                    "({x}, {y}) is background, got {solved:?}"
                );
                continue;
            };
            if lights.iter().all(|light| cosine(truth, light) > 0.0) {
                judged += 1;
                assert!(angle(solved, truth) < 0.02, "({x}, {y}): {solved:?}, true {truth:?}");
                assert!((result.albedo.get(x, y).unwrap() / 50_000.0 - 1.0).abs() < 1e-3);
                assert!(*result.residual.get(x, y).unwrap() < 1e-3);
            }
        }
    }
    assert!(judged > 100, "only {judged} pixels see every light");
    let counts = result.counts;
    assert_eq!(counts.solved + counts.too_dark + counts.too_few_lights, SIZE * SIZE);
    assert_eq!(counts.saturated, 0);
}

#[test]
fn shadowed_pixels_show_in_the_residual() {
    let lights = lights();
    let result = least_squares_normals(&sphere_stack(&lights, SIZE, 50_000.0, 65_000), &lights, &options()).unwrap();
    let steep = *result.residual.get(SIZE / 2, 3).unwrap();
    let level = *result.residual.get(SIZE / 2, SIZE / 2).unwrap();
    assert!(steep > 20.0 * level, "steep {steep}, level {level}");
}

#[test]
fn saturated_samples_are_left_out() {
    let lights = lights();
    // Far too bright: patches that face a ring light a little clip.
    let stack = sphere_stack(&lights, SIZE, 160_000.0, 65_535);
    let result = least_squares_normals(&stack, &lights, &options()).unwrap();
    assert!(result.counts.saturated > 50, "{:?}", result.counts);
    let clipped_yet_exact = (0..SIZE * SIZE).filter(|index| {
        let (x, y) = (index % SIZE, index / SIZE);
        let truth = sphere_normal(x, y, SIZE);
        let samples: Vec<u16> = (1..=7)
            .map(|channel| *stack.light(channel).unwrap().get(x, y).unwrap())
            .collect();
        let clipped = samples.iter().filter(|&&raw| raw == 65_535).count();
        truth.is_some_and(|truth| {
            let sees_all = lights.iter().all(|light| cosine(truth, light) > 0.0);
            if clipped == 0 || clipped > 2 || !sees_all {
                return false;
            }
            let error = angle(*result.normals.get(x, y).unwrap(), truth);
            assert!(
                error < 0.05,
                "({x}, {y}) is off by {error} degrees with {clipped} clipped samples"
            );
            true
        })
    });
    assert!(clipped_yet_exact.count() > 10);
}

#[test]
fn pixels_that_lost_too_much_are_nan_and_counted() {
    let lights = lights();
    let raw = |pixel: [u16; 8]| pixel;
    // In turn: healthy, dark, saturated but for two lights, saturated but for three ring lights.
    let pixels = [
        raw([100, 5100, 5100, 5100, 5100, 5100, 5100, 6000]),
        raw([100, 110, 120, 90, 100, 100, 100, 130]),
        raw([100, 65_535, 65_535, 65_535, 65_535, 65_535, 5100, 6000]),
        raw([100, 5100, 65_535, 5100, 65_535, 5100, 65_535, 65_535]),
    ];
    let image = |channel: usize| Image::new(4, 1, pixels.iter().map(|pixel| pixel[channel]).collect()).unwrap();
    let images = (0..8_u8).map(|channel| (channel, image(usize::from(channel))));
    let stack = ExposureStack::new(&[1, 2, 3, 4, 5, 6, 7], images, 65_535).unwrap();
    let result = least_squares_normals(&stack, &lights, &options()).unwrap();
    let has_normal: Vec<bool> = result
        .normals
        .pixels()
        .iter()
        .map(|n| n.iter().all(|n| n.is_finite()))
        .collect();
    assert_eq!(has_normal, [true, false, false, true]);
    assert_eq!(
        result.albedo.pixels().iter().map(|a| a.is_nan()).collect::<Vec<_>>(),
        [false, true, true, false]
    );
    let counts = result.counts;
    assert_eq!(
        (counts.solved, counts.too_dark, counts.too_few_lights, counts.saturated),
        (2, 1, 1, 2)
    );
}

#[test]
fn lights_in_a_plane_are_refused_with_the_ratio() {
    let light = |channel, direction| DirectionalLight::new(channel, direction, 1.0).unwrap();
    let plane = [
        light(1, [1.0, 0.0, 1.0]),
        light(2, [0.0, 0.0, 1.0]),
        light(3, [-1.0, 0.01, 1.0]),
    ];
    let stack = sphere_stack(&plane, 4, 50_000.0, 65_000);
    let error = least_squares_normals(&stack, &plane, &options()).unwrap_err();
    assert!(matches!(error, PhotometricError::CoplanarLights { ratio, allowed } if ratio < 0.01 && allowed > 0.04));
    assert!(
        error.to_string().starts_with("lights are too close to one plane"),
        "{error}"
    );
}

#[test]
fn unusable_lights_and_options_are_refused() {
    let good = lights();
    let stack = sphere_stack(&good, 4, 50_000.0, 65_000);
    let solve = |lights: &[DirectionalLight]| least_squares_normals(&stack, lights, &options()).unwrap_err();
    assert!(matches!(
        solve(&good[..2]),
        PhotometricError::TooFewLights { got: 2, needed: 3 }
    ));
    assert!(matches!(
        solve(&[good[0], good[2], good[4], good[2]]),
        PhotometricError::DuplicateLight { channel: 3 }
    ));
    let stranger = DirectionalLight::new(9, [0.0, 0.0, 1.0], 1.0).unwrap();
    let error = solve(&[good[0], good[2], good[4], stranger]);
    assert_eq!(
        error.to_string(),
        "no image of light channel 9; the stack holds [1, 2, 3, 4, 5, 6, 7]"
    );
    assert!(matches!(
        DirectionalLight::new(1, [0.0; 3], 1.0),
        Err(PhotometricError::LightDirection { .. })
    ));
    assert!(matches!(
        DirectionalLight::new(1, [f64::NAN, 0.0, 1.0], 1.0),
        Err(PhotometricError::LightDirection { .. })
    ));
    assert!(matches!(
        DirectionalLight::new(1, [0.0, 0.0, 1.0], -1.0),
        Err(PhotometricError::LightIntensity { .. })
    ));
    let nan = LeastSquaresOptions {
        minimum_signal: f32::NAN,
        ..options()
    };
    assert!(matches!(
        least_squares_normals(&stack, &good, &nan),
        Err(PhotometricError::OutOfRange { .. })
    ));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_order_of_lights_does_not_matter(order in Just(lights()).prop_shuffle()) {
        let stack = sphere_stack(&lights(), 32, 50_000.0, 40_000);
        let sorted = least_squares_normals(&stack, &lights(), &options()).unwrap();
        let shuffled = least_squares_normals(&stack, &order, &options()).unwrap();
        prop_assert_eq!(sorted.counts, shuffled.counts);
        for (a, b) in sorted.normals.pixels().iter().zip(shuffled.normals.pixels()) {
            prop_assert!(a[0].is_nan() && b[0].is_nan() || angle(*a, *b) < 1e-3, "{a:?} and {b:?}");
        }
    }

    #[test]
    fn brightness_scales_albedo_and_leaves_normals(scale in 5_000.0_f32..60_000.0) {
        let lights = lights();
        let bright = least_squares_normals(&sphere_stack(&lights, 32, 60_000.0, 65_535), &lights, &options()).unwrap();
        let dim = least_squares_normals(&sphere_stack(&lights, 32, scale, 65_535), &lights, &options()).unwrap();
        for ((a, b), (p, q)) in (bright.normals.pixels().iter().zip(dim.normals.pixels()))
            .zip(bright.albedo.pixels().iter().zip(dim.albedo.pixels()))
        {
            if !b[0].is_nan() {
                prop_assert!(angle(*a, *b) < 0.2, "{a:?} and {b:?}");
                prop_assert!((q / p * 60_000.0 / scale - 1.0).abs() < 5e-3);
            }
        }
    }
}
