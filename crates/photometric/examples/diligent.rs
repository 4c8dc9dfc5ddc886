//! Mean angular error on five real objects of the `DiLiGenT` benchmark, 96 lights (Shi et al., TPAMI 2019):
//!
//! ```text
//! cargo run --release -p photometric --example diligent -- ../shared/data/diligent
//! ```

use std::error::Error;
use std::path::{Path, PathBuf};
use std::time::Instant;

use geometry::nalgebra::{Unit, Vector3};
use imaging::{DecodedPng, Image, Mask, decode_png};
use npyz::NpyFile;
use photometric::{ManyLightInput, ManyLightOptions, many_light_normals};

const OBJECTS: [&str; 5] = ["ball", "bear", "cat", "pot1", "reading"];

struct Object {
    samples: Vec<Image<f32>>,
    directions: Vec<Unit<Vector3<f64>>>,
    mask: Mask,
    truth: Vec<f32>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: diligent FOLDER")?;
    let options = ManyLightOptions::default();
    let mut means = Vec::new();
    for name in OBJECTS {
        let object = Object::read(&PathBuf::from(&folder).join(name))?;
        let started = Instant::now();
        let plain = object.error(ManyLightOptions {
            darkest: 0.0,
            brightest: 1.0,
            rounds: 0,
        })?;
        let ranked = object.error(ManyLightOptions {
            darkest: 0.2,
            brightest: 0.8,
            rounds: 0,
        })?;
        let ours = object.error(options)?;
        let seconds = started.elapsed().as_secs_f64();
        println!(
            "{name:8} least squares {plain:5.2}   ranks 20-80 % {ranked:5.2}   bi-polynomial {ours:5.2}   {seconds:.1} s"
        );
        means.push(ours);
    }
    println!(
        "mean of the five: {:.2} degrees",
        means.iter().sum::<f64>() / means.len() as f64
    );
    Ok(())
}

impl Object {
    fn read(folder: &Path) -> Result<Self, Box<dyn Error>> {
        let directions = table(&folder.join("light_directions.txt"))?;
        let intensities = table(&folder.join("light_intensities.txt"))?;
        let sample = |(index, intensity): (usize, &Vec<f64>)| -> Result<Image<f32>, Box<dyn Error>> {
            let path = folder.join(format!("{:03}.png", index + 1));
            let gray = |rgb: [f64; 3]| (0..3).map(|c| rgb[c] / intensity[c]).sum::<f64>() as f32;
            Ok(match decode_png(&std::fs::read(&path)?)? {
                DecodedPng::Rgb8(image) => image.map(|rgb| gray(rgb.map(f64::from))),
                _ => return Err(format!("{}: expected 8-bit RGB", path.display()).into()),
            })
        };
        let mask = match decode_png(&std::fs::read(folder.join("mask.png"))?)? {
            DecodedPng::Gray8(mask) => mask,
            DecodedPng::Rgb8(mask) => mask.map(|rgb| rgb[0]),
            DecodedPng::Gray16(_) => return Err("the mask has 16 bits".into()),
        };
        let truth = NpyFile::new(std::io::BufReader::new(std::fs::File::open(
            folder.join("normal_gt.npy"),
        )?))?;
        Ok(Self {
            samples: intensities.iter().enumerate().map(sample).collect::<Result<_, _>>()?,
            directions: directions
                .iter()
                .map(|d| Unit::new_normalize(Vector3::new(d[0], d[1], d[2])))
                .collect(),
            mask: Mask::from_nonzero(&mask),
            truth: truth.into_vec::<f32>()?,
        })
    }

    fn error(&self, options: ManyLightOptions) -> Result<f64, Box<dyn Error>> {
        let input = ManyLightInput {
            samples: &self.samples,
            directions: &self.directions,
            to_camera: Vector3::z_axis(),
            mask: &self.mask,
        };
        let normals = many_light_normals(&input, &options)?;
        let (mut sum, mut count) = (0.0, 0.0);
        for (index, found) in normals.pixels().iter().enumerate() {
            if self.mask.as_image().pixels()[index] != 0 {
                // The file is in the order of Fortran: rows vary fastest, components slowest.
                let (width, height) = (normals.width(), normals.height());
                let at = |c: usize| index / width + height * (index % width + width * c);
                let dot: f32 = (0..3).map(|c| found[c] * self.truth[at(c)]).sum();
                sum += if dot.is_nan() {
                    90.0
                } else {
                    f64::from(dot.clamp(-1.0, 1.0).acos().to_degrees())
                };
                count += 1.0;
            }
        }
        Ok(sum / count)
    }
}

fn table(path: &Path) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let row = |line: &str| line.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    Ok(text
        .lines()
        .filter(|line| !line.trim().is_empty())
        .map(row)
        .collect::<Result<_, _>>()?)
}
