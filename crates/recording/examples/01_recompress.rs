//! Copies a bag, keeping topics, messages and times; whatever its chunks were, the copy's are compressed with zstd.
//!
//! ```text
//! cargo run -p recording --example 01_recompress -- BAG NEW_FOLDER
//! ```

use std::collections::HashMap;

use recording::{Bag, BagWriter};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(from), Some(to), None) = (arguments.next(), arguments.next(), arguments.next()) else {
        anyhow::bail!("usage: 01_recompress BAG NEW_FOLDER");
    };
    let bag = Bag::open(from)?;
    let mut writer = BagWriter::create(&to)?;
    let mut ids = HashMap::new();
    for topic in bag.topics() {
        anyhow::ensure!(
            topic.message_encoding == "cdr",
            "{} is {}, not cdr",
            topic.name,
            topic.message_encoding
        );
        let id = writer.add_topic(&topic.name, &topic.type_name, &topic.definition, &topic.options)?;
        ids.insert(topic.name.clone(), id);
    }
    for message in bag.messages() {
        let message = message?;
        writer.write(ids[&message.topic.name], message.log_time, &message.cdr)?;
    }
    writer.finish()?;
    for damage in &bag.report().damage {
        eprintln!("not copied: {damage}");
    }
    println!("{}: {} messages", to.display(), bag.report().messages);
    Ok(())
}
