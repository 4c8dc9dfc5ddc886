//! The order in which a camera is set up, and what it made of it.

use std::time::Duration;

use devices::{AppliedSettings, Binning, CameraError, CameraSettings, Region, TriggerMode};

use super::features::Features;

/// All images are linear, sixteen bits, grey.
const PIXEL_FORMAT: &str = "Mono16";
const MICROS: f64 = 1e6;

impl Features<'_> {
    /// Sets everything. The acquisition does not run.
    pub(super) fn apply(&self, settings: &CameraSettings, line: &str) -> Result<AppliedSettings, CameraError> {
        self.choose("PixelFormat", PIXEL_FORMAT)?;
        self.apply_geometry(settings)?;
        self.switch_automatics_off()?;
        self.apply_exposure(settings)?;
        self.apply_trigger(settings.trigger, line)?;
        self.read_back(settings)
    }

    fn apply_geometry(&self, settings: &CameraSettings) -> Result<(), CameraError> {
        // From the corner every size is possible.
        for offset in ["OffsetX", "OffsetY"] {
            if self.has(offset)? {
                self.set_integer(offset, 0)?;
            }
        }
        let Binning { horizontal, vertical } = settings.binning;
        for (feature, factor) in [("BinningHorizontal", horizontal), ("BinningVertical", vertical)] {
            if factor != 1 || self.has(feature)? {
                self.set_integer(feature, i64::from(factor))?;
            }
        }
        let Some(region) = settings.region else {
            self.set_integer("Width", self.most("Width")?)?;
            return self.set_integer("Height", self.most("Height")?);
        };
        self.set_integer("Width", i64::from(region.width))?;
        self.set_integer("Height", i64::from(region.height))?;
        for (feature, start) in [("OffsetX", region.x), ("OffsetY", region.y)] {
            if start != 0 || self.has(feature)? {
                self.set_integer(feature, i64::from(start))?;
            }
        }
        Ok(())
    }

    fn switch_automatics_off(&self) -> Result<(), CameraError> {
        for feature in ["ExposureAuto", "GainAuto", "BlackLevelAuto"] {
            if self.has(feature)? {
                self.choose(feature, "Off")?;
            }
        }
        self.switch_off_if_there("GammaEnable")?;
        // Where gamma cannot be switched off, 1 is off.
        if !self.has("GammaEnable")? && self.has("Gamma")? {
            self.set_float("Gamma", 1.0)?;
        }
        self.choose_if_there("ExposureMode", "Timed")
    }

    fn apply_exposure(&self, settings: &CameraSettings) -> Result<(), CameraError> {
        self.set_float("ExposureTime", settings.exposure.as_secs_f64() * MICROS)?;
        for (feature, value) in [("Gain", settings.gain_db), ("BlackLevel", settings.black_level)] {
            // A camera that cannot amplify, or add, does what 0 asks for.
            if value != 0.0 || self.has(feature)? {
                self.set_float(feature, value)?;
            }
        }
        Ok(())
    }

    fn apply_trigger(&self, trigger: TriggerMode, line: &str) -> Result<(), CameraError> {
        self.choose("AcquisitionMode", "Continuous")?;
        for other in self.entries("TriggerSelector") {
            if other != "FrameStart" {
                self.choose("TriggerSelector", &other)?;
                self.choose_if_there("TriggerMode", "Off")?;
            }
        }
        if self.has("TriggerSelector")? {
            self.choose("TriggerSelector", "FrameStart")?;
        }
        match trigger {
            TriggerMode::Software => self.choose("TriggerSource", "Software")?,
            TriggerMode::Line => {
                self.choose("TriggerSource", line)?;
                self.choose_if_there("TriggerActivation", "RisingEdge")?;
            }
        }
        self.choose("TriggerMode", "On")
    }

    fn read_back(&self, settings: &CameraSettings) -> Result<AppliedSettings, CameraError> {
        let (width, height) = (self.side("Width")?, self.side("Height")?);
        let micros = self.float("ExposureTime")?;
        let region = match settings.region {
            Some(_) => Some(Region {
                x: self.start("OffsetX")?,
                y: self.start("OffsetY")?,
                width,
                height,
            }),
            None => None,
        };
        Ok(AppliedSettings {
            settings: CameraSettings {
                region,
                exposure: Duration::try_from_secs_f64(micros / MICROS).unwrap_or(settings.exposure),
                gain_db: self.float_or_zero("Gain")?,
                black_level: self.float_or_zero("BlackLevel")?,
                ..*settings
            },
            width,
            height,
        })
    }

    fn side(&self, feature: &str) -> Result<u32, CameraError> {
        let value = self.integer(feature)?;
        u32::try_from(value)
            .ok()
            .filter(|side| (1..=65536).contains(side))
            .ok_or_else(|| self.refused(feature, &value, "the camera says so; a frame has 1 to 65536".into()))
    }

    fn start(&self, feature: &str) -> Result<u32, CameraError> {
        if !self.has(feature)? {
            return Ok(0);
        }
        let value = self.integer(feature)?;
        u32::try_from(value).map_err(|_| self.refused(feature, &value, "the camera says so; it cannot be".into()))
    }

    fn float_or_zero(&self, feature: &str) -> Result<f64, CameraError> {
        if self.has(feature)? {
            self.float(feature)
        } else {
            Ok(0.0)
        }
    }
}
