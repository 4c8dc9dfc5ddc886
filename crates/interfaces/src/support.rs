//! What generated code needs beside the traits: fixed arrays of any length, and bounds.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub use serde;

use crate::{ByteSequence, Message};

/// Fixed arrays of any length, for `#[serde(with)]`; serde's own stop at 32 elements.
pub mod array {
    use std::fmt;
    use std::marker::PhantomData;

    use serde::de::{Deserialize, Deserializer, Error, SeqAccess, Visitor};
    use serde::ser::{Serialize, SerializeTuple, Serializer};

    /// Writes the elements without a length.
    pub fn serialize<T: Serialize, S: Serializer, const N: usize>(
        array: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for element in array {
            tuple.serialize_element(element)?;
        }
        tuple.end()
    }

    /// Reads exactly `N` elements.
    pub fn deserialize<'de, T, D, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
    where
        T: Deserialize<'de> + Default,
        D: Deserializer<'de>,
    {
        deserializer.deserialize_tuple(N, ArrayVisitor(PhantomData))
    }

    struct ArrayVisitor<T, const N: usize>(PhantomData<T>);

    impl<'de, T: Deserialize<'de> + Default, const N: usize> Visitor<'de> for ArrayVisitor<T, N> {
        type Value = [T; N];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "an array of {N} elements")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[T; N], A::Error> {
            let mut array = std::array::from_fn(|_| T::default());
            for (index, slot) in array.iter_mut().enumerate() {
                *slot = sequence
                    .next_element()?
                    .ok_or_else(|| Error::invalid_length(index, &self))?;
            }
            Ok(array)
        }
    }
}

/// The bounds of one field, and where it is.
pub trait Bounds {
    /// The message's full ROS name.
    const TYPE_NAME: &'static str;
    /// The field.
    const FIELD: &'static str;
    /// The most elements, if the field is a bounded sequence.
    const SEQUENCE: Option<usize>;
    /// The most bytes of each text, if the field holds bounded strings.
    const TEXT: Option<usize>;
}

/// A value of a field that may have bounds.
pub trait Measured {
    /// How many elements it has; a value that is no sequence has none.
    fn elements(&self) -> usize;
    /// The bytes of its longest text.
    fn longest_text(&self) -> usize;
}

/// An element of a sequence that may have bounds.
pub trait Element {
    /// Its bytes, if it is text.
    fn text_length(&self) -> usize {
        0
    }
}

impl<M: Message> Element for M {}

macro_rules! elements_without_text {
    ($($element:ty),*) => { $(impl Element for $element {})* };
}

elements_without_text!(bool, u8, i8, i16, i32, i64, u16, u32, u64, f32, f64);

impl Element for String {
    fn text_length(&self) -> usize {
        self.len()
    }
}

impl Measured for String {
    fn elements(&self) -> usize {
        0
    }

    fn longest_text(&self) -> usize {
        self.len()
    }
}

impl Measured for ByteSequence {
    fn elements(&self) -> usize {
        self.len()
    }

    fn longest_text(&self) -> usize {
        0
    }
}

impl<E: Element> Measured for [E] {
    fn elements(&self) -> usize {
        self.len()
    }

    fn longest_text(&self) -> usize {
        self.iter().map(Element::text_length).max().unwrap_or(0)
    }
}

impl<E: Element> Measured for Vec<E> {
    fn elements(&self) -> usize {
        self.len()
    }

    fn longest_text(&self) -> usize {
        self.as_slice().longest_text()
    }
}

/// A field that is longer than its interface file allows.
#[derive(Debug, thiserror::Error)]
#[error("{type_name}: field `{field}` has {length} {what}; allowed: at most {bound}")]
struct TooLong {
    type_name: &'static str,
    field: &'static str,
    length: usize,
    what: &'static str,
    bound: usize,
}

fn check<B: Bounds>(value: &(impl Measured + ?Sized)) -> Result<(), TooLong> {
    let check_one = |length, bound: Option<usize>, what| match bound {
        Some(bound) if length > bound => Err(TooLong {
            type_name: B::TYPE_NAME,
            field: B::FIELD,
            length,
            what,
            bound,
        }),
        _ => Ok(()),
    };
    check_one(value.elements(), B::SEQUENCE, "elements")?;
    check_one(value.longest_text(), B::TEXT, "bytes of text")
}

/// Refuses a value beyond its bounds before it is written.
pub fn serialize_bounded<T, S, B>(value: &T, serializer: S) -> Result<S::Ok, S::Error>
where
    T: Measured + Serialize,
    S: Serializer,
    B: Bounds,
{
    check::<B>(value).map_err(serde::ser::Error::custom)?;
    value.serialize(serializer)
}

/// Refuses a value beyond its bounds after it was read.
pub fn deserialize_bounded<'de, T, D, B>(deserializer: D) -> Result<T, D::Error>
where
    T: Measured + Deserialize<'de>,
    D: Deserializer<'de>,
    B: Bounds,
{
    let value = T::deserialize(deserializer)?;
    check::<B>(&value).map_err(serde::de::Error::custom)?;
    Ok(value)
}

/// [`serialize_bounded`] for fixed arrays.
pub fn serialize_bounded_array<A, S, B>(value: &A, serializer: S) -> Result<S::Ok, S::Error>
where
    A: FixedArray,
    S: Serializer,
    B: Bounds,
{
    check::<B>(value.elements_slice()).map_err(serde::ser::Error::custom)?;
    value.write(serializer)
}

/// [`deserialize_bounded`] for fixed arrays.
pub fn deserialize_bounded_array<'de, A, D, B>(deserializer: D) -> Result<A, D::Error>
where
    A: FixedArray,
    D: Deserializer<'de>,
    B: Bounds,
{
    let value = A::read(deserializer)?;
    check::<B>(value.elements_slice()).map_err(serde::de::Error::custom)?;
    Ok(value)
}

/// A fixed array of bounded strings.
pub trait FixedArray: Sized {
    /// The strings.
    fn elements_slice(&self) -> &[String];
    /// Writes it without a length.
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error>;
    /// Reads it.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;
}

impl<const N: usize> FixedArray for [String; N] {
    fn elements_slice(&self) -> &[String] {
        self
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        array::serialize(self, serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        array::deserialize(deserializer)
    }
}
