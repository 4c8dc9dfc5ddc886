//! Squares of pixels in which light is computed at few pixels and interpolated between them.
//!
//! Where all of a square lies in one plane, that is the light itself. On a bent surface it is how much of each panel is
//! seen: how the surface stands to the panels is known exactly everywhere.

use super::direct::{Shares, UNKNOWN};
use super::primary::{Primary, Surrounding};
use super::shade::{BENT_RAYS, CHANNELS, DARK, EDGE_RAYS, Light, Shader};
use super::stage::Place;

/// Side of the largest block that is interpolated, pixels.
pub(super) const BLOCK: usize = 16;
/// Light may differ by this share of the brightest panel's from what interpolation says, where surfaces are bright and
/// where they are so dark that the sensor's noise hides more than that.
const TOLERANCE: f64 = 0.02;
const DARK_TOLERANCE: f64 = 0.05;
/// On bent surfaces, how much the visible share of a panel may differ from what interpolation says.
const SHARE_TOLERANCE: f64 = 0.03;
/// A square of pixels; on its way it remembers what was computed.
pub(super) struct Block<'a> {
    shader: &'a Shader<'a>,
    left: usize,
    top: usize,
    lights: Vec<Option<Light>>,
    shares: Vec<Option<Shares>>,
}

/// A square part of a block, in pixels from the block's corner.
#[derive(Debug, Clone, Copy)]
struct Part {
    x: usize,
    y: usize,
    side: usize,
}

impl Part {
    /// Its corners, and its middle.
    fn spots(self) -> [(usize, usize); 5] {
        let Self { x, y, side } = self;
        let far = side - 1;
        [
            (x, y),
            (x + far, y),
            (x, y + far),
            (x + far, y + far),
            (x + side / 2, y + side / 2),
        ]
    }

    /// Its pixels, each with its place between the corners.
    fn pixels(self) -> impl Iterator<Item = ((usize, usize), [f64; 2])> {
        let Self { x, y, side } = self;
        let share = move |at: usize| at as f64 / (side - 1) as f64;
        (0..side * side).map(move |i| {
            let (right, down) = (i % side, i / side);
            ((x + right, y + down), [share(right), share(down)])
        })
    }

    /// Where the spot in the middle is between the corners.
    fn middle(self) -> [f64; 2] {
        [(self.side / 2) as f64 / (self.side - 1) as f64; 2]
    }

    fn quarters(self) -> [Self; 4] {
        let side = self.side / 2;
        [(0, 0), (side, 0), (0, side), (side, side)].map(|(right, down)| Self {
            x: self.x + right,
            y: self.y + down,
            side,
        })
    }
}

impl<'a> Block<'a> {
    pub(super) fn new(shader: &'a Shader<'a>, left: usize, top: usize) -> Self {
        Self {
            shader,
            left,
            top,
            lights: vec![None; BLOCK * BLOCK],
            shares: vec![None; BLOCK * BLOCK],
        }
    }

    /// Shades its pixels; `rows` are the image's rows from the block's top.
    pub(super) fn shade(&mut self, rows: &mut [[f32; CHANNELS]]) {
        let whole = Part {
            x: 0,
            y: 0,
            side: BLOCK,
        };
        self.part(whole, rows);
    }

    fn part(&mut self, part: Part, rows: &mut [[f32; CHANNELS]]) {
        let primary = self.shader.primary;
        if self.left + part.x >= primary.width || self.top + part.y >= primary.height {
            return;
        }
        if part.side == 1 {
            let light = self.pixel(part.x, part.y);
            self.put(part.x, part.y, &light, rows);
            return;
        }
        let done = part.side > 2
            && match self.kind(part) {
                Kind::Flat => self.interpolate_light(part, rows),
                Kind::Bent => self.interpolate_shares(part, rows),
                Kind::Mixed => false,
            };
        if !done {
            for quarter in part.quarters() {
                self.part(quarter, rows);
            }
        }
    }

    fn put(&self, x: usize, y: usize, light: &Light, rows: &mut [[f32; CHANNELS]]) {
        rows[y * self.shader.primary.width + self.left + x] = light.map(|value| value as f32);
    }

    fn place(&self, (x, y): (usize, usize)) -> Option<Place> {
        self.shader.primary.place(self.left + x, self.top + y)
    }

    /// Light of one pixel by itself.
    fn pixel(&mut self, x: usize, y: usize) -> Light {
        let (column, row) = (self.left + x, self.top + y);
        let shader = self.shader;
        match (shader.primary.surrounding(column, row), self.place((x, y))) {
            (Surrounding::Flat, Some(place)) => {
                let irradiance = self.light((x, y), &place);
                shader.reflected(&place, shader.albedo(column, row, &place), &irradiance)
            }
            (Surrounding::Flat, None) => shader.nothing(),
            (Surrounding::Bent, _) => shader.mixed(column, row, BENT_RAYS, &UNKNOWN),
            (Surrounding::Edge, _) => shader.mixed(column, row, EDGE_RAYS, &UNKNOWN),
        }
    }

