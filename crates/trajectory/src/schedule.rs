//! Minimum-jerk legs that overlap.
//!
//! Where a leg begins before the one before it has ended, their ways add up (Flash and Henis, "Arm trajectory
//! modifications during reaching towards visual targets", Journal of Cognitive Neuroscience 3(3), 1991): both are smooth
//! up to the acceleration at their ends, and so is their sum.

/// Most of a leg that overlaps with one of its neighbours.
const MOST_OVERLAP: f64 = 0.5;
/// Events nearer to each other than this become one, seconds.
const NEAR: f64 = 1e-3;
/// Halvings when the minimum-jerk law is turned round.
const HALVINGS: usize = 50;

/// A way that is taken by minimum jerk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Leg {
    /// Seconds.
    pub(crate) begin: f64,
    /// Seconds.
    pub(crate) duration: f64,
}

impl Leg {
    /// Share of the way and its first and second derivative: s(u) = 10u³ - 15u⁴ + 6u⁵ (Flash and Hogan 1985, eq. 5).
    pub(crate) fn phase(&self, time: f64) -> [f64; 3] {
        let u = (time - self.begin) / self.duration;
        if u <= 0.0 {
            return [0.0; 3];
        }
        if u >= 1.0 {
            return [1.0, 0.0, 0.0];
        }
        let left = 1.0 - u;
        [
            share(u),
            30.0 * u * u * left * left / self.duration,
            60.0 * u * left * (1.0 - 2.0 * u) / (self.duration * self.duration),
        ]
    }

    pub(crate) fn end(&self) -> f64 {
        self.begin + self.duration
    }

    /// Whether it moves within an interval.
    pub(crate) fn is_active(&self, from: f64, to: f64) -> bool {
        self.begin < to && self.end() > from
    }
}

fn share(u: f64) -> f64 {
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// Share of the duration after which a share of the way is done.
fn when(done: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(low, high);
        if share(middle) < done {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Seconds by which two legs may overlap for their sum to stay within a tolerance of the corner where they meet.
///
/// With u and w the legs' directions, the sum is at `corner - a u + b w`, where a is what the first one has left and b
/// what the second one has done. When both are d it is nearest, `d |w - u|` away; before and after that it is at most as
/// far from one of the straight ways. So `d = tolerance / |w - u|` gives the overlap, up to half of the shorter leg.
pub(crate) fn overlap(first: &[f64], second: &[f64], durations: [f64; 2], tolerance: f64) -> f64 {
    let length = |way: &[f64]| way.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [a, b] = [length(first), length(second)];
    let turns: Vec<f64> = first.iter().zip(second).map(|(u, w)| w / b - u / a).collect();
    let apart = tolerance / length(&turns).max(1e-12);
    let time = |length: f64, duration: f64| duration * when((apart / length).min(1.0));
    let most = MOST_OVERLAP * durations[0].min(durations[1]);
    (time(a, durations[0]) + time(b, durations[1])).min(most)
}

/// Legs one after the other, each of which begins so long before the end of the one before.
pub(crate) fn schedule(durations: &[f64], overlaps: &[f64]) -> Vec<Leg> {
    let mut begin = 0.0;
    let overlaps = overlaps.iter().chain(std::iter::repeat(&0.0));
    let place = |(&duration, overlap): (&f64, &f64)| {
        let leg = Leg { begin, duration };
        begin += duration - overlap;
        leg
    };
    durations.iter().zip(overlaps).map(place).collect()
}

/// Times at which a leg begins or ends, ascending.
pub(crate) fn events(legs: &[Leg]) -> Vec<f64> {
    let mut times: Vec<f64> = legs.iter().flat_map(|leg| [leg.begin, leg.end()]).collect();
    times.sort_by(f64::total_cmp);
    let last = times[times.len() - 1];
    times.dedup_by(|later, earlier| *later - *earlier < NEAR);
    // The last event is the end, whatever is near it.
    if let Some(end) = times.last_mut() {
        *end = last;
    }
    times
}
