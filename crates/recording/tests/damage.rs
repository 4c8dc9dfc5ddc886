//! Bags cut off or changed at any byte: what can be read is read, what cannot is named.

mod common;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use common::{all, shared, write_own};
use proptest::test_runner::{Config as ProptestConfig, RngSeed, TestCaseError, TestRunner};
use recording::{Bag, RawMessage};
use tempfile::TempDir;

const CUTS: usize = 200;

/// Opens what is left of a bag after `length` bytes; none when not even the magic is left.
fn cut(content: &[u8], length: usize, scratch: &Path) -> Option<Bag> {
    let path = scratch.join("cut.mcap");
    std::fs::write(&path, &content[..length]).unwrap();
    match Bag::open(&path) {
        Ok(bag) => Some(bag),
        Err(error) => {
            assert!(length < 8, "cut at {length}: {error}");
            None
        }
    }
}

/// Cuts at seeded random places and compares what is read with the whole; gives the number read at each cut.
fn check_cuts(file: &Path) -> Vec<(usize, usize)> {
    let content = std::fs::read(file).unwrap();
    let scratch = tempfile::tempdir().unwrap();
    let whole = all(&Bag::open(file).unwrap());
    let mut random = fastrand::Rng::with_seed(2);
    let mut cuts: Vec<usize> = (0..CUTS).map(|_| random.usize(..content.len())).collect();
    cuts.sort_unstable();
    let mut read = Vec::new();
    for length in cuts {
        let Some(bag) = cut(&content, length, scratch.path()) else {
            continue;
        };
        assert!(
            !bag.report().is_whole(),
            "a cut at {length} of {} went unnoticed",
            content.len()
        );
        let messages = all(&bag);
        assert_eq!(messages.len(), bag.report().messages);
        assert_subsequence(&messages, &whole);
        read.push((length, messages.len()));
    }
    assert!(
        read.is_sorted_by_key(|(_, messages)| *messages),
        "a longer rest gave less: {read:?}"
    );
    read
}

fn assert_subsequence(part: &[RawMessage], whole: &[RawMessage]) {
    let mut rest = whole.iter();
    for message in part {
        let same = |other: &&RawMessage| {
            (other.log_time, &other.topic.name, &other.cdr) == (message.log_time, &message.topic.name, &message.cdr)
        };
        assert!(
            rest.any(|other| same(&other)),
            "a message at {} was not recorded",
            message.log_time
        );
    }
}

#[test]
fn a_cut_plain_bag_gives_every_message_before_the_cut() {
    let Some(folder) = shared("data/bags/bag_mcap") else {
        return;
    };
    let file = folder.join("bag_mcap.mcap");
    let content = std::fs::read(&file).unwrap();
    let whole = Bag::open(&file).unwrap();
    // In an uncompressed file a message is complete when its last byte is there; times keep the file's order here.
    let mut position = 0;
    let ends: Vec<usize> = all(&whole)
        .iter()
        .map(|message| {
            let found = content[position..]
                .windows(message.cdr.len())
                .position(|window| window == message.cdr);
            position += found.expect("the message is in the file") + message.cdr.len();
            position
        })
        .collect();
    for (length, messages) in check_cuts(&file) {
        assert_eq!(
            messages,
            ends.iter().filter(|&&end| end <= length).count(),
            "cut at {length}"
        );
    }
}

#[test]
fn a_cut_compressed_bag_gives_the_messages_before_the_cut() {
    let Some(folder) = shared("data/bags/bag_mcap_zstd_storage") else {
        return;
    };
    let read = check_cuts(&folder.join("bag_mcap_zstd_storage.mcap"));
    // All messages are in one chunk; zstd gives back what was complete before the cut.
    assert!(
        read.iter().any(|&(_, messages)| messages > 0 && messages < 35),
        "{read:?}"
    );
}

#[test]
fn a_cut_bag_of_our_own_keeps_its_chunks() {
    let scratch = tempfile::tempdir().unwrap();
    write_own(&scratch.path().join("own"));
    let read = check_cuts(&scratch.path().join("own/own.mcap"));
    let distinct: BTreeSet<usize> = read.iter().map(|&(_, messages)| messages).collect();
    assert!(distinct.len() > 5, "{distinct:?}");
}

/// A bag of our own on disk: its bytes, its messages in the order of the file, and where its chunks begin and end with
/// the number of messages up to there.
struct Own {
    content: Vec<u8>,
    written: Vec<Vec<u8>>,
    chunks: Vec<(Range<usize>, usize)>,
    scratch: TempDir,
}

impl Own {
    fn new() -> Self {
        let scratch = tempfile::tempdir().unwrap();
        let written = write_own(&scratch.path().join("own"));
        let content = std::fs::read(scratch.path().join("own/own.mcap")).unwrap();
        let mut own = Self {
            content,
            written: written.into_iter().map(|(_, _, cdr)| cdr).collect(),
            chunks: Vec::new(),
            scratch,
        };
        let spans: Vec<Range<usize>> = records(&own.content)
            .filter(|(kind, _)| *kind == 6)
            .map(|(_, at)| at)
            .collect();
        for span in spans {
            let messages = own.read(span.end).len();
            own.chunks.push((span, messages));
        }
        own
    }

