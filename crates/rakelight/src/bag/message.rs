//! What can be known of a serialised message.

use std::collections::BTreeMap;

use interfaces::{Message, MessageVisitor, cdr};
use recording::{RawMessage, Topic};

type Decode = fn(&[u8]) -> Result<(), cdr::Error>;

/// Decoders of every type of the cell.
pub(super) struct Decoders(BTreeMap<&'static str, Decode>);

impl Decoders {
    pub(super) fn new() -> Self {
        let mut decoders = Self(BTreeMap::new());
        interfaces::visit_messages(&mut decoders);
        decoders
    }

    /// Whether messages of the topic can be decoded at all.
    pub(super) fn know(&self, topic: &Topic) -> bool {
        topic.message_encoding == "cdr" && self.0.contains_key(topic.type_name.as_str())
    }

    /// Decodes a message of a type that is known.
    pub(super) fn check(&self, message: &RawMessage) -> Result<(), cdr::Error> {
        let decode = self.0.get(message.topic.type_name.as_str());
        decode.map_or(Ok(()), |decode| decode(&message.cdr))
    }
}

impl MessageVisitor for Decoders {
    fn visit<M: Message>(&mut self) {
        self.0
            .insert(M::TYPE_NAME, |bytes| cdr::from_slice::<M>(bytes).map(drop));
    }
}

/// The stamp of a message that begins with a header, nanoseconds; other messages have none.
pub(crate) fn header_stamp(message: &RawMessage) -> Option<i64> {
    begins_with_header(&message.topic)
        .then(|| first_stamp(&message.cdr))
        .flatten()
}

/// Whether the first field is a `std_msgs/Header`.
fn begins_with_header(topic: &Topic) -> bool {
    let fields = topic
        .definition
        .lines()
        .map(|line| line.split('#').next().unwrap_or("").trim());
    let first = fields.into_iter().find(|line| !line.is_empty() && !line.contains('='));
    let kind = first.and_then(|line| line.split_whitespace().next());
    topic.message_encoding == "cdr" && matches!(kind, Some("std_msgs/Header" | "std_msgs/msg/Header" | "Header"))
}

/// Seconds and nanoseconds right behind the encapsulation header.
fn first_stamp(cdr: &[u8]) -> Option<i64> {
    let (header, body) = cdr.split_first_chunk::<4>()?;
    let (seconds, rest) = body.split_first_chunk::<4>()?;
    let nanos = rest.first_chunk::<4>()?;
    let (seconds, nanos) = if header[1] & 1 == 1 {
        (i32::from_le_bytes(*seconds), u32::from_le_bytes(*nanos))
    } else {
        (i32::from_be_bytes(*seconds), u32::from_be_bytes(*nanos))
    };
    Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanos))
}
