//! What can go wrong outside a camera's own life, by cause. Inside it, see [`devices::CameraError`].

use std::net::SocketAddr;
use std::path::PathBuf;

/// Why a configuration, a calibration file or a search for cameras was refused, with what was found and what is allowed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CameraAravisError {
    /// A configured value is out of its range.
    #[error("{field} = {value} is not allowed; allowed: {allowed}")]
    Config {
        /// Name of the field.
        field: &'static str,
        /// As given.
        value: String,
        /// In words.
        allowed: String,
    },
    /// A calibration file is named in a way that is not understood.
    #[error("calibration file {url:?}: {reason}; allowed: the plain path of a YAML file")]
    Url {
        /// As given.
        url: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A file cannot be read or written.
    #[error("{}: cannot {action}: {source}", path.display())]
    File {
        /// Where.
        path: PathBuf,
        /// "read it" or "write it".
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A calibration file is no YAML, or lacks a key, or a value has another type.
    #[error("{}: {reason}", path.display())]
    Yaml {
        /// Where.
        path: PathBuf,
        /// With line and column as far as they are known.
        reason: String,
    },
    /// A value in a calibration file makes no camera.
    #[error("{}: {key} is {found}; allowed: {allowed}", path.display())]
    Calibration {
        /// Where.
        path: PathBuf,
        /// Key in the file.
        key: &'static str,
        /// Value found.
        found: String,
        /// In words.
        allowed: String,
    },
    /// A binning or a region does not fit the calibrated image.
    #[error("{what} does not fit the calibrated image of {width} x {height} pixels")]
    DoesNotFit {
        /// What was asked for.
        what: String,
        /// Calibrated columns, after binning where a region is meant.
        width: u32,
        /// Calibrated rows, after binning where a region is meant.
        height: u32,
    },
    /// The network cannot be used.
    #[error("{address}: cannot {action}: {source}")]
    Network {
        /// Address and port.
        address: SocketAddr,
        /// What was being done.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Nobody speaks GigE Vision there.
    #[error("no GigE Vision camera answers at {address} within {millis} ms")]
    Silent {
        /// Address and port.
        address: SocketAddr,
        /// Time waited.
        millis: u128,
    },
    /// Somebody answers there, but not as a GigE Vision camera does.
    #[error("{address} answers, but not as a GigE Vision camera: {reason}")]
    Answer {
        /// Address and port.
        address: SocketAddr,
        /// What came.
        reason: String,
    },
    /// No camera on the network has this name.
    #[error("no camera is called {guid:?}; cameras that answer: {}", if seen.is_empty() { "none".into() } else { seen.join(", ") })]
    NoSuchCamera {
        /// As configured.
        guid: String,
        /// Serial numbers.
        seen: Vec<String>,
    },
    /// Another part of this program has taken Aravis' list of devices for itself.
    #[error("Aravis' list of devices belongs to another part of this program")]
    AravisTaken,
    /// The crate was built without its feature `aravis`.
    #[error("this program was built without Aravis: build it with the feature `aravis` of `camera_aravis`")]
    WithoutAravis,
}
