//! What the numbers of frames tell: which are missing, and which came twice.

/// Block ids of 16 bits go from 65535 to 1; 0 is never one.
const LARGEST_SHORT_ID: u64 = 0xffff;

/// Follows the block ids of a stream.
#[derive(Debug, Default)]
pub(crate) struct FrameOrder {
    last: Option<u64>,
}

/// What the next id means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Step {
    /// A new frame, after so many that never came.
    New { missing: u64 },
    /// Seen before, or older than the last one.
    Old,
}

impl FrameOrder {
    /// A frame whose first packet was lost has no id: it takes the next place.
    pub(crate) fn next(&mut self, id: Option<u64>) -> Step {
        let Some(last) = self.last else {
            self.last = id;
            return Step::New { missing: 0 };
        };
        let id = id.unwrap_or_else(|| after(last));
        match distance(last, id) {
            Some(steps @ 1..) => {
                self.last = Some(id);
                Step::New { missing: steps - 1 }
            }
            _ => Step::Old,
        }
    }
}

fn after(id: u64) -> u64 {
    if id == LARGEST_SHORT_ID { 1 } else { id + 1 }
}

/// Steps from one id to a later one; none backwards. Ids are taken for long ones once they exceed 16 bits.
fn distance(last: u64, id: u64) -> Option<u64> {
    if last > LARGEST_SHORT_ID || id > LARGEST_SHORT_ID {
        return id.checked_sub(last);
    }
    // 65535 ids, 1 to 65535, in a circle; more than half of it ahead is behind.
    let steps = (id + LARGEST_SHORT_ID - last) % LARGEST_SHORT_ID;
    (steps <= LARGEST_SHORT_ID / 2).then_some(steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(ids: &[u64]) -> Vec<Step> {
        let mut order = FrameOrder::default();
        ids.iter().map(|id| order.next((*id != 0).then_some(*id))).collect()
    }

    const fn new(missing: u64) -> Step {
        Step::New { missing }
    }

    #[test]
    fn short_ids_wrap_to_one() {
        assert_eq!(steps(&[65534, 65535, 1, 2]), [new(0); 4]);
        assert_eq!(steps(&[65533, 2]), [new(0), new(3)]);
    }

    #[test]
    fn long_ids_do_not_wrap() {
        assert_eq!(steps(&[65535, 65536, 65538]), [new(0), new(0), new(1)]);
    }

    #[test]
    fn a_gap_is_counted_and_the_first_id_may_be_any() {
        assert_eq!(steps(&[700, 701, 705]), [new(0), new(0), new(3)]);
    }

    #[test]
    fn a_frame_that_comes_twice_or_late_is_old() {
        assert_eq!(steps(&[7, 7, 5, 8]), [new(0), Step::Old, Step::Old, new(0)]);
        assert_eq!(steps(&[2, 65535, 3]), [new(0), Step::Old, new(0)]);
        assert_eq!(steps(&[70000, 69000, 70001]), [new(0), Step::Old, new(0)]);
    }

    #[test]
    fn a_frame_without_id_takes_the_next_place() {
        assert_eq!(steps(&[7, 0, 9]), [new(0); 3]);
        assert_eq!(steps(&[65535, 0, 2]), [new(0); 3]);
        assert_eq!(steps(&[0, 9]), [new(0); 2]);
    }
}
