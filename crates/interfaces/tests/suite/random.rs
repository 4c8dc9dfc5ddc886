//! Random messages of any type: a deserialiser that invents its input.

use std::fmt::Display;

use interfaces::Message;
use serde::de::{self, DeserializeSeed, IntoDeserializer, SeqAccess, Visitor};

/// A repeatable stream of numbers (splitmix64).
pub(crate) struct Numbers(u64);

impl Numbers {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    pub(crate) fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.next() as u8).collect()
    }

    /// Zero, all ones and plain numbers all occur often.
    fn integer(&mut self) -> u64 {
        match self.below(6) {
            0 => 0,
            1 => u64::MAX,
            2 => self.next() % 100,
            _ => self.next(),
        }
    }

    /// Finite, so that values can be compared and written as JSON.
    fn double(&mut self) -> f64 {
        match self.below(6) {
            0 => 0.0,
            1 => -1.5,
            _ => (self.next() as i64 as f64) * 2f64.powi(self.below(120) as i32 - 100),
        }
    }

    fn text(&mut self) -> String {
        const LETTERS: [char; 8] = ['a', 'Z', '0', ' ', '"', 'é', '☃', '\n'];
        (0..self.below(4)).map(|_| LETTERS[self.below(LETTERS.len())]).collect()
    }
}

/// A random message. Values that exceed a bound are thrown away and drawn again.
pub(crate) fn random_message<M: Message>(seed: u64) -> M {
    let mut numbers = Numbers::new(seed);
    for _ in 0..10_000 {
        if let Ok(message) = M::deserialize(Inventor(&mut numbers)) {
            return message;
        }
    }
    panic!("no random {} was within its bounds", M::TYPE_NAME)
}

struct Inventor<'a>(&'a mut Numbers);

#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Refused(String);

impl de::Error for Refused {
    fn custom<T: Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

macro_rules! invent {
    ($($method:ident $visit:ident $kind:ty),*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
            visitor.$visit(self.0.integer() as $kind)
        })*
    };
}

impl<'de> de::Deserializer<'de> for Inventor<'_> {
    type Error = Refused;

    invent!(
        deserialize_i8 visit_i8 i8, deserialize_i16 visit_i16 i16, deserialize_i32 visit_i32 i32,
        deserialize_i64 visit_i64 i64, deserialize_u8 visit_u8 u8, deserialize_u16 visit_u16 u16,
        deserialize_u32 visit_u32 u32, deserialize_u64 visit_u64 u64
    );

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Refused> {
        panic!("generated types never ask for any type")
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_bool(self.0.next() & 1 == 1)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_f32(self.0.double() as f32)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_f64(self.0.double())
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_string(self.0.text())
    }

    fn deserialize_byte_buf<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        let count = self.0.below(6);
        visitor.visit_byte_buf(self.0.bytes(count))
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        let left = self.0.below(4);
        visitor.visit_seq(Elements { numbers: self.0, left })
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, left: usize, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_seq(Elements { numbers: self.0, left })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        // The one byte of an empty message is always 0.
        if fields == ["structure_needs_at_least_one_member"] {
            return visitor.visit_seq(de::value::SeqDeserializer::new(std::iter::once(
                0u8.into_deserializer(),
            )));
        }
        visitor.visit_seq(Elements {
            numbers: self.0,
            left: fields.len(),
        })
    }

    serde::forward_to_deserialize_any! {
        char str bytes option unit unit_struct newtype_struct tuple_struct map enum identifier ignored_any
    }
}

struct Elements<'a> {
    numbers: &'a mut Numbers,
    left: usize,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = Refused;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Refused> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(Inventor(self.numbers)).map(Some)
    }
}
