//! A rendered view beside its capture.

use ::sim::render::RenderedView;
use ::sim::scene::{Panel, View};
use geometry::nalgebra::{Point2, Point3, Vector3};
use imaging::Image;

use super::description::{Description, Sensor, ViewEntry};
use super::prints;
use super::score::{Group, Sums};
use super::truth::{Seen, Truth};

/// Images of a view: one per light, then the ambient light alone.
pub(super) const IMAGES: usize = 8;

/// Both in digital numbers, at the resolution of the comparison.
pub(super) struct Comparison {
    pub(super) ours: Vec<Image<f32>>,
    pub(super) truth: Vec<Image<f32>>,
    /// By image and pixel; none where there is no telling.
    groups: Vec<Vec<Option<Group>>>,
    noise: Noise,
}

/// What the sensor of the captures adds.
struct Noise {
    dn_per_electron: f64,
    read: f64,
    /// Pixels averaged into one.
    averaged: f64,
}

impl Noise {
    fn new(sensor: &Sensor, bin: usize) -> Self {
        Self {
            dn_per_electron: sensor.full_scale_dn / sensor.full_well_e,
            read: sensor.read_noise_e,
            averaged: (bin * bin) as f64,
        }
    }

    fn variance(&self, signal: f64) -> f64 {
        let electrons = signal / self.dn_per_electron + self.read * self.read;
        electrons * self.dn_per_electron * self.dn_per_electron / self.averaged
    }
}

impl Comparison {
    pub(super) fn new(
        description: &Description,
        entry: &ViewEntry,
        truth: &Truth,
        rendered: &RenderedView,
        bin: usize,
    ) -> anyhow::Result<Self> {
        let view = entry.view(bin)?;
        let factors = factors(description, truth, rendered, &view)?;
        let scale = |light: f32, factor: f32| light * factor * entry.dn_per_radiance as f32;
        let lit = |light: &Image<f32>| {
            let both = light.pixels().iter().zip(rendered.ambient.pixels());
            let pixels = both.zip(&factors).map(|((l, a), factor)| scale(l + a, *factor));
            Image::new(light.width(), light.height(), pixels.collect())
        };
        let dark = rendered.ambient.pixels().iter().zip(&factors);
        let dark = dark.map(|(a, factor)| scale(*a, *factor)).collect();
        let dark = Image::new(rendered.ambient.width(), rendered.ambient.height(), dark);
        let ours = rendered.lights.iter().map(lit).chain([dark]);
        let grouping = Grouping {
            truth,
            rendered,
            view,
            panels: description.panels()?,
            hemisphere: description.is_hemisphere(),
            factors: &factors,
            width: entry.size[0],
            bin,
        };
        Ok(Self {
            ours: ours.collect::<Result<_, _>>()?,
            truth: truth.images.iter().map(|image| binned(image, bin)).collect(),
            groups: (0..IMAGES).map(|image| grouping.of_image(image)).collect(),
            noise: Noise::new(&description.sensor, bin),
        })
    }

    /// By image: sums of directly lit, shadowed and room pixels.
    pub(super) fn scores(&self) -> Vec<[Sums; 3]> {
        (0..IMAGES).map(|image| self.sums(image)).collect()
    }

    fn sums(&self, image: usize) -> [Sums; 3] {
        let mut sums: [Sums; 3] = Default::default();
        let pixels = self.ours[image].pixels().iter().zip(self.truth[image].pixels());
        for ((&ours, &truth), group) in pixels.zip(&self.groups[image]) {
            if let Some(group) = group {
                let truth = f64::from(truth);
                sums[*group as usize].add(f64::from(ours), truth, self.noise.variance(truth));
            }
        }
        sums
    }
}

/// N x N pixels averaged into one.
fn binned(image: &Image<u16>, bin: usize) -> Image<f32> {
    Image::from_fn(image.width() / bin, image.height() / bin, |x, y| {
        let rows = (y * bin..(y + 1) * bin).map(|row| &image.row(row)[x * bin..(x + 1) * bin]);
        let sum: f32 = rows.flatten().map(|&dn| f32::from(dn)).sum();
        sum / (bin * bin) as f32
    })
}

/// How much more each pixel reflects than what was rendered. Prints are compared at full resolution only, where the
/// capture tells what a pixel covers.
fn factors(description: &Description, truth: &Truth, rendered: &RenderedView, view: &View) -> anyhow::Result<Vec<f32>> {
    let pixels = rendered.labels.pixels().len();
    match &truth.albedo {
        None => Ok(vec![1.0; pixels]),
        Some(albedo) if albedo.len() == pixels => {
            let prints = description.prints()?;
            Ok(prints::factors(rendered, view, prints, albedo))
        }
        Some(_) => {
            let factor = |&label: &u8| if label == 0 { 1.0 } else { f32::NAN };
            Ok(rendered.labels.pixels().iter().map(factor).collect())
        }
    }
}

/// Sorts pixels into groups.
struct Grouping<'a> {
    truth: &'a Truth,
    rendered: &'a RenderedView,
    view: View,
    panels: [Panel; 7],
    hemisphere: bool,
    factors: &'a [f32],
    /// Of the capture.
    width: usize,
    bin: usize,
}

impl Grouping<'_> {
    fn of_image(&self, image: usize) -> Vec<Option<Group>> {
        (0..self.factors.len()).map(|pixel| self.group(image, pixel)).collect()
    }

    /// The group of a pixel all of whose parts belong to it.
    fn group(&self, image: usize, pixel: usize) -> Option<Group> {
        if self.factors[pixel].is_nan() {
            return None;
        }
        let columns = self.width / self.bin;
        let (x, y) = (pixel % columns * self.bin, pixel / columns * self.bin);
        let parts = (0..self.bin * self.bin).map(|i| (y + i / self.bin) * self.width + x + i % self.bin);
        let mut groups = parts.map(|part| self.part(image, pixel, part));
        let first = groups.next()??;
        groups.all(|group| group == Some(first)).then_some(first)
    }

    fn part(&self, image: usize, pixel: usize, part: usize) -> Option<Group> {
        match self.truth.seen(part) {
            Seen::Room => Some(Group::Room),
            Seen::Support => None,
            // The ambient light reaches everything.
            Seen::Object if image == IMAGES - 1 => Some(Group::DirectLit),
            Seen::Object => {
                let reached = self.truth.reaches(image, part);
                let reached = reached.or_else(|| self.hemisphere.then(|| self.faces(image, pixel)).flatten())?;
                Some(if reached { Group::DirectLit } else { Group::Shadowed })
            }
        }
    }

    /// Whether a surface that hides nothing of itself faces a panel's middle.
    fn faces(&self, panel: usize, pixel: usize) -> Option<bool> {
        let columns = self.rendered.depth.width();
        let at = Point2::new((pixel % columns) as f64, (pixel / columns) as f64);
        let depth = f64::from(self.rendered.depth.pixels()[pixel]);
        let in_camera = Point3::from(self.view.camera.unproject(&at).ok()? * depth);
        let point = self.view.base_from_camera.transform_point(&in_camera);
        let normal = Vector3::from(self.rendered.normals.pixels()[pixel].map(f64::from));
        Some(normal.dot(&(self.panels[panel].centre - point)) > 0.0)
    }
}
