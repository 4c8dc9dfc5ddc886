//! What touches what, along a path.
//!
//! Conservative advancement (Mirtich, "Impulse-based dynamic simulation of rigid body systems", 1996, section 2.3): two
//! things that are `d` apart cannot touch before they have moved `d`, and none of their points moves faster than the sum
//! of the joints' speeds times its distances from their axes. Each pair is looked at again only when it could touch.

use std::fmt;

use crate::allowance::is_contact;
use crate::arm::Frames;
use crate::checker::{Checker, Contact, Pair, With};
use crate::error::{CollisionError, require};
use crate::path::{JointPath, SpeedWindows};

/// Farther than this nobody looks: whoever is this far away waits for its next look as if it were here. Metres.
const FAR: f64 = 0.25;
/// A pair whose next look is due this soon is looked at together with the others, seconds.
const TOGETHER: f64 = 5e-4;
/// The library's iterations find rounded bodies up to 20 um (measured) too far from each other; metres.
const DISTANCE_ERROR: f64 = 5e-5;
/// What rounding may add to a joint's way, radians.
const ROUNDING: f64 = 1e-9;

/// The first contact on a path.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionContact<'a> {
    /// Since the path's begin, seconds.
    pub time: f64,
    /// What touches what, and how deep, at that time.
    pub contact: Contact<'a>,
}

/// A pair and when it has to be looked at.
struct Watch<'a> {
    pair: Pair<'a>,
    /// What counts as a contact, metres.
    margin: f64,
    due: f64,
}

impl<'a, const N: usize> Checker<'a, N> {
    /// The first contact on a path, none if there is none. Things nearer than the margin, or than they
    /// are allowed, are in contact.
    ///
    /// Between looks nothing comes nearer than the margin less `tolerance` (metres, 1e-4 to 0.1): what is missed is a
    /// touch that shallow. A contact after the begin is therefore found at most `tolerance` deep. The path's end is
    /// looked at exactly. One list is allocated for each call.
    ///
    /// # Errors
    /// Numbers that are none, and a path that moves faster than it says.
    pub fn check_motion(
        &self,
        path: &impl JointPath<N>,
        tolerance: f64,
    ) -> Result<Option<MotionContact<'a>>, CollisionError> {
        let is_allowed = (1e-4..=0.1).contains(&tolerance);
        require("check of a motion", "tolerance", tolerance, is_allowed, "1e-4 to 0.1 m")?;
        let speeds = SpeedWindows::new(path)?;
        let watch = |pair| Watch {
            margin: self.margin_of(&pair),
            pair,
            due: 0.0,
        };
        let mut watches: Vec<Watch<'a>> = self.pairs().map(watch).collect();
        let (mut time, mut angles) = (0.0, path.angles(0.0));
        loop {
            let frames = self.arm.frames(&angles)?;
            if let Some(contact) = self.look(&mut watches, &frames, &speeds, time, tolerance) {
                return Ok(Some(MotionContact { time, contact }));
            }
            let next = watches.iter().map(|watch| watch.due).fold(f64::INFINITY, f64::min);
            let next = next.min(speeds.duration());
            let there = path.angles(next);
            require_stated_speed(&speeds, (time, &angles), (next, &there))?;
            if next >= speeds.duration() {
                let contact = self.check(&there)?;
                return Ok(contact.map(|contact| MotionContact { time: next, contact }));
            }
            (time, angles) = (next, there);
        }
    }

    /// Looks at the pairs that are due and tells when they are due again; the worst of those in contact.
    fn look(
        &self,
        watches: &mut [Watch<'a>],
        frames: &Frames<N>,
        speeds: &SpeedWindows<N>,
        time: f64,
        tolerance: f64,
    ) -> Option<Contact<'a>> {
        let (mut worst, mut least) = (None, f64::INFINITY);
        for watch in watches.iter_mut().filter(|watch| watch.due <= time + TOGETHER) {
            let distance = watch.pair.distance(frames, watch.margin + FAR);
            if is_contact(distance, watch.margin) {
                if distance - watch.margin < least {
                    least = distance - watch.margin;
                    worst = Some(watch.pair.contact(distance));
                }
                continue;
            }
            let way = distance - watch.margin + tolerance - DISTANCE_ERROR;
            let reaches = self.reaches(&watch.pair, frames);
            watch.due = speeds.time_of_travel(time, way, &reaches);
        }
        worst
    }

    /// Farthest distance of the pair's outer body from each of the joints between the two; 0 for joints that move both or
    /// none of them.
    fn reaches(&self, pair: &Pair<'a>, frames: &Frames<N>) -> [f64; N] {
        let (outer, inner) = match pair.with {
            With::Part(other) if other.joint > pair.part.joint => (other, pair.part.joint),
            With::Part(other) => (pair.part, other.joint),
            With::Obstacle(_) => (pair.part, None),
        };
        let first = inner.map_or(0, |joint| joint + 1);
        let end = outer.joint.map_or(0, |joint| joint + 1);
        let ball = outer.ball_in_base(frames);
        std::array::from_fn(|joint| {
            if (first..end).contains(&joint) {
                self.arm.reach_from_axis(frames, joint, &ball)
            } else {
                0.0
            }
        })
    }
}

fn require_stated_speed<const N: usize>(
    speeds: &SpeedWindows<N>,
    (time, angles): (f64, &[f64; N]),
    (next, there): (f64, &[f64; N]),
) -> Result<(), CollisionError> {
    let most = speeds.most_turned(time, next);
    for joint in 0..N {
        let (moved, allowed) = ((there[joint] - angles[joint]).abs(), most[joint] + ROUNDING);
        if moved > allowed {
            return Err(CollisionError::FasterThanStated {
                joint: joint + 1,
                time: next,
                moved,
                allowed,
            });
        }
    }
    Ok(())
}

impl fmt::Display for MotionContact<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "at {:.3} s {}", self.time, self.contact)
    }
}
