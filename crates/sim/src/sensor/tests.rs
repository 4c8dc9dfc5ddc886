use super::*;

const SIDE: usize = 512;

/// A view of even grey under each light, L1 ten times the ambient light.
fn view(ambient: f32) -> RenderedView {
    let flat = |radiance| Image::filled(SIDE, SIDE, radiance);
    RenderedView {
        ambient: flat(ambient),
        lights: std::array::from_fn(|index| flat(ambient * 10.0 * (index + 1) as f32)),
        normals: Image::filled(SIDE, SIDE, [0.0, 0.0, 1.0]),
        depth: flat(1.0),
        labels: Image::filled(SIDE, SIDE, 0),
    }
}

fn exposure() -> Exposure {
    Exposure {
        seconds: 0.0025,
        gain_decibels: 0.0,
        black_level: 0,
        averaged: 1,
        region: Region {
            x: 0,
            y: 0,
            width: SIDE,
            height: SIDE,
        },
    }
}

/// Radiance that gives this many electrons in 2.5 ms.
fn radiance(electrons: f64) -> f32 {
    let sensor = Sensor::default();
    (electrons * FULL_SCALE / sensor.full_well / sensor.dn_per_radiance_second / 0.0025) as f32
}

fn statistics(image: &Image<u16>) -> (f64, f64) {
    let electrons = |value: &u16| f64::from(*value) * Sensor::default().full_well / FULL_SCALE;
    let count = image.pixels().len() as f64;
    let mean = image.pixels().iter().map(electrons).sum::<f64>() / count;
    let squares = image.pixels().iter().map(|value| (electrons(value) - mean).powi(2));
    (mean, squares.sum::<f64>() / count)
}

fn assert_close(what: &str, found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what} is {found}, expected {expected}"
    );
}

/// Of steps of 16: a twelfth of a step's square.
fn quantisation() -> f64 {
    (16.0 * Sensor::default().full_well / FULL_SCALE).powi(2) / 12.0
}

#[test]
fn mean_and_variance_are_those_of_shot_and_read_noise() {
    for (electrons, averaged) in [(400.0, 1), (5000.0, 1), (5000.0, 4), (9000.0, 1)] {
        let exposure = Exposure { averaged, ..exposure() };
        let image = Sensor::default()
            .expose(&view(radiance(electrons)), LightState::default(), &exposure, 7)
            .unwrap();
        let (mean, variance) = statistics(&image);
        let expected = (electrons + 64.0) / f64::from(averaged) + quantisation();
        // Five standard errors of both, for 512 x 512 pixels.
        assert_close("the mean", mean, electrons, 5.0 * expected.sqrt() / 512.0);
        assert_close("the variance", variance / expected, 1.0, 5.0 * 2.0_f64.sqrt() / 512.0);
    }
}

#[test]
fn noise_is_neither_skewed_nor_alike_between_neighbours() {
    let image = Sensor::default()
        .expose(&view(radiance(5000.0)), LightState::default(), &exposure(), 3)
        .unwrap();
    let (mean, variance) = statistics(&image);
    let scale = Sensor::default().full_well / FULL_SCALE / variance.sqrt();
    let standard = image.map(|value| f64::from(*value) * scale - mean / variance.sqrt());
    let average = |products: Vec<f64>| products.iter().sum::<f64>() / products.len() as f64;
    let limit = 5.0 / 512.0;
    let third = average(standard.pixels().iter().map(|z| z.powi(3)).collect());
    assert_close("the skewness", third, 0.0, limit * 15.0_f64.sqrt());
    let fourth = average(standard.pixels().iter().map(|z| z.powi(4)).collect());
    assert_close("the kurtosis", fourth, 3.0, limit * 96.0_f64.sqrt());
    for (name, distance) in [("right", 1), ("below", SIDE), ("a run further", CHUNK)] {
        let pairs = standard.pixels().iter().zip(&standard.pixels()[distance..]);
        assert_close(name, average(pairs.map(|(a, b)| a * b).collect()), 0.0, limit);
    }
}

#[test]
fn light_adds_up_by_the_share_of_the_exposure_it_was_on() {
    let view = view(radiance(100.0));
    let mean = |lights| statistics(&Sensor::default().expose(&view, lights, &exposure(), 1).unwrap()).0;
    assert_close("dark", mean(LightState::default()), 100.0, 0.5);
    assert_close("L2", mean(LightState::single(2)), 2100.0, 1.0);
    let half = LightState::from_shares([0.5, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0]);
    assert_close("half of L1, a quarter of L3", mean(half), 100.0 + 500.0 + 750.0, 1.0);
}

#[test]
fn levels_are_steps_of_sixteen_and_saturate() {
    let dark = Sensor::default()
        .expose(&view(0.0), LightState::default(), &exposure(), 1)
        .unwrap();
    assert!(dark.pixels().contains(&0), "noise below black is cut off");
    let black = Exposure {
        black_level: 3200,
        ..exposure()
    };
    let raised = Sensor::default()
        .expose(&view(0.0), LightState::default(), &black, 1)
        .unwrap();
    assert_close(
        "the black level",
        statistics(&raised).0,
        3200.0 * 10_500.0 / 65_535.0,
        0.2,
    );
    assert!(raised.pixels().iter().all(|value| value.is_multiple_of(16)));
    let bright = view(radiance(20_000.0));
    let saturated = Sensor::default()
        .expose(&bright, LightState::default(), &exposure(), 1)
        .unwrap();
    assert!(saturated.pixels().iter().all(|value| *value == 65_520));
}

#[test]
fn gain_amplifies_signal_and_noise_alike() {
    let gain = Exposure {
        gain_decibels: 20.0 * 2.0_f64.log10(),
        ..exposure()
    };
    let image = Sensor::default()
        .expose(&view(radiance(2000.0)), LightState::default(), &gain, 5)
        .unwrap();
    let (mean, variance) = statistics(&image);
    assert_close("the mean", mean, 4000.0, 1.0);
    assert_close("the variance", variance / (4.0 * 2064.0 + quantisation()), 1.0, 0.014);
}

#[test]
fn the_same_number_is_the_same_image_and_another_is_not() {
    let view = view(radiance(1000.0));
    let image = |noise| {
        Sensor::default()
            .expose(&view, LightState::default(), &exposure(), noise)
            .unwrap()
    };
    assert_eq!(image(1), image(1));
    let (one, other) = (image(1), image(2));
    let alike = one.pixels().iter().zip(other.pixels()).filter(|(a, b)| a == b).count();
    assert!(alike < SIDE * SIDE / 10, "{alike} pixels are alike");
}

#[test]
fn a_region_is_cut_from_the_view_and_must_lie_in_it() {
    let mut view = view(0.0);
    view.ambient = Image::from_fn(SIDE, SIDE, |x, y| {
        radiance(if (x, y) == (300, 20) { 10_000.0 } else { 0.0 })
    });
    let region = |x, y, width, height| Exposure {
        region: Region { x, y, width, height },
        ..exposure()
    };
    let image = Sensor::default()
        .expose(&view, LightState::default(), &region(298, 19, 3, 2), 1)
        .unwrap();
    let bright: Vec<bool> = image.pixels().iter().map(|value| *value > 30_000).collect();
    assert_eq!(bright, [false, false, false, false, false, true]);
    for outside in [region(500, 0, 20, 20), region(0, 0, 0, 4), region(usize::MAX, 0, 2, 2)] {
        let refused = Sensor::default().expose(&view, LightState::default(), &outside, 1);
        assert!(refused.unwrap_err().to_string().contains("allowed is inside 512 x 512"));
    }
}
