//! How far a sample may be off by chance.

/// Shot and read noise of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorNoise {
    /// Electrons for one digital number.
    pub electrons_per_dn: f32,
    /// Standard deviation of reading a pixel, electrons.
    pub read_electrons: f32,
    /// Step of the converter, digital numbers.
    pub step_dn: f32,
}

impl SensorNoise {
    /// The rig's cameras: 10,500 electrons at 65,535, read noise 8, 12 bits in steps of 16.
    pub const RIG: Self = Self {
        electrons_per_dn: 10_500.0 / 65_535.0,
        read_electrons: 8.0,
        step_dn: 16.0,
    };

    /// Variance of a lit sample minus its dark sample, digital numbers squared: shot noise of both, read noise and the
    /// converter's step of both.
    pub fn difference_variance(&self, lit: f32, dark: f32) -> f32 {
        let read = self.read_electrons / self.electrons_per_dn;
        let shot = (lit.max(0.0) + dark.max(0.0)) / self.electrons_per_dn;
        shot + 2.0 * (read * read + self.step_dn * self.step_dn / 12.0)
    }
}
