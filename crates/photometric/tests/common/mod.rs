//! A Lambertian sphere, rendered with attached shadows.
#![allow(dead_code, reason = "each test file uses its part")]

pub(crate) mod ball;

use imaging::{ExposureStack, Image};
use photometric::DirectionalLight;

/// Raw value of the sensor's offset in every image.
pub(crate) const OFFSET: f32 = 200.0;

/// Normal of a sphere that fills a square image, seen along -z; none outside.
pub(crate) fn sphere_normal(x: usize, y: usize, size: usize) -> Option<[f32; 3]> {
    let radius = size as f32 / 2.0;
    let (x, y) = ((x as f32 + 0.5 - radius) / radius, (y as f32 + 0.5 - radius) / radius);
    let z2 = 1.0 - x * x - y * y;
    (z2 > 0.0).then(|| [x, -y, z2.sqrt()])
}

/// Cosine between a normal and a light, negative in attached shadow.
pub(crate) fn cosine(normal: [f32; 3], light: &DirectionalLight) -> f32 {
    let l = light.direction();
    normal[0] * l.x as f32 + normal[1] * l.y as f32 + normal[2] * l.z as f32
}

/// The sphere under each light; `scale` is the raw value of a white patch facing a light of intensity 1.
pub(crate) fn sphere_stack(lights: &[DirectionalLight], size: usize, scale: f32, saturation: u16) -> ExposureStack {
    let picture = |light: &DirectionalLight| {
        Image::from_fn(size, size, |x, y| {
            let lit = sphere_normal(x, y, size).map_or(0.0, |normal| cosine(normal, light).max(0.0));
            (OFFSET + lit * light.intensity() as f32 * scale)
                .round()
                .clamp(0.0, 65_535.0) as u16
        })
    };
    let channels: Vec<u8> = lights.iter().map(DirectionalLight::channel).collect();
    let images = lights.iter().map(|light| (light.channel(), picture(light)));
    let dark = (0, Image::filled(size, size, OFFSET as u16));
    ExposureStack::new(&channels, std::iter::once(dark).chain(images), saturation).unwrap()
}

/// Angle between two unit vectors, degrees; through the chord, which stays exact for small angles.
pub(crate) fn angle(a: [f32; 3], b: [f32; 3]) -> f64 {
    let chord: f64 = a.iter().zip(b).map(|(&p, q)| f64::from(p - q).powi(2)).sum();
    2.0 * (chord.sqrt() / 2.0).min(1.0).asin().to_degrees()
}

/// Seven lights like the rig's, brightest about 1.
pub(crate) fn lights() -> Vec<DirectionalLight> {
    let reference = [0.43, 0.0, 0.015];
    let nominal = photometric::nominal_panels().map(|panel| panel.directional_light(reference).unwrap());
    let strongest = nominal.iter().map(DirectionalLight::intensity).fold(0.0, f64::max);
    let scaled = |light: &DirectionalLight| {
        DirectionalLight::new(
            light.channel(),
            light.direction().into_inner().into(),
            light.intensity() / strongest,
        )
    };
    nominal.iter().map(|light| scaled(light).unwrap()).collect()
}
