//! Why bytes were not understood.

/// What is wrong, where, what was found and what is allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProtocolError {
    /// A frame that says it is longer or shorter than any frame is. The stream cannot be read on.
    #[error("a frame of {found} bytes after its header, allowed are 1 to {most}")]
    FrameLength {
        /// As the header says.
        found: usize,
        /// Largest length allowed.
        most: usize,
    },
    /// A reply, request or feedback with too few or too many bytes.
    #[error("{what}: {found} bytes, expected {expected}")]
    Length {
        /// Which part of which message.
        what: &'static str,
        /// Bytes found.
        found: usize,
        /// In words.
        expected: &'static str,
    },
    /// A byte that has no meaning where it stands.
    #[error("{what} is {found}, allowed: {allowed}")]
    Value {
        /// Which field.
        what: &'static str,
        /// As found.
        found: u32,
        /// In words.
        allowed: &'static str,
    },
    /// A report whose length is none of those that controllers send.
    #[error("a {kind} report of {found} bytes; known are {known}")]
    ReportLength {
        /// Real, normal or rich.
        kind: &'static str,
        /// As its header says.
        found: usize,
        /// In words.
        known: String,
    },
    /// A version that is none.
    #[error("the firmware version is `{found}`, expected one such as `v2.5.5`")]
    Version {
        /// As found.
        found: String,
    },
    /// A version that nobody has tried.
    #[error("firmware {found} is not known; supported are {oldest} up to, but not, {end}")]
    UnsupportedFirmware {
        /// As found.
        found: String,
        /// First that is supported.
        oldest: String,
        /// First that is not.
        end: String,
    },
    /// The text that the controller tells about itself.
    #[error("the controller's identity is `{found}`, expected `axes,type,arm serial,box serial,version`")]
    Identity {
        /// As found.
        found: String,
    },
}
