//! The camera's own clock.

use std::time::Duration;

use aravis::Device;
use aravis::glib;
use aravis::prelude::*;
use gige_vision::bootstrap as at;

/// In [`at::TIMESTAMP_CONTROL`].
const LATCH: u32 = 2;
const NANOS: u128 = 1_000_000_000;

/// Reads the clock that the frames' stamps are from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    ticks_per_second: u64,
}

impl Clock {
    /// None when the camera has no clock.
    pub(super) fn of(device: &Device) -> Result<Option<Self>, glib::Error> {
        let ticks_per_second = read_wide(device, at::TICK_FREQUENCY)?;
        Ok((ticks_per_second > 0).then_some(Self { ticks_per_second }))
    }

    /// Now, since the clock's zero.
    pub(super) fn now(self, device: &Device) -> Result<Duration, glib::Error> {
        device.write_register(u64::from(at::TIMESTAMP_CONTROL), LATCH)?;
        let ticks = read_wide(device, at::TIMESTAMP_VALUE)?;
        // The rounding of Aravis, so that equal ticks give equal times.
        let nanos = u128::from(ticks) * NANOS / u128::from(self.ticks_per_second);
        Ok(Duration::from_nanos(nanos as u64))
    }
}

fn read_wide(device: &Device, address: u32) -> Result<u64, glib::Error> {
    let (_, high) = device.read_register(u64::from(address))?;
    let (_, low) = device.read_register(u64::from(address) + 4)?;
    Ok(u64::from(high) << 32 | u64::from(low))
}
