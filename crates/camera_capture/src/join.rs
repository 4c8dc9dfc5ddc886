//! Joins the frames of a capture with the light that was on. Pure: times and frames come in, joined frames or the
//! reason why there are none go out. One doubt is enough: a frame with the wrong light is worse than none.

#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use devices::{CameraError, Channel, Frame, FrameEvent, FrameFault};

/// Clocks of cameras and light controllers drift apart: a ceramic resonator by half a per cent.
const DRIFT: f64 = 0.005;

/// A frame may be here this much before its exposure is thought to end: the fit of the light controller's clock is not
/// perfect. Frames of an earlier capture are older by far.
const STALE_TOLERANCE: Duration = Duration::from_millis(10);

/// One exposure's light, as it was. Times are nanoseconds on the host's ROS clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    pub(crate) channel: Channel,
    pub(crate) switched_at: i64,
    pub(crate) triggered_at: i64,
    pub(crate) ended_at: i64,
}

/// All lights of a capture, in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sequence {
    pub(crate) steps: Vec<Step>,
    /// Standard deviation of the steps' times against the host's clock.
    pub(crate) clock_uncertainty: Duration,
    /// How exactly the cameras must repeat the intervals between the triggers.
    pub(crate) interval_tolerance: Duration,
}

/// What one camera gave.
#[derive(Debug, Clone)]
pub(crate) struct Take {
    pub(crate) camera: String,
    pub(crate) exposure: Duration,
    /// Columns and rows that were set.
    pub(crate) size: [u32; 2],
    pub(crate) events: Vec<FrameEvent>,
    pub(crate) end: TakeEnd,
}

/// Why no more frames came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TakeEnd {
    /// As many as were asked for are here.
    Whole,
    /// Nothing came for this long after the last light.
    Silence(Duration),
    /// The camera is gone, as its driver says.
    Lost(String),
}

impl TakeEnd {
    /// For people, behind the number of frames that came.
    pub(crate) fn why(&self) -> String {
        match self {
            Self::Whole => String::new(),
            Self::Silence(waited) => format!(" within {} ms after the last light", waited.as_millis()),
            Self::Lost(reason) => format!("; the camera is lost: {reason}"),
        }
    }
}

/// A frame with its light.
#[derive(Debug, Clone)]
pub(crate) struct JoinedFrame {
    pub(crate) channel: Channel,
    /// Mid-exposure, nanoseconds on the host's ROS clock.
    pub(crate) stamp: i64,
    pub(crate) frame: Frame,
}

/// Why a capture is void, by cause.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(crate) enum Void {
    #[error("lights: {reason}")]
    Lights { reason: String },
    #[error("lights: {found} steps were reported ({reported}), expected {expected}")]
    Steps {
        found: usize,
        reported: String,
        expected: usize,
    },
    #[error(
        "lights: the exposure of step {step} ({channel}) begins {before_micros} us after its light came on and ends \
         {after_micros} us before it went off; both must be 0 at least (on_margin, and the lights' trigger delay)"
    )]
    OnTime {
        step: usize,
        channel: Channel,
        before_micros: i64,
        after_micros: i64,
    },
    #[error("camera {camera} could not be armed or triggered: {problem}")]
    Camera { camera: String, problem: CameraError },
    #[error("camera {camera}, step {step} ({channel}): {fault}")]
    Fault {
        camera: String,
        step: usize,
        channel: Channel,
        fault: FrameFault,
    },
    #[error("camera {camera}, step {step} ({channel}): the frame is missing; {found} of {expected} came{why}")]
    Missing {
        camera: String,
        step: usize,
        channel: Channel,
        found: usize,
        expected: usize,
        why: String,
    },
    #[error("camera {camera}: {found} frames came, expected {expected}")]
    Extra {
        camera: String,
        found: usize,
        expected: usize,
    },
    #[error(
        "camera {camera}, step {step} ({channel}): exposed {found_micros} us after the first frame by the camera's \
         clock, expected {expected_micros} us by the triggers (within {tolerance_micros} us)"
    )]
    Interval {
        camera: String,
        step: usize,
        channel: Channel,
        found_micros: i64,
        expected_micros: i64,
        tolerance_micros: i64,
    },
    #[error(
        "camera {camera}, step {step} ({channel}): the frame was here {early_micros} us before its exposure ended; it \
         belongs to something else"
    )]
    Stale {
        camera: String,
        step: usize,
        channel: Channel,
        early_micros: i64,
    },
    #[error("camera {camera}, step {step} ({channel}): {} x {} pixels in {bytes} bytes, expected {} x {}", .found[0], .found[1], .expected[0], .expected[1])]
    Size {
        camera: String,
        step: usize,
        channel: Channel,
        found: [u32; 2],
        bytes: usize,
        expected: [u32; 2],
    },
}

