//! Every type survives CDR in both byte orders; no input makes reading panic or allocate without bound.

use byteorder::BigEndian;
use interfaces::{Message, MessageVisitor, cdr};
use proptest::prelude::*;

use crate::random::{Numbers, random_message};
use crate::visit_everything;

struct RoundTrip(u64);

impl MessageVisitor for RoundTrip {
    fn visit<M: Message>(&mut self) {
        let message: M = random_message(self.0);
        let bytes = cdr::to_vec(&message).unwrap();
        assert_eq!(bytes.capacity(), bytes.len(), "{} was not sized before", M::TYPE_NAME);
        assert_eq!(cdr::from_slice::<M>(&bytes).unwrap(), message, "{}", M::TYPE_NAME);
        assert_eq!(cdr::to_body(&message).unwrap(), bytes[4..], "{}", M::TYPE_NAME);

        let big_body = cdr_encoding::to_vec::<M, BigEndian>(&message).unwrap();
        let big = [&[0, 0, 0, 0], big_body.as_slice()].concat();
        assert_eq!(
            cdr::from_slice::<M>(&big).unwrap(),
            message,
            "{} big-endian",
            M::TYPE_NAME
        );
        assert_eq!(
            cdr::from_body::<M>(&big_body, cdr::Endianness::Big).unwrap(),
            message,
            "{}",
            M::TYPE_NAME
        );

        let json = serde_json::to_string(&M::default()).unwrap();
        assert_eq!(
            serde_json::from_str::<M>(&json).unwrap(),
            M::default(),
            "{} as JSON",
            M::TYPE_NAME
        );
    }
}

/// Cuts a valid message at a random byte: an error that names the type, unless only padding is missing.
struct Truncation(u64);

impl MessageVisitor for Truncation {
    fn visit<M: Message>(&mut self) {
        let bytes = cdr::to_vec(&random_message::<M>(self.0)).unwrap();
        let mut numbers = Numbers::new(self.0);
        let cut = numbers.below(bytes.len());
        let error = cdr::from_slice::<M>(&bytes[..cut]).unwrap_err().to_string();
        assert!(error.contains(M::TYPE_NAME), "{error}");
    }
}

struct Garbage(u64);

impl MessageVisitor for Garbage {
    fn visit<M: Message>(&mut self) {
        let mut numbers = Numbers::new(self.0);
        let count = numbers.below(200);
        let mut bytes = numbers.bytes(count);
        // Mostly a right header, so that the body is reached.
        if numbers.below(4) > 0 && bytes.len() >= 4 {
            bytes[..4].copy_from_slice(&[0, numbers.next() as u8 & 1, 0, 0]);
        }
        // Small and huge lengths are what hurts, not evenly spread ones.
        for word in bytes[count.min(4)..].chunks_exact_mut(4) {
            match numbers.below(4) {
                0 => word.copy_from_slice(&[numbers.next() as u8 & 3, 0, 0, 0]),
                1 => word.fill(255),
                _ => {}
            }
        }
        if let Ok(message) = cdr::from_slice::<M>(&bytes) {
            // Bits that were ignored, such as padding, may differ; the value may not.
            let again = cdr::to_vec(&message).unwrap();
            let message_again = cdr::from_slice::<M>(&again).unwrap();
            assert_eq!(cdr::to_vec(&message_again).unwrap(), again, "{}", M::TYPE_NAME);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn every_type_survives_both_byte_orders(seed: u64) {
        visit_everything(&mut RoundTrip(seed));
    }

    #[test]
    fn a_cut_message_is_refused_by_name(seed: u64) {
        visit_everything(&mut Truncation(seed));
    }

    #[test]
    fn garbage_never_panics(seed: u64) {
        visit_everything(&mut Garbage(seed));
    }
}

/// The most virtual memory this process ever had, in kB.
#[cfg(target_os = "linux")]
fn peak_memory_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmPeak:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

struct HugeLengths;

impl MessageVisitor for HugeLengths {
    fn visit<M: Message>(&mut self) {
        // Every word says 4294967295: whichever of them is a length, there are never that many elements.
        let mut bytes = vec![255; 400];
        bytes[..4].copy_from_slice(&cdr::LITTLE_ENDIAN_HEADER);
        let _ = cdr::from_slice::<M>(&bytes);
        // The same behind a valid start.
        let mut bytes = cdr::to_vec(&M::default()).unwrap();
        for at in (4..bytes.len().saturating_sub(3)).step_by(4) {
            let kept: [u8; 4] = bytes[at..at + 4].try_into().unwrap();
            bytes[at..at + 4].fill(255);
            let _ = cdr::from_slice::<M>(&bytes);
            bytes[at..at + 4].copy_from_slice(&kept);
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_huge_length_allocates_nothing_huge() {
    let before = peak_memory_kb();
    visit_everything(&mut HugeLengths);
    let grown = peak_memory_kb() - before;
    assert!(
        grown < 300_000,
        "reading short messages with huge lengths took {grown} kB"
    );
}
