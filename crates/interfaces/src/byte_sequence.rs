//! `uint8[]` without copies.

use std::fmt;
use std::ops::Deref;

use bytes::Bytes;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The bytes of a `uint8[]`, `byte[]` or `char[]` field, such as an image's pixels.
///
/// A clone shares the bytes. On the wire they are one block instead of one element at a time, with the same result:
/// a 32-bit length and the bytes.
///
/// ```
/// use interfaces::ByteSequence;
/// let pixels = ByteSequence::from(vec![1, 2, 3]);
/// assert_eq!((pixels.len(), pixels[2]), (3, 3));
/// ```
#[derive(Clone, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ByteSequence(Bytes);

impl ByteSequence {
    /// No bytes.
    pub const fn new() -> Self {
        Self(Bytes::new())
    }

    /// Shares the bytes of `owner` without copying them; the last clone drops it.
    ///
    /// A type that is not bytes itself needs a wrapper whose `as_ref` looks at it as bytes:
    ///
    /// ```
    /// use interfaces::ByteSequence;
    /// struct Words(Vec<[u8; 4]>);
    /// impl AsRef<[u8]> for Words {
    ///     fn as_ref(&self) -> &[u8] {
    ///         self.0.as_flattened()
    ///     }
    /// }
    /// let bytes = ByteSequence::from_owner(Words(vec![[1, 0, 0, 0], [2, 0, 0, 0]]));
    /// assert_eq!(bytes[4], 2);
    /// ```
    pub fn from_owner(owner: impl AsRef<[u8]> + Send + 'static) -> Self {
        Self(Bytes::from_owner(owner))
    }

    /// The shared bytes.
    pub fn into_bytes(self) -> Bytes {
        self.0
    }
}

impl Deref for ByteSequence {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl AsRef<[u8]> for ByteSequence {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl fmt::Debug for ByteSequence {
    /// The first bytes and how many there are: nobody wants to read 28 million numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = &self.0[..self.0.len().min(16)];
        let more = if shown.len() < self.0.len() { ", .." } else { "" };
        write!(f, "ByteSequence({} bytes: {shown:02x?}{more})", self.0.len())
    }
}

impl From<Vec<u8>> for ByteSequence {
    fn from(bytes: Vec<u8>) -> Self {
        Self(bytes.into())
    }
}

impl From<Bytes> for ByteSequence {
    fn from(bytes: Bytes) -> Self {
        Self(bytes)
    }
}

impl From<&[u8]> for ByteSequence {
    fn from(bytes: &[u8]) -> Self {
        Self(Bytes::copy_from_slice(bytes))
    }
}

impl From<ByteSequence> for Bytes {
    fn from(bytes: ByteSequence) -> Self {
        bytes.0
    }
}

impl FromIterator<u8> for ByteSequence {
    fn from_iter<I: IntoIterator<Item = u8>>(bytes: I) -> Self {
        Self(bytes.into_iter().collect())
    }
}

impl Serialize for ByteSequence {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for ByteSequence {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_byte_buf(BytesVisitor)
    }
}

struct BytesVisitor;

impl<'de> Visitor<'de> for BytesVisitor {
    type Value = ByteSequence;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a sequence of bytes")
    }

    fn visit_bytes<E>(self, bytes: &[u8]) -> Result<ByteSequence, E> {
        Ok(bytes.into())
    }

    fn visit_byte_buf<E>(self, bytes: Vec<u8>) -> Result<ByteSequence, E> {
        Ok(bytes.into())
    }

    /// Text formats such as JSON hold a list of numbers.
    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<ByteSequence, A::Error> {
        let mut bytes = Vec::new();
        while let Some(byte) = sequence.next_element()? {
            bytes.push(byte);
        }
        Ok(bytes.into())
    }
}
