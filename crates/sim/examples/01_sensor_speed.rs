//! How long the sensor takes for a full image with one panel lit: a frame must be ready when a camera's would be. Run
//! with `--release`.

use std::time::{Duration, Instant};

use imaging::Image;
use sim::SimError;
use sim::render::RenderedView;
use sim::sensor::{Exposure, LightState, Region, Sensor};

const SIDE: usize = 1536;
const RUNS: u64 = 31;

fn main() -> Result<(), SimError> {
    let flat = |radiance| Image::filled(SIDE, SIDE, radiance);
    let view = RenderedView {
        ambient: flat(0.001),
        lights: std::array::from_fn(|_| flat(0.02)),
        normals: Image::filled(SIDE, SIDE, [0.0, 0.0, 1.0]),
        depth: flat(0.3),
        labels: Image::filled(SIDE, SIDE, 0),
    };
    let exposure = Exposure {
        seconds: 0.0025,
        gain_decibels: 0.0,
        black_level: 64,
        averaged: 1,
        region: Region {
            x: 0,
            y: 0,
            width: SIDE,
            height: SIDE,
        },
    };
    let mut times = Vec::new();
    for number in 0..RUNS {
        let start = Instant::now();
        std::hint::black_box(Sensor::default().expose(&view, LightState::single(1), &exposure, number)?);
        times.push(start.elapsed());
    }
    times.sort();
    let [fastest, middle, slowest]: [Duration; 3] = [0, times.len() / 2, times.len() - 1].map(|index| times[index]);
    println!("{SIDE} x {SIDE}, {RUNS} runs: fastest {fastest:?}, median {middle:?}, slowest {slowest:?}");
    Ok(())
}