impl Sequence {
    /// Whether the steps are those that were asked for, in order, and every exposure lies within its light.
    pub(crate) fn check(&self, channels: &[Channel], exposure: Duration) -> Result<(), Void> {
        let in_order = self
            .steps
            .windows(2)
            .all(|pair| pair[0].triggered_at < pair[1].triggered_at);
        if !in_order || !self.steps.iter().map(|step| &step.channel).eq(channels) {
            let reported: Vec<String> = self.steps.iter().map(|step| step.channel.to_string()).collect();
            return Err(Void::Steps {
                found: self.steps.len(),
                reported: reported.join(" "),
                expected: channels.len(),
            });
        }
        for (step, light) in self.steps.iter().enumerate() {
            let before = light.triggered_at - light.switched_at;
            let after = light.ended_at - light.triggered_at - nanos(exposure);
            if before < 0 || after < 0 {
                return Err(Void::OnTime {
                    step,
                    channel: light.channel,
                    before_micros: micros(before),
                    after_micros: micros(after),
                });
            }
        }
        Ok(())
    }
}

/// Joins what one camera gave with the lights: exactly one frame per step, none damaged, with the intervals of the
/// triggers. `ros_time` turns the host's instants into nanoseconds on its ROS clock.
pub(crate) fn join(
    sequence: &Sequence,
    take: Take,
    ros_time: impl Fn(Instant) -> i64,
) -> Result<Vec<JoinedFrame>, Void> {
    let Take {
        camera,
        exposure,
        size,
        events,
        end,
    } = take;
    let check = Check {
        steps: &sequence.steps,
        tolerance: sequence.interval_tolerance,
        early: STALE_TOLERANCE + 5 * sequence.clock_uncertainty,
        camera,
        exposure,
        size,
    };
    let frames = check.frames(events)?;
    check.count(&frames, &end)?;
    check.intervals(&frames)?;
    for (step, frame) in frames.iter().enumerate() {
        check.size(step, frame)?;
        check.age(step, ros_time(frame.received_at))?;
    }
    Ok(check.joined(frames))
}

/// One camera's frames under test.
struct Check<'a> {
    steps: &'a [Step],
    tolerance: Duration,
    early: Duration,
    camera: String,
    exposure: Duration,
    size: [u32; 2],
}

impl Check<'_> {
    fn frames(&self, events: Vec<FrameEvent>) -> Result<Vec<Frame>, Void> {
        let frame = |(step, event)| match event {
            FrameEvent::Frame(frame) => Ok(frame),
            FrameEvent::Fault(fault) => Err(Void::Fault {
                camera: self.camera.clone(),
                step,
                channel: self.channel(step),
                fault,
            }),
        };
        events.into_iter().enumerate().map(frame).collect()
    }

    fn count(&self, frames: &[Frame], end: &TakeEnd) -> Result<(), Void> {
        let (found, expected) = (frames.len(), self.steps.len());
        let camera = self.camera.clone();
        if found > expected {
            return Err(Void::Extra {
                camera,
                found,
                expected,
            });
        }
        if found == expected {
            return Ok(());
        }
        // A trigger that was missed leaves its mark in the intervals; without one, the last frames are missing.
        let step = (0..found)
            .find(|step| self.interval(frames, *step).is_err())
            .unwrap_or(found);
        let why = end.why();
        Err(Void::Missing {
            camera,
            step,
            channel: self.channel(step),
            found,
            expected,
            why,
        })
    }

    fn intervals(&self, frames: &[Frame]) -> Result<(), Void> {
        (0..frames.len()).try_for_each(|step| self.interval(frames, step))
    }

    /// From the first frame to this one: a slip would add up between neighbours.
    fn interval(&self, frames: &[Frame], step: usize) -> Result<(), Void> {
        let found = nanos(frames[step].exposed_at) - nanos(frames[0].exposed_at);
        let expected = self.steps[step].triggered_at - self.steps[0].triggered_at;
        let tolerance = nanos(self.tolerance) + (expected as f64 * DRIFT) as i64;
        if (found - expected).abs() <= tolerance {
            return Ok(());
        }
        Err(Void::Interval {
            camera: self.camera.clone(),
            step,
            channel: self.channel(step),
            found_micros: micros(found),
            expected_micros: micros(expected),
            tolerance_micros: micros(tolerance),
        })
    }

    fn size(&self, step: usize, frame: &Frame) -> Result<(), Void> {
        let (found, bytes) = ([frame.width, frame.height], frame.pixels.len());
        if found == self.size && bytes == 2 * frame.width as usize * frame.height as usize {
            return Ok(());
        }
        Err(Void::Size {
            camera: self.camera.clone(),
            step,
            channel: self.channel(step),
            found,
            bytes,
            expected: self.size,
        })
    }

    fn age(&self, step: usize, received_at: i64) -> Result<(), Void> {
        let exposed_at = self.steps[step].triggered_at + nanos(self.exposure);
        let early = exposed_at - received_at;
        if early <= nanos(self.early) {
            return Ok(());
        }
        Err(Void::Stale {
            camera: self.camera.clone(),
            step,
            channel: self.channel(step),
            early_micros: micros(early),
        })
    }

    fn joined(&self, frames: Vec<Frame>) -> Vec<JoinedFrame> {
        let middle = nanos(self.exposure) / 2;
        let joined = self.steps.iter().zip(frames).map(|(step, frame)| JoinedFrame {
            channel: step.channel,
            stamp: step.triggered_at + middle,
            frame,
        });
        joined.collect()
    }

    /// Of a step that may be beyond the last.
    fn channel(&self, step: usize) -> Channel {
        self.steps.get(step).map_or(Channel::DARK, |step| step.channel)
    }
}

fn nanos(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

fn micros(nanos: i64) -> i64 {
    nanos / 1000
}
