//! Writes noise into a bag until the disk refuses, as a recorder would, and says what became of it.
//!
//! ```text
//! cargo run -p recording --example 02_fill_disk -- NEW_FOLDER MAX_MEGABYTES
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use recording::{BackgroundWriter, Bag, BagWriter, OfferedQos};

const MESSAGE_BYTES: usize = 300_000;

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, limit] = arguments.as_slice() else {
        anyhow::bail!("usage: 02_fill_disk NEW_FOLDER MAX_MEGABYTES");
    };
    let messages = limit.parse::<usize>()? * 1_000_000 / MESSAGE_BYTES;
    let mut bag = BagWriter::create(folder)?;
    let topic = bag.add_topic(
        "/noise",
        "std_msgs/msg/String",
        "string data\n",
        &OfferedQos::default().into(),
    )?;
    let failed = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&failed);
    let writer = BackgroundWriter::start(bag, 64 << 20, move || told.store(true, Ordering::Relaxed))?;
    let inlet = writer.inlet();
    let mut random = fastrand::Rng::with_seed(5);
    for index in 0..messages {
        let mut cdr = [&[0, 1, 0, 0], (MESSAGE_BYTES as u32).to_le_bytes().as_slice()].concat();
        cdr.extend((1..MESSAGE_BYTES).map(|_| random.u8(1..)));
        cdr.push(0);
        inlet.offer(topic, index as u64 + 1, cdr.len(), move || Some(cdr));
    }
    let outcome = writer.finish();
    let progress = inlet.progress();
    println!("told: {}", failed.load(Ordering::Relaxed));
    println!(
        "failure: {}",
        outcome.err().map_or_else(String::new, |error| error.to_string())
    );
    println!("safe: {}, offered: {messages}", progress.safe_messages);
    println!(
        "lost: {}",
        messages as u64 - progress.written + (progress.written - progress.safe_messages)
    );
    let bag = Bag::open(folder)?;
    println!("read: {}", bag.report().messages);
    for damage in &bag.report().damage {
        println!("damage: {damage}");
    }
    Ok(())
}
