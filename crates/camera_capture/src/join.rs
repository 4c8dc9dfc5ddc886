//! Joins the frames of a capture with the light that was on. Pure: times and frames come in, joined frames or the
//! reason why there are none go out. One doubt is enough: a frame with the wrong light is worse than none.

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

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;

    const EXPOSURE: Duration = Duration::from_micros(2500);
    const PERIOD: i64 = 13_000_000;
    const START: i64 = 1_700_000_000_000_000_000;
    /// The camera's clock is elsewhere.
    const CAMERA_START: i64 = 77_000_000_000;

    fn sequence() -> Sequence {
        let step = |channel: Channel| {
            let switched_at = START + i64::from(channel.number()) * PERIOD;
            Step {
                channel,
                switched_at,
                triggered_at: switched_at + 200_000,
                ended_at: switched_at + 3_000_000,
            }
        };
        Sequence {
            steps: Channel::all().map(step).collect(),
            clock_uncertainty: Duration::from_micros(100),
            interval_tolerance: Duration::from_micros(500),
        }
    }

    /// A frame exposed and received when step `step` says, by a camera's clock that is `drift` too fast.
    fn frame(index: usize, step: i64, drift: f64) -> FrameEvent {
        FrameEvent::Frame(Frame {
            index,
            exposed_at: Duration::from_nanos(
                (CAMERA_START + (step as f64 * PERIOD as f64 * (1.0 + drift)) as i64) as u64,
            ),
            received_at: zero() + Duration::from_nanos((step * PERIOD + 10_000_000) as u64),
            width: 4,
            height: 2,
            pixels: Bytes::from_static(&[0; 16]),
        })
    }

    /// The instant of `START`, the same throughout a test.
    fn zero() -> Instant {
        static ZERO: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        *ZERO.get_or_init(Instant::now)
    }

    fn ros_time(instant: Instant) -> i64 {
        START + nanos(instant.duration_since(zero()))
    }

    fn take(events: Vec<FrameEvent>) -> Take {
        let end = if events.len() < 8 {
            TakeEnd::Silence(Duration::from_millis(500))
        } else {
            TakeEnd::Whole
        };
        Take {
            camera: "c1".into(),
            exposure: EXPOSURE,
            size: [4, 2],
            events,
            end,
        }
    }

    fn whole() -> Vec<FrameEvent> {
        (0..8).map(|step| frame(step as usize, step, 0.0)).collect()
    }

    fn reason(events: Vec<FrameEvent>) -> String {
        join(&sequence(), take(events), ros_time).unwrap_err().to_string()
    }

    fn spoilt(step: usize, spoil: impl Fn(&mut Frame)) -> Vec<FrameEvent> {
        let mut events = whole();
        let FrameEvent::Frame(frame) = &mut events[step] else {
            unreachable!()
        };
        spoil(frame);
        events
    }

    #[test]
    fn frames_get_the_light_and_the_middle_of_their_exposure() {
        let joined = join(&sequence(), take(whole()), ros_time).unwrap();
        let channels: Vec<u8> = joined.iter().map(|frame| frame.channel.number()).collect();
        assert_eq!(channels, [0, 1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(joined[3].stamp, START + 3 * PERIOD + 200_000 + 1_250_000);
        assert_eq!(joined[7].frame.index, 7);
    }

    #[test]
    fn a_clock_that_drifts_is_no_fault() {
        for drift in [-0.004, 0.004] {
            let events = (0..8).map(|step| frame(step as usize, step, drift)).collect();
            assert_eq!(join(&sequence(), take(events), ros_time).unwrap().len(), 8, "{drift}");
        }
    }

    #[test]
    fn a_missed_trigger_is_found_where_it_was() {
        for missed in [3, 6] {
            let steps = (0..8).filter(|step| *step != missed);
            let events = steps.enumerate().map(|(index, step)| frame(index, step, 0.0)).collect();
            assert_eq!(
                reason(events),
                format!(
                    "camera c1, step {missed} (L{missed}): the frame is missing; 7 of 8 came within 500 ms after the \
                     last light"
                )
            );
        }
        // The first one leaves all intervals right, and so does the last.
        let events = (1..8).map(|step| frame(step as usize - 1, step, 0.0)).collect();
        assert!(reason(events).contains("step 7 (L7): the frame is missing; 7 of 8"));
        assert!(reason(Vec::new()).contains("step 0 (dark): the frame is missing; 0 of 8"));
    }

    #[test]
    fn a_lost_camera_is_named_with_its_reason() {
        let mut take = take(whole()[..5].to_vec());
        take.end = TakeEnd::Lost("control lost".into());
        let reason = join(&sequence(), take, ros_time).unwrap_err().to_string();
        assert_eq!(
            reason,
            "camera c1, step 5 (L5): the frame is missing; 5 of 8 came; the camera is lost: control lost"
        );
    }

    #[test]
    fn a_damaged_frame_is_named_in_its_place() {
        let mut events = whole();
        events[2] = FrameEvent::Fault(FrameFault::Incomplete {
            status: "missing packets".into(),
        });
        assert_eq!(
            reason(events),
            "camera c1, step 2 (L2): the frame did not arrive whole: missing packets"
        );
    }

    #[test]
    fn extra_frames_void_a_capture_before_its_end_and_after_it() {
        let mut events = whole();
        events.push(frame(8, 8, 0.0));
        assert_eq!(reason(events), "camera c1: 9 frames came, expected 8");
        // An exposure between two steps pushes the others along, and the last one out.
        let mut events = spoilt(4, |frame| frame.exposed_at -= Duration::from_millis(6));
        events.truncate(5);
        events.extend((4..7).map(|step| frame(step as usize + 1, step, 0.0)));
        assert_eq!(
            reason(events),
            "camera c1, step 4 (L4): exposed 46000 us after the first frame by the camera's clock, expected 52000 us by \
             the triggers (within 760 us)"
        );
    }

    #[test]
    fn a_frame_that_is_older_than_its_exposure_is_stale() {
        let events = spoilt(1, |frame| frame.received_at -= Duration::from_millis(20));
        assert!(
            reason(events).contains("step 1 (L1): the frame was here 12700 us before"),
            "{}",
            reason(whole())
        );
    }

    #[test]
    fn another_size_is_refused() {
        let events = spoilt(0, |frame| frame.pixels = Bytes::from_static(&[0; 8]));
        assert_eq!(
            reason(events),
            "camera c1, step 0 (dark): 4 x 2 pixels in 8 bytes, expected 4 x 2"
        );
    }

    #[test]
    fn a_sequence_is_what_was_asked_for_and_holds_every_exposure() {
        let channels: Vec<Channel> = Channel::all().collect();
        let good = sequence();
        assert_eq!(good.check(&channels, EXPOSURE), Ok(()));
        let mut swapped = good.clone();
        swapped.steps.swap(1, 2);
        let reason = swapped.check(&channels, EXPOSURE).unwrap_err().to_string();
        assert!(reason.contains("dark L2 L1 L3"), "{reason}");
        let mut short = good;
        short.steps[4].ended_at -= 400_000;
        assert_eq!(
            short.check(&channels, EXPOSURE).unwrap_err().to_string(),
            "lights: the exposure of step 4 (L4) begins 200 us after its light came on and ends -100 us before it went \
             off; both must be 0 at least (on_margin, and the lights' trigger delay)"
        );
    }
}
