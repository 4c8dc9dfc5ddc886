//! Why a transform is refused or not to be had.

use std::time::Duration;

use geometry::GeometryError;

/// Every failure of TF, by cause. Times are nanoseconds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TfError {
    /// Nobody ever published this frame.
    #[error("frame {frame:?} is unknown; known: {}", list(.known))]
    UnknownFrame {
        /// The frame.
        frame: String,
        /// Every known frame, sorted.
        known: Vec<String>,
    },
    /// Both frames exist, in trees that nothing joins.
    #[error(
        "frames {target:?} and {source_frame:?} are not connected: their roots are {target_root:?} and {source_root:?}"
    )]
    NotConnected {
        /// Where to.
        target: String,
        /// Where from.
        source_frame: String,
        /// The frame that `target` hangs on in the end.
        target_root: String,
        /// The frame that `source_frame` hangs on in the end.
        source_root: String,
    },
    /// A transform on the way is not known at that time.
    #[error(
        "no transform from {child:?} to {parent:?} at {} s: known from {} s to {} s",
        seconds(*.requested), seconds(*.oldest), seconds(*.newest)
    )]
    Extrapolation {
        /// The frame that is not known at that time.
        child: String,
        /// The frame that it hangs on.
        parent: String,
        /// The time that was asked for.
        requested: i64,
        /// First known time.
        oldest: i64,
        /// Last known time.
        newest: i64,
    },
    /// The frames on the way were never known at one and the same time.
    #[error(
        "no time in common: {late:?} is known from {} s, {early:?} until {} s",
        seconds(*.from), seconds(*.until)
    )]
    NoCommonTime {
        /// The frame that came too late.
        late: String,
        /// The first time it is known.
        from: i64,
        /// The frame that ended too early.
        early: String,
        /// The last time it is known.
        until: i64,
    },
    /// It did not come in time; the last failure says what is missing.
    #[error("waited {waited:?} in vain: {missing}")]
    TimedOut {
        /// How long.
        waited: Duration,
        /// What was missing to the end.
        #[source]
        missing: Box<TfError>,
    },
    /// A frame has no name.
    #[error("a transform from {child:?} to {parent:?} has a frame without a name")]
    Unnamed {
        /// The child as sent.
        child: String,
        /// The parent as sent.
        parent: String,
    },
    /// The frame would hang on itself.
    #[error("{child:?} on {parent:?} closes a circle: {}", .circle.join(" on "))]
    Cycle {
        /// The new child.
        child: String,
        /// Its new parent.
        parent: String,
        /// The circle, from the child back to it.
        circle: Vec<String>,
    },
    /// Two publishers disagree about what the frame hangs on.
    #[error("{child:?} hangs on {known:?} and cannot hang on {found:?} as well")]
    SecondParent {
        /// The frame.
        child: String,
        /// The parent it has.
        known: String,
        /// The parent it was given.
        found: String,
    },
    /// A frame is published on `/tf` and on `/tf_static`.
    #[error("{child:?} is static already and cannot move as well, or the other way round")]
    StaticAndMoving {
        /// The frame.
        child: String,
    },
    /// The transform is older than anything that is kept.
    #[error(
        "the transform of {child:?} at {} s is too old: {} s is the newest and {kept:?} are kept",
        seconds(*.stamp), seconds(*.newest)
    )]
    TooOld {
        /// The frame.
        child: String,
        /// Its time.
        stamp: i64,
        /// The newest time of the frame.
        newest: i64,
        /// How far back the buffer remembers.
        kept: Duration,
    },
    /// The numbers are no rigid transform.
    #[error("the transform from {child:?} to {parent:?} is not valid: {problem}")]
    Invalid {
        /// The child.
        child: String,
        /// The parent.
        parent: String,
        /// What is wrong with it.
        #[source]
        problem: Box<GeometryError>,
    },
}

fn list(frames: &[String]) -> String {
    if frames.is_empty() {
        "none".into()
    } else {
        frames.join(", ")
    }
}

/// Nanoseconds as exact seconds.
fn seconds(nanos: i64) -> String {
    let sign = if nanos < 0 { "-" } else { "" };
    let nanos = nanos.unsigned_abs();
    format!("{sign}{}.{:09}", nanos / 1_000_000_000, nanos % 1_000_000_000)
}
