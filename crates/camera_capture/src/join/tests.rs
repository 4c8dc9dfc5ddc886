//! Frames that fit their sequence, and every way in which they do not.

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
        exposed_at: Duration::from_nanos((CAMERA_START + (step as f64 * PERIOD as f64 * (1.0 + drift)) as i64) as u64),
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
