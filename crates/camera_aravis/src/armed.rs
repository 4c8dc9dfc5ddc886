//! Frames that somebody waits for.

use std::time::{Duration, Instant};

use bytes::Bytes;
use devices::{Frame, FrameEvent, FrameFault, Frames};
use tokio::sync::mpsc;

/// Frames of an armed camera, on their way to who armed it.
#[derive(Debug)]
pub(crate) struct Armed {
    frames: mpsc::UnboundedSender<FrameEvent>,
    count: usize,
    /// Place of the next frame.
    next: usize,
    /// On the camera's clock; what was exposed before is stale.
    since: Duration,
    /// Frames that were on their way when it was armed. They come before all others.
    old: usize,
}

/// A whole frame.
#[derive(Debug)]
pub(crate) struct Image {
    pub(crate) exposed_at: Duration,
    pub(crate) received_at: Instant,
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) pixels: Bytes,
}

impl Armed {
    pub(crate) fn new(count: usize, since: Duration, old: usize) -> (Self, Frames) {
        let (frames, receiver) = mpsc::unbounded_channel();
        let next = 0;
        let armed = Self {
            frames,
            count,
            next,
            since,
            old,
        };
        (armed, receiver)
    }

    /// Whether nobody waits any more.
    pub(crate) fn has_ended(&self) -> bool {
        self.next >= self.count || self.frames.is_closed()
    }

    /// Whether a frame is from before; to be asked once for each that comes. The camera's clock tells. A frame whose
    /// first packet, with its time, was lost is judged by its place.
    pub(crate) fn is_stale(&mut self, exposed_at: Option<Duration>) -> bool {
        let was_on_its_way = self.old > 0;
        self.old = self.old.saturating_sub(1);
        exposed_at.map_or(was_on_its_way, |at| at < self.since)
    }

    pub(crate) fn missing(&mut self, count: u64) {
        let left = self.count.saturating_sub(self.next) as u64;
        let count = count.min(left);
        if count > 0 {
            self.next += count as usize;
            self.tell(FrameEvent::Fault(FrameFault::Missing { count }));
        }
    }

    pub(crate) fn fault(&mut self, fault: FrameFault) {
        if self.next < self.count {
            self.next += 1;
            self.tell(FrameEvent::Fault(fault));
        }
    }

    pub(crate) fn image(&mut self, image: Image) {
        if self.next < self.count {
            let index = self.next;
            self.next += 1;
            self.tell(FrameEvent::Frame(Frame {
                index,
                exposed_at: image.exposed_at,
                received_at: image.received_at,
                width: image.width,
                height: image.height,
                pixels: image.pixels,
            }));
        }
    }

    fn tell(&self, event: FrameEvent) {
        // Who does not listen any more has ended it.
        let _ = self.frames.send(event);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> Image {
        Image {
            exposed_at: Duration::from_secs(5),
            received_at: Instant::now(),
            width: 1,
            height: 1,
            pixels: Bytes::from_static(&[1, 2]),
        }
    }

    #[test]
    fn missing_frames_take_their_places_and_no_more_than_were_asked_for() {
        let (mut armed, mut frames) = Armed::new(5, Duration::ZERO, 0);
        armed.image(image());
        armed.missing(2);
        armed.image(image());
        armed.missing(100);
        assert!(armed.has_ended());
        armed.image(image());
        armed.fault(FrameFault::Missing { count: 1 });
        drop(armed);
        let events: Vec<_> = std::iter::from_fn(|| frames.try_recv().ok()).collect();
        assert!(matches!(
            events.as_slice(),
            [
                FrameEvent::Frame(Frame { index: 0, .. }),
                FrameEvent::Fault(FrameFault::Missing { count: 2 }),
                FrameEvent::Frame(Frame { index: 3, .. }),
                FrameEvent::Fault(FrameFault::Missing { count: 1 }),
            ]
        ));
    }

    #[test]
    fn what_was_exposed_before_is_stale_and_place_tells_where_time_does_not() {
        let (mut armed, frames) = Armed::new(1, Duration::from_secs(4), 2);
        assert!(armed.is_stale(Some(Duration::from_secs(3))));
        assert!(armed.is_stale(None), "the second that was on its way");
        assert!(!armed.is_stale(None), "the first of the new ones");
        assert!(!armed.is_stale(Some(Duration::from_secs(4))));
        assert!(!armed.has_ended());
        drop(frames);
        assert!(armed.has_ended());
    }
}
