//! Objects that taper, curve or bend.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use geometry::TriangleMesh;
use geometry::nalgebra::Point3;
use serde::Deserialize;

use super::check::{count, size, sizes};
use super::loft::{Loft, polygon, rectangle, ring};
use super::prisms::octagon;
use crate::SimError;

/// A pyramid with four sides.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pyramid {
    /// Of the square on the table.
    pub side: f64,
    /// Of the tip.
    pub height: f64,
}

impl Default for Pyramid {
    fn default() -> Self {
        Self {
            side: 0.1,
            height: 0.055,
        }
    }
}

impl Pyramid {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("side and height", &[self.side, self.height])?;
        let square = ring(&rectangle(self.side, self.side), 0.0);
        Ok(Loft::capped(
            &[square],
            Point3::origin(),
            Point3::new(0.0, 0.0, self.height),
        ))
    }
}

/// A stepped octagon: a rim, a slope, a level step, a steeper slope, a level top.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Octagon2 {
    /// From one flat of the bottom to the opposite one.
    pub width: f64,
    /// Of the top.
    pub height: f64,
}

impl Default for Octagon2 {
    fn default() -> Self {
        Self {
            width: 0.1,
            height: 0.029,
        }
    }
}

/// From the bottom up: share of the width, millimetres of height of 29.
const OCTAGON_PROFILE: [(f64, f64); 5] = [(1.0, 0.0), (1.0, 2.0), (0.76, 14.0), (0.58, 14.0), (0.34, 29.0)];

impl Octagon2 {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("width and height", &[self.width, self.height])?;
        let rings =
            OCTAGON_PROFILE.map(|(share, height)| ring(&octagon(self.width * share), self.height * height / 29.0));
        Ok(Loft::capped(
            &rings,
            Point3::origin(),
            Point3::new(0.0, 0.0, self.height),
        ))
    }
}

/// A block whose top falls along x.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wedge {
    /// Along x and y.
    pub size: [f64; 2],
    /// At least x.
    pub high: f64,
    /// At most x.
    pub low: f64,
}

impl Default for Wedge {
    /// Falls by 45 degrees.
    fn default() -> Self {
        Self {
            size: [0.070_71, 0.1],
            high: 0.071_71,
            low: 0.001,
        }
    }
}

impl Wedge {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        let [x, y] = self.size;
        sizes("size", &self.size)?;
        sizes("high and low", &[self.high, self.low])?;
        let bottom = ring(&rectangle(x, y), 0.0);
        let mut top = bottom.clone();
        for corner in &mut top {
            corner.z = if corner.x < 0.0 { self.high } else { self.low };
        }
        let middle = Point3::new(0.0, 0.0, f64::midpoint(self.high, self.low));
        Ok(Loft::capped(&[bottom, top], Point3::origin(), middle))
    }
}

/// A ball, or its upper half, that touches z = 0.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ball {
    /// Each kind has a default of its own.
    pub radius: Option<f64>,
    /// Flat faces around the equator.
    pub segments: Option<u32>,
}

/// Small enough facets for the shading to look smooth.
const BALL_SEGMENTS: u32 = 160;

impl Ball {
    pub(super) fn sphere(&self) -> Result<TriangleMesh, SimError> {
        let (radius, segments) = self.checked(0.03)?;
        let levels = segments / 2;
        let rings: Vec<_> = (1..levels)
            .map(|level| {
                latitude(
                    radius,
                    segments,
                    f64::from(level) * PI / f64::from(levels) - FRAC_PI_2,
                    radius,
                )
            })
            .collect();
        Ok(Loft::capped(
            &rings,
            Point3::origin(),
            Point3::new(0.0, 0.0, 2.0 * radius),
        ))
    }

    pub(super) fn hemisphere(&self) -> Result<TriangleMesh, SimError> {
        let (radius, segments) = self.checked(0.04)?;
        let levels = segments / 4;
        let rings: Vec<_> = (0..levels)
            .map(|level| latitude(radius, segments, f64::from(level) * FRAC_PI_2 / f64::from(levels), 0.0))
            .collect();
        Ok(Loft::capped(&rings, Point3::origin(), Point3::new(0.0, 0.0, radius)))
    }

    fn checked(&self, default_radius: f64) -> Result<(f64, u32), SimError> {
        let (radius, segments) = (
            self.radius.unwrap_or(default_radius),
            self.segments.unwrap_or(BALL_SEGMENTS),
        );
        size("radius", radius)?;
        count("segments", segments, 8..=2000)?;
        Ok((radius, segments))
    }
}

fn latitude(radius: f64, segments: u32, angle: f64, centre_height: f64) -> Vec<Point3<f64>> {
    ring(
        &polygon(segments, radius * angle.cos(), 0.0),
        centre_height + radius * angle.sin(),
    )
}

/// A round bar bent into an arc that lies on the table, the middle of the arc in the origin.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BentCylinder {
    /// Of the bar.
    pub diameter: f64,
    /// Of the bar's axis.
    pub bend_radius: f64,
    /// Of the arc, radians.
    pub angle: f64,
    /// Flat faces around the bar.
    pub segments: u32,
}

impl Default for BentCylinder {
    fn default() -> Self {
        Self {
            diameter: 0.03,
            bend_radius: 0.06,
            angle: 1.8,
            segments: 96,
        }
    }
}

impl BentCylinder {
    pub(super) fn mesh(&self) -> Result<TriangleMesh, SimError> {
        sizes("diameter and bend_radius", &[self.diameter, self.bend_radius])?;
        count("segments", self.segments, 8..=2000)?;
        let (thin, thick) = (self.diameter / 2.0, self.bend_radius);
        if thin >= thick {
            let allowed = format!("less than twice bend_radius, which is {thick} m");
            return Err(SimError::value("diameter", format!("{} m", self.diameter), allowed));
        }
        if !(self.angle > 0.0 && self.angle < TAU) {
            return Err(SimError::value(
                "angle",
                format!("{} rad", self.angle),
                "more than 0 and less than 2 pi",
            ));
        }
        // Facets along the bar as long as they are wide around it.
        let steps = ((self.angle * thick * f64::from(self.segments)) / (PI * self.diameter)).ceil();
        let steps = steps.clamp(4.0, 4000.0) as u32;
        let section = polygon(self.segments, thin, 0.0);
        let at = |angle: f64, outwards: f64, up: f64| {
            let distance = thick + outwards;
            Point3::new(distance * angle.cos() - thick, distance * angle.sin(), thin + up)
        };
        // Along the arc, the section's x points inwards, so that it runs counter-clockwise seen from the arc's end.
        let angle = |step: u32| self.angle * (f64::from(step) / f64::from(steps) - 0.5);
        let rings: Vec<Vec<_>> = (0..=steps)
            .map(|step| section.iter().map(|[x, y]| at(angle(step), -x, *y)).collect())
            .collect();
        Ok(Loft::capped(&rings, at(angle(0), 0.0, 0.0), at(angle(steps), 0.0, 0.0)))
    }
}
