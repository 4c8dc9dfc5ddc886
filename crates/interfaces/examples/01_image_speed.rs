//! How long a 28 MB normal map takes to and from the wire form. Run with `--release`.

use std::time::{Duration, Instant};

use interfaces::sensor_msgs::msg::Image;
use interfaces::{ByteSequence, cdr};

const SIDE_PX: u32 = 1536;
const BYTES_PER_PIXEL: u32 = 12;
const RUNS: usize = 15;

fn main() -> Result<(), cdr::Error> {
    let step = SIDE_PX * BYTES_PER_PIXEL;
    let data: ByteSequence = (0..step * SIDE_PX).map(|index| index as u8).collect();
    let image = Image {
        height: SIDE_PX,
        width: SIDE_PX,
        encoding: "32FC3".into(),
        step,
        data,
        ..Image::default()
    };

    let bytes = cdr::to_vec(&image)?;
    let write = median(|| cdr::to_vec(&image).map(drop))?;
    let read = median(|| cdr::from_slice::<Image>(&bytes).map(drop))?;
    let clone = median(|| {
        drop(std::hint::black_box(&image).clone());
        Ok(())
    })?;
    println!(
        "{:.1} MB, median of {RUNS}: write {write:?}, read {read:?}, clone {clone:?}",
        bytes.len() as f64 * 1e-6
    );
    Ok(())
}

fn median(mut run: impl FnMut() -> Result<(), cdr::Error>) -> Result<Duration, cdr::Error> {
    let mut times = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let start = Instant::now();
        run()?;
        times.push(start.elapsed());
    }
    times.sort();
    Ok(times[RUNS / 2])
}