    /// What is read after a cut, in the order of the file.
    fn read(&self, length: usize) -> Vec<Vec<u8>> {
        let Some(bag) = cut(&self.content, length, self.scratch.path()) else {
            return Vec::new();
        };
        assert!(!bag.report().is_whole(), "the cut at {length} is named");
        let mut messages = all(&bag);
        // Sequence numbers are per topic; the file's order is that of the writing.
        let place = |message: &RawMessage| self.written.iter().position(|cdr| *cdr == message.cdr);
        messages.sort_by_key(|message| place(message).expect("every message read was written"));
        messages.into_iter().map(|message| message.cdr.to_vec()).collect()
    }

    /// A cut gives a beginning of what was written, with every message of the chunks before it.
    fn check(&self, length: usize) -> Result<usize, String> {
        let read = self.read(length);
        let before = self.chunks.iter().rev().find(|(chunk, _)| chunk.end <= length);
        let whole = before.map_or(0, |(_, messages)| *messages);
        if !self.written.starts_with(&read) {
            return Err(format!(
                "cut at {length}: {} messages that are no beginning",
                read.len()
            ));
        }
        if read.len() < whole {
            return Err(format!(
                "cut at {length}: {} messages, {whole} are in whole chunks",
                read.len()
            ));
        }
        Ok(read.len())
    }
}

/// Opcode and place of the records of a file, without what is in its chunks.
fn records(content: &[u8]) -> impl Iterator<Item = (u8, Range<usize>)> {
    let mut position = 8;
    std::iter::from_fn(move || {
        let header: [u8; 9] = content.get(position..position + 9)?.try_into().ok()?;
        let length = u64::from_le_bytes(header[1..].try_into().ok()?) as usize;
        let start = position;
        position += 9 + length;
        (position <= content.len()).then_some((header[0], start..position))
    })
}

#[test]
fn cuts_around_every_boundary_give_every_whole_message_before_them() {
    let own = Own::new();
    assert!(own.chunks.len() > 1, "{:?}", own.chunks);
    assert_eq!(own.chunks.last().map(|(_, messages)| *messages), Some(60));
    let mut cuts = BTreeSet::new();
    for (_, place) in records(&own.content) {
        for boundary in [place.start, place.start + 9, place.end] {
            cuts.extend((boundary.saturating_sub(2)..boundary + 3).filter(|cut| *cut < own.content.len()));
        }
    }
    for length in cuts {
        own.check(length).unwrap();
    }
    // Within a chunk, what zstd has given back by then counts too.
    let (last, messages) = own.chunks.last().unwrap();
    let (_, before) = own.chunks[own.chunks.len() - 2];
    let inside = own.check(last.end - 1000).unwrap();
    assert!(
        before < inside && inside <= *messages,
        "{inside} of {before}..{messages}"
    );
}

#[test]
fn cuts_anywhere_give_a_beginning_with_every_whole_chunk() {
    let own = Own::new();
    let config = ProptestConfig {
        rng_seed: RngSeed::Fixed(11),
        failure_persistence: None,
        ..ProptestConfig::with_cases(64)
    };
    let run = TestRunner::new(config).run(&(0..own.content.len()), |length| {
        own.check(length).map(drop).map_err(TestCaseError::fail)
    });
    run.unwrap();
}

#[test]
fn changed_bytes_never_panic_and_never_change_a_message() {
    let scratch = tempfile::tempdir().unwrap();
    write_own(&scratch.path().join("own"));
    let file = scratch.path().join("own/own.mcap");
    let content = std::fs::read(&file).unwrap();
    let whole = all(&Bag::open(&file).unwrap());
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..CUTS {
        let mut changed = content.clone();
        let position = random.usize(8..changed.len());
        changed[position] ^= random.u8(1..);
        let path = scratch.path().join("changed.mcap");
        std::fs::write(&path, changed).unwrap();
        // A changed compression name is refused; everything else is read around.
        let Ok(bag) = Bag::open(&path) else { continue };
        for message in bag.messages() {
            let message = message.unwrap();
            assert!(
                whole.iter().any(|other| other.cdr == message.cdr),
                "changed byte {position} changed a message"
            );
        }
    }
}

#[test]
fn a_chunk_with_a_wrong_crc_is_left_out_and_named() {
    let scratch = tempfile::tempdir().unwrap();
    write_own(&scratch.path().join("own"));
    let file = scratch.path().join("own/own.mcap");
    let whole = Bag::open(&file).unwrap().report().messages;
    let mut content = std::fs::read(&file).unwrap();
    // The first chunk follows the header record; its CRC follows three times of eight bytes.
    let header_length = u64::from_le_bytes(content[9..17].try_into().unwrap()) as usize;
    let chunk = 17 + header_length;
    assert_eq!(content[chunk], 6, "a chunk follows the header");
    content[chunk + 9 + 24] ^= 1;
    std::fs::write(&file, content).unwrap();
    let bag = Bag::open(&file).unwrap();
    let [damage] = bag.report().damage.as_slice() else {
        panic!("{:?}", bag.report().damage)
    };
    assert!(damage.to_string().contains("chunk CRC is"), "{damage}");
    assert!(bag.report().messages > 0 && bag.report().messages < whole);
}
