//! The writing thread: order, limits, and what outlives a process that is killed.

mod common;

use std::sync::mpsc;
use std::time::{Duration, Instant};

use common::{all, string_message};
use recording::{BackgroundWriter, Bag, BagWriter, OfferedQos, TopicId};

fn create(folder: &std::path::Path) -> (BagWriter, TopicId) {
    let mut bag = BagWriter::create(folder).unwrap();
    let options = OfferedQos::default().into();
    let topic = bag
        .add_topic("/note", "std_msgs/msg/String", "string data\n", &options)
        .unwrap();
    (bag, topic)
}

#[test]
fn messages_come_into_the_bag_in_the_order_in_which_they_were_offered() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("bag");
    let (bag, topic) = create(&folder);
    let writer = BackgroundWriter::start(bag, 1 << 30, || panic!("nothing fails")).unwrap();
    let inlet = writer.inlet();
    for number in 0..1000_u32 {
        let cdr = string_message(number.to_string().as_bytes());
        assert!(inlet.offer(topic, 7, cdr.len(), move || (number % 10 != 0).then_some(cdr)));
    }
    let progress = writer.finish().unwrap();
    assert_eq!((progress.written, progress.refused, progress.dropped), (900, 100, 0));
    assert_eq!((progress.queued_bytes, progress.safe_messages), (0, 900));
    let bag = Bag::open(&folder).unwrap();
    let read = all(&bag).into_iter().map(|message| message.cdr.to_vec());
    let expected = (0..1000)
        .filter(|number| number % 10 != 0)
        .map(|n: u32| string_message(n.to_string().as_bytes()));
    assert!(read.eq(expected));
}

#[test]
fn a_full_queue_drops_the_newest_and_a_message_larger_than_it_fits_alone() {
    let scratch = tempfile::tempdir().unwrap();
    let (bag, topic) = create(&scratch.path().join("bag"));
    let writer = BackgroundWriter::start(bag, 100, || panic!("nothing fails")).unwrap();
    let inlet = writer.inlet();
    let (release, held) = mpsc::channel::<()>();
    assert!(inlet.offer(topic, 1, 500, move || {
        held.recv().ok().map(|()| string_message(b"large"))
    }));
    assert!(!inlet.offer(topic, 2, 1, || Some(string_message(b"no room"))));
    release.send(()).unwrap();
    let deadline = Instant::now() + Duration::from_secs(10);
    while inlet.progress().queued_bytes > 0 {
        assert!(Instant::now() < deadline);
        std::thread::yield_now();
    }
    assert!(inlet.offer(topic, 3, 60, || Some(string_message(b"room again"))));
    let progress = writer.finish().unwrap();
    assert_eq!((progress.written, progress.dropped), (2, 1));
    assert!(!inlet.offer(topic, 4, 1, || Some(string_message(b"too late"))));
    assert_eq!(inlet.progress().dropped, 2);
}

#[test]
fn what_was_offered_a_second_ago_outlives_the_process() {
    let scratch = tempfile::tempdir().unwrap();
    let folder = scratch.path().join("bag");
    let file = folder.join("bag.mcap");
    let (bag, topic) = create(&folder);
    let writer = BackgroundWriter::start(bag, 1 << 20, || panic!("nothing fails")).unwrap();
    let inlet = writer.inlet();
    let offered = Instant::now();
    inlet.offer(topic, 5, 20, || Some(string_message(b"small")));
    // Another process sees what this one has handed to the system, as it would after a kill.
    let deadline = offered + Duration::from_secs(10);
    while Bag::open(&file).unwrap().report().messages == 0 {
        assert!(Instant::now() < deadline, "not in the file");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(
        offered.elapsed() > Duration::from_millis(900),
        "small messages are gathered"
    );
    assert!(offered.elapsed() < Duration::from_secs(3), "{:?}", offered.elapsed());
    writer.finish().unwrap();
}

#[test]
fn the_writer_gives_way_to_others() {
    let scratch = tempfile::tempdir().unwrap();
    let (bag, topic) = create(&scratch.path().join("bag"));
    let writer = BackgroundWriter::start(bag, 1 << 20, || panic!("nothing fails")).unwrap();
    let (report, niceness) = mpsc::channel();
    writer.inlet().offer(topic, 5, 1, move || {
        // The nineteenth field of the thread's own stat is its niceness.
        let stat = std::fs::read_to_string("/proc/thread-self/stat").ok()?;
        let (_, rest) = stat.rsplit_once(") ")?;
        report.send(rest.split(' ').nth(16)?.to_owned()).ok()?;
        None
    });
    assert_eq!(niceness.recv_timeout(Duration::from_secs(10)).unwrap(), "10");
    writer.finish().unwrap();
}
