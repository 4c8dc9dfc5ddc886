//! GenICam features, with refusals that say what would have been right.

use aravis::glib;
use aravis::prelude::*;
use aravis::{Camera, DeviceError};
use devices::CameraError;

/// How far a float may lie outside its range by rounding alone.
const ROUNDING: f64 = 1e-9;

/// The features of one camera.
#[derive(Clone, Copy)]
pub(super) struct Features<'a> {
    pub(super) guid: &'a str,
    pub(super) camera: &'a Camera,
}

impl Features<'_> {
    /// Whether the camera has it, usable now.
    pub(super) fn has(&self, feature: &str) -> Result<bool, CameraError> {
        // Features that the description does not name are an error on some calls and a plain no on others.
        match self.camera.is_feature_available(feature) {
            Ok(there) => Ok(there),
            Err(error) if is_lost(&error) => Err(self.failed("looking for a feature", &error)),
            Err(_) => Ok(false),
        }
    }

    pub(super) fn set_float(&self, feature: &str, value: f64) -> Result<(), CameraError> {
        self.require(feature, &value)?;
        if let Ok((least, most)) = self.camera.float_bounds(feature) {
            let slack = ROUNDING * value.abs().max(1.0);
            // Negated, so that NaN is refused too.
            if !(value >= least - slack && value <= most + slack) {
                return Err(self.refused(feature, &value, range(&least, &most)));
            }
        }
        self.camera
            .set_float(feature, value)
            .map_err(|error| self.refusal(feature, &value, &error))
    }

    pub(super) fn float(&self, feature: &str) -> Result<f64, CameraError> {
        self.camera
            .float(feature)
            .map_err(|error| self.failed("reading a feature", &error))
    }

    pub(super) fn set_integer(&self, feature: &str, value: i64) -> Result<(), CameraError> {
        self.require(feature, &value)?;
        if let Ok((least, most)) = self.camera.integer_bounds(feature) {
            let step = self.camera.integer_increment(feature).unwrap_or(1).max(1);
            if value < least || value > most || (value - least) % step != 0 {
                let steps = if step > 1 {
                    format!(" in steps of {step}")
                } else {
                    String::new()
                };
                return Err(self.refused(feature, &value, range(&least, &most) + &steps));
            }
        }
        self.camera
            .set_integer(feature, value)
            .map_err(|error| self.refusal(feature, &value, &error))
    }

    pub(super) fn integer(&self, feature: &str) -> Result<i64, CameraError> {
        self.camera
            .integer(feature)
            .map_err(|error| self.failed("reading a feature", &error))
    }

    pub(super) fn most(&self, feature: &str) -> Result<i64, CameraError> {
        let (_, most) = self
            .camera
            .integer_bounds(feature)
            .map_err(|error| self.failed("reading a feature's range", &error))?;
        Ok(most)
    }

    pub(super) fn choose(&self, feature: &str, entry: &str) -> Result<(), CameraError> {
        self.require(feature, &entry)?;
        let entries = self.entries(feature);
        if !entries.is_empty() && !entries.iter().any(|known| known == entry) {
            return Err(self.refused(feature, &entry, format!("the camera knows {}", entries.join(", "))));
        }
        self.camera
            .set_string(feature, entry)
            .map_err(|error| self.refusal(feature, &entry, &error))
    }

    /// Chooses an entry where the camera has the feature, and the entry.
    pub(super) fn choose_if_there(&self, feature: &str, entry: &str) -> Result<(), CameraError> {
        if self.has(feature)? && self.entries(feature).iter().any(|known| known == entry) {
            self.choose(feature, entry)?;
        }
        Ok(())
    }

    pub(super) fn entries(&self, feature: &str) -> Vec<String> {
        let entries = self.camera.dup_available_enumerations_as_strings(feature);
        entries.map_or_else(
            |_| Vec::new(),
            |entries| entries.iter().map(ToString::to_string).collect(),
        )
    }

    pub(super) fn switch_off_if_there(&self, feature: &str) -> Result<(), CameraError> {
        if !self.has(feature)? {
            return Ok(());
        }
        self.camera
            .set_boolean(feature, false)
            .map_err(|error| self.refusal(feature, &false, &error))
    }

    fn require(&self, feature: &str, value: &impl ToString) -> Result<(), CameraError> {
        if self.has(feature)? {
            return Ok(());
        }
        Err(self.refused(feature, value, "the camera has no such feature, or not now".into()))
    }

    pub(super) fn refused(&self, feature: &str, value: &impl ToString, reason: String) -> CameraError {
        CameraError::Setting {
            guid: self.guid.to_owned(),
            feature: feature.to_owned(),
            value: value.to_string(),
            reason,
        }
    }

    pub(super) fn refusal(&self, feature: &str, value: &impl ToString, error: &glib::Error) -> CameraError {
        if is_lost(error) {
            return self.failed("setting a feature", error);
        }
        self.refused(feature, value, error.message().to_owned())
    }

    pub(super) fn failed(&self, action: &'static str, error: &glib::Error) -> CameraError {
        let guid = self.guid.to_owned();
        let reason = error.message().to_owned();
        if is_lost(error) {
            return CameraError::Lost {
                guid,
                reason: format!("{action} failed: {reason}"),
            };
        }
        CameraError::Failed { guid, action, reason }
    }
}

fn range(least: &impl ToString, most: &impl ToString) -> String {
    format!("the camera allows {} to {}", least.to_string(), most.to_string())
}

/// Errors after which nothing more is to be expected of the camera.
fn is_lost(error: &glib::Error) -> bool {
    matches!(
        error.kind::<DeviceError>(),
        Some(
            DeviceError::Timeout
                | DeviceError::NotConnected
                | DeviceError::TransferError
                | DeviceError::NotController
                | DeviceError::ProtocolErrorAccessDenied
        )
    )
}
