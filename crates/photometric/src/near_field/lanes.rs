//! Numbers of all panels side by side, so that one instruction works on several.

use glam::Vec3;
use wide::f32x8;

/// Panels that a solver of this module can take; one bit each.
pub(crate) const MAX_PANELS: usize = 8;

/// One number for each panel.
pub(crate) type Lanes = f32x8;

/// One vector for each panel, base frame.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct VectorLanes {
    pub(crate) x: Lanes,
    pub(crate) y: Lanes,
    pub(crate) z: Lanes,
}

impl VectorLanes {
    pub(crate) fn set(&mut self, lane: usize, vector: Vec3) {
        self.x.as_mut_array()[lane] = vector.x;
        self.y.as_mut_array()[lane] = vector.y;
        self.z.as_mut_array()[lane] = vector.z;
    }

    pub(crate) fn get(&self, lane: usize) -> Vec3 {
        let of = |lanes: &Lanes| lanes.as_array()[lane];
        Vec3::new(of(&self.x), of(&self.y), of(&self.z))
    }

    /// Products with a vector.
    #[inline]
    pub(crate) fn dot(&self, vector: Vec3) -> Lanes {
        self.x * vector.x + self.y * vector.y + self.z * vector.z
    }

    /// Adds another's lanes times a factor.
    #[inline]
    pub(crate) fn add_scaled(&mut self, other: &Self, factor: f32) {
        self.x += other.x * factor;
        self.y += other.y * factor;
        self.z += other.z * factor;
    }
}
