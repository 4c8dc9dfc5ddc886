//! Flat objects: an outline and a height.

use std::f64::consts::{FRAC_PI_8, TAU};

use geometry::TriangleMesh;
use serde::Deserialize;

use super::check::{count, size, sizes};
use super::loft::{Loft, polygon, prism, rectangle, ring};
use crate::SimError;

/// A box with its sides along the axes, the middle of its bottom in the origin.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cuboid {
    /// Lengths along x, y and z; each kind of box has a default of its own.
    pub size: Option<[f64; 3]>,
}

impl Cuboid {
    pub(super) fn mesh(&self, default: [f64; 3]) -> Result<TriangleMesh, SimError> {
        let [x, y, z] = self.size.unwrap_or(default);
        sizes("size", &[x, y, z])?;
        Ok(prism(&rectangle(x, y), [0.0; 2], z))
    }
}

/// An upright cylinder around the origin; a disc is a low one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cylinder {
    /// Across; each kind of cylinder has a default of its own.
    pub diameter: Option<f64>,
    /// From bottom to top.
    pub height: Option<f64>,
    /// Flat faces around.
    pub segments: Option<u32>,
}

/// Enough for a disc to look round at 7 pixels a millimetre.
const ROUND_SEGMENTS: u32 = 240;

impl Cylinder {
    pub(super) fn mesh(&self, default_diameter: f64, default_height: f64) -> Result<TriangleMesh, SimError> {
        let diameter = self.diameter.unwrap_or(default_diameter);
        let height = self.height.unwrap_or(default_height);
        let segments = self.segments.unwrap_or(ROUND_SEGMENTS);
        size("diameter", diameter)?;
        size("height", height)?;
        count("segments", segments, 8..=2000)?;
        Ok(prism(&polygon(segments, diameter / 2.0, 0.0), [0.0; 2], height))
    }
}

/// A flat octagon.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Octagon1 {
    /// From one flat to the opposite one.
    pub width: f64,
    /// From bottom to top.
    pub height: f64,
}

impl Default for Octagon1 {
    fn default() -> Self {
        Self {
            width: 0.1,
            height: 0.014,
        }
    }
}

impl Octagon1 {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        size("width", self.width)?;
        size("height", self.height)?;
        Ok(prism(&octagon(self.width), [0.0; 2], self.height))
    }
}

/// Flats at right angles to the axes.
pub(super) fn octagon(width: f64) -> Vec<[f64; 2]> {
    polygon(8, width / 2.0 / FRAC_PI_8.cos(), FRAC_PI_8)
}

/// A flat star.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Star {
    /// Tips.
    pub points: u32,
    /// Across the circle of the tips.
    pub diameter: f64,
    /// Across the circle of the inner corners.
    pub inner_diameter: f64,
    /// From bottom to top.
    pub height: f64,
}

impl Default for Star {
    fn default() -> Self {
        Self {
            points: 5,
            diameter: 0.1,
            inner_diameter: 0.045,
            height: 0.02,
        }
    }
}

impl Star {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        count("points", self.points, 3..=60)?;
        sizes("diameter and inner_diameter", &[self.diameter, self.inner_diameter])?;
        size("height", self.height)?;
        smaller("inner_diameter", self.inner_diameter, "diameter", self.diameter)?;
        let tips = polygon(self.points, self.diameter / 2.0, 0.0);
        let half_step = TAU / f64::from(self.points) / 2.0;
        let corners = polygon(self.points, self.inner_diameter / 2.0, half_step);
        let outline: Vec<_> = tips
            .into_iter()
            .zip(corners)
            .flat_map(|(tip, corner)| [tip, corner])
            .collect();
        Ok(prism(&outline, [0.0; 2], self.height))
    }
}

/// A spur gear with straight flanks and a bore.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Gear {
    /// Teeth around.
    pub teeth: u32,
    /// Across the tips.
    pub diameter: f64,
    /// Across the roots.
    pub root_diameter: f64,
    /// Across the hole.
    pub bore: f64,
    /// From bottom to top.
    pub height: f64,
}