    fn light(&mut self, (x, y): (usize, usize), place: &Place) -> Light {
        let shader = self.shader;
        let (column, row) = (self.left + x, self.top + y);
        *self.lights[y * BLOCK + x].get_or_insert_with(|| shader.irradiance_at(column, row, place))
    }

    fn shares(&mut self, (x, y): (usize, usize), place: &Place) -> Shares {
        let shader = self.shader;
        *self.shares[y * BLOCK + x].get_or_insert_with(|| shader.shares_at(place))
    }

    /// What is seen in a part; one that leaves the image is mixed.
    fn kind(&self, part: Part) -> Kind {
        let primary = self.shader.primary;
        let (left, top, side) = (self.left + part.x, self.top + part.y, part.side);
        if left + side > primary.width || top + side > primary.height {
            return Kind::Mixed;
        }
        let pixels = (0..side * side).map(|i| (left + i % side, top + i / side));
        Kind::of(primary, left, top, pixels)
    }

    /// Shades a flat part from its corners unless its middle shows that there is more to see.
    fn interpolate_light(&mut self, part: Part, rows: &mut [[f32; CHANNELS]]) -> bool {
        let mut lights = [[0.0; CHANNELS]; 5];
        let mut albedo = 0.0;
        for (light, spot) in lights.iter_mut().zip(part.spots()) {
            let Some(place) = self.place(spot) else { return false };
            albedo = self.shader.primary.stage.albedo(&place);
            *light = self.light(spot, &place);
        }
        let [a, b, c, d, middle] = lights;
        let corners = [a, b, c, d];
        let tolerance = if albedo < DARK { DARK_TOLERANCE } else { TOLERANCE };
        let brightest = corners.as_flattened().iter().fold(0.0, |a: f64, &b| a.max(b));
        if !agree(&between(&corners, part.middle()), &middle, tolerance * brightest) {
            return false;
        }
        for (pixel, at) in part.pixels() {
            let Some(place) = self.place(pixel) else { return false };
            let (column, row) = (self.left + pixel.0, self.top + pixel.1);
            let albedo = self.shader.albedo(column, row, &place);
            let light = self.shader.reflected(&place, albedo, &between(&corners, at));
            self.put(pixel.0, pixel.1, &light, rows);
        }
        true
    }

    /// Shades a bent part with what its corners see of the panels, unless its middle sees something else.
    fn interpolate_shares(&mut self, part: Part, rows: &mut [[f32; CHANNELS]]) -> bool {
        let mut shares = [UNKNOWN; 5];
        for (share, spot) in shares.iter_mut().zip(part.spots()) {
            let Some(place) = self.place(spot) else { return false };
            *share = self.shares(spot, &place);
        }
        fill_in(&mut shares);
        let [a, b, c, d, middle] = shares;
        let corners = [a, b, c, d];
        if !agree(&between(&corners, part.middle()), &middle, SHARE_TOLERANCE) {
            return false;
        }
        for ((x, y), at) in part.pixels() {
            let shares = between(&corners, at);
            let light = self.shader.mixed(self.left + x, self.top + y, BENT_RAYS, &shares);
            self.put(x, y, &light, rows);
        }
        true
    }
}

/// What is seen in a part of a block.
enum Kind {
    /// One plane.
    Flat,
    /// One body without an edge.
    Bent,
    /// More than that.
    Mixed,
}

impl Kind {
    fn of(primary: &Primary<'_>, left: usize, top: usize, mut pixels: impl Iterator<Item = (usize, usize)>) -> Self {
        let (plane, body) = (primary.plane(left, top), primary.body(left, top));
        let mut flat = true;
        let smooth = pixels.all(|(x, y)| {
            let surrounding = primary.surrounding(x, y);
            flat &= surrounding == Surrounding::Flat && primary.plane(x, y) == plane;
            flat || (surrounding != Surrounding::Edge && body.is_some() && primary.body(x, y) == body)
        });
        match (flat, smooth) {
            (true, _) => Self::Flat,
            (_, true) => Self::Bent,
            _ => Self::Mixed,
        }
    }
}

/// Where a spot turns away from a panel, what the others see of it stands for it.
fn fill_in(shares: &mut [Shares; 5]) {
    for panel in 0..UNKNOWN.len() {
        let known: Vec<f64> = shares
            .iter()
            .map(|s| s[panel])
            .filter(|share| !share.is_nan())
            .collect();
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        for share in shares.iter_mut().filter(|share| share[panel].is_nan()) {
            share[panel] = mean;
        }
    }
}

/// Bilinear interpolation between corners.
fn between<const N: usize>([a, b, c, d]: &[[f64; N]; 4], [right, down]: [f64; 2]) -> [f64; N] {
    std::array::from_fn(|channel| {
        let upper = a[channel] + (b[channel] - a[channel]) * right;
        let lower = c[channel] + (d[channel] - c[channel]) * right;
        upper + (lower - upper) * down
    })
}

/// Whether what is found is what was expected; what nobody knows is.
fn agree<const N: usize>(expected: &[f64; N], found: &[f64; N], tolerance: f64) -> bool {
    let mut pairs = expected.iter().zip(found);
    pairs.all(|(expected, found)| found.is_nan() || (expected - found).abs() <= tolerance)
}