impl Default for Gear {
    fn default() -> Self {
        Self {
            teeth: 14,
            diameter: 0.08,
            root_diameter: 0.064,
            bore: 0.016,
            height: 0.015,
        }
    }
}

/// Where a tooth's four corners are, as shares of the pitch, and whether they lie at the tip.
const TOOTH: [(f64, bool); 4] = [(-0.28, false), (-0.14, true), (0.14, true), (0.28, false)];

impl Gear {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        count("teeth", self.teeth, 4..=120)?;
        sizes("diameter and root_diameter", &[self.diameter, self.root_diameter])?;
        sizes("bore and height", &[self.bore, self.height])?;
        smaller("root_diameter", self.root_diameter, "diameter", self.diameter)?;
        // The outline's chords come closer to the middle than its corners do.
        smaller("bore", self.bore, "half of root_diameter", self.root_diameter / 2.0)?;
        let angle = |tooth: u32, share: f64| (f64::from(tooth) + share) * TAU / f64::from(self.teeth);
        let corners = || (0..self.teeth).flat_map(|tooth| TOOTH.map(|(share, tip)| (angle(tooth, share), tip)));
        let at = |diameter: f64, angle: f64| [diameter / 2.0 * angle.cos(), diameter / 2.0 * angle.sin()];
        let outer: Vec<_> = corners()
            .map(|(angle, tip)| at(if tip { self.diameter } else { self.root_diameter }, angle))
            .collect();
        let inner: Vec<_> = corners().map(|(angle, _)| at(self.bore, angle)).collect();
        Ok(Loft::around_a_hole(&[
            ring(&outer, 0.0),
            ring(&outer, self.height),
            ring(&inner, self.height),
            ring(&inner, 0.0),
        ]))
    }
}

/// Two bars that cross at right angles.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Cross {
    /// Of a bar.
    pub length: f64,
    /// Of a bar.
    pub width: f64,
    /// From bottom to top.
    pub height: f64,
}

impl Default for Cross {
    fn default() -> Self {
        Self {
            length: 0.1,
            width: 0.03,
            height: 0.02,
        }
    }
}

impl Cross {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("length, width and height", &[self.length, self.width, self.height])?;
        smaller("width", self.width, "length", self.length)?;
        let (l, w) = (self.length / 2.0, self.width / 2.0);
        let quarter = [[l, -w], [l, w], [w, w]];
        let outline: Vec<_> = (0..4_u32)
            .flat_map(|turn| quarter.map(|corner| turned(corner, turn)))
            .collect();
        Ok(prism(&outline, [0.0; 2], self.height))
    }
}

/// By quarters, counter-clockwise.
fn turned([x, y]: [f64; 2], quarters: u32) -> [f64; 2] {
    (0..quarters).fold([x, y], |[x, y], _| [-y, x])
}

/// An L: two bars at right angles, the middle of the square around it in the origin.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bracket {
    /// Of each bar, outside.
    pub length: f64,
    /// Of a bar.
    pub width: f64,
    /// From bottom to top.
    pub height: f64,
}

impl Default for Bracket {
    fn default() -> Self {
        Self {
            length: 0.08,
            width: 0.025,
            height: 0.025,
        }
    }
}

impl Bracket {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("length, width and height", &[self.length, self.width, self.height])?;
        smaller("width", self.width, "length", self.length)?;
        let (l, w) = (self.length / 2.0, self.width);
        let outline = [[-l, -l], [l, -l], [l, w - l], [w - l, w - l], [w - l, l], [-l, l]];
        let kernel = [w / 2.0 - l; 2];
        Ok(prism(&outline, kernel, self.height))
    }
}

fn smaller(place: &str, value: f64, other: &str, limit: f64) -> Result<(), SimError> {
    if value < limit {
        return Ok(());
    }
    Err(SimError::value(
        place,
        format!("{value} m"),
        format!("less than {other}, which is {limit} m"),
    ))
}
