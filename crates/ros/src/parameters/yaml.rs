//! YAML with places: what stands where, and what parameter value it is.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde_yaml_ng::Value;

use super::value::{ParameterKind, ParameterType, ParameterValue};

/// What a parameter's value may be, for errors.
pub(crate) const ALLOWED_VALUES: &str = "true or false, a number, text, or a list of one of these types";

/// Turns a YAML value into a parameter's; the error says what was found.
pub(crate) fn parameter_value(value: &Value) -> Result<ParameterValue, String> {
    match value {
        Value::Bool(value) => Ok((*value).into()),
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(integer), _) => Ok(integer.into()),
            (None, Some(float)) if !number.is_u64() => Ok(float.into()),
            _ => Err(format!("{number}, a whole number beyond 64 bits with sign")),
        },
        Value::String(text) => Ok(text.as_str().into()),
        Value::Sequence(elements) => list(elements),
        Value::Null => Err("nothing".into()),
        Value::Mapping(_) => Err("a map".into()),
        Value::Tagged(tagged) => Err(format!("the tag {}", tagged.tag)),
    }
}

fn list(elements: &[Value]) -> Result<ParameterValue, String> {
    let elements: Vec<ParameterValue> = elements
        .iter()
        .map(parameter_value)
        .collect::<Result<_, _>>()
        .map_err(|found| format!("{found} in a list"))?;
    // Without elements the list has no type yet; `ParameterValue::written_as` gives it the declared one.
    all_of::<String>(&elements)
        .or_else(|| all_of::<bool>(&elements))
        .or_else(|| all_of::<i64>(&elements))
        .or_else(|| all_of::<f64>(&elements))
        .ok_or_else(|| "a list of different types".to_owned())
}

/// The elements as one list; whole numbers among floats are floats.
fn all_of<T: ParameterKind>(elements: &[ParameterValue]) -> Option<ParameterValue>
where
    ParameterValue: From<Vec<T>>,
{
    let numbers = T::TYPE == ParameterType::Float;
    let one = |element: &ParameterValue| {
        if numbers {
            T::from_value(&element.clone().written_as(T::TYPE))
        } else {
            T::from_value(element)
        }
    };
    elements
        .iter()
        .map(one)
        .collect::<Option<Vec<T>>>()
        .map(ParameterValue::from)
}

/// The line (from 1) of the key at the end of `path`, where the YAML has it.
///
/// The parser tells a place only with an error, so this reads the text again and fails on purpose at that key.
pub(crate) fn line_of(text: &str, path: &[&str]) -> Option<usize> {
    let stopped = Walk(path)
        .deserialize(serde_yaml_ng::Deserializer::from_str(text))
        .err()?;
    stopped.location().map(|location| location.line())
}

struct Walk<'a>(&'a [&'a str]);

impl<'de> DeserializeSeed<'de> for Walk<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a map")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Some((wanted, rest)) = self.0.split_first() else {
            return Ok(());
        };
        while let Some(found) = map.next_key_seed(Key {
            wanted,
            is_last: rest.is_empty(),
        })? {
            if found {
                map.next_value_seed(Walk(rest))?;
            } else {
                map.next_value::<IgnoredAny>().map(drop)?;
            }
        }
        Ok(())
    }
}

/// Whether a key is the wanted one; fails there when it is the last of the path.
struct Key<'a> {
    wanted: &'a str,
    is_last: bool,
}

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = bool;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<bool, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl Visitor<'_> for Key<'_> {
    type Value = bool;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key")
    }

    fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<bool, E> {
        match key == self.wanted {
            true if self.is_last => Err(E::custom("found")),
            found => Ok(found),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<ParameterValue, String> {
        parameter_value(&serde_yaml_ng::from_str(text).unwrap())
    }

    #[test]
    fn yaml_becomes_the_types_that_ros_knows() {
        assert_eq!(value("true").unwrap(), true.into());
        assert_eq!(value("3").unwrap(), 3_i64.into());
        assert_eq!(value("3.0").unwrap(), 3.0.into());
        assert_eq!(value("hello").unwrap(), "hello".into());
        assert_eq!(value("[1, 2]").unwrap(), vec![1_i64, 2].into());
        assert_eq!(value("[1, 2.5]").unwrap(), vec![1.0, 2.5].into());
        assert_eq!(value("[a, b]").unwrap(), vec!["a".to_owned(), "b".to_owned()].into());
        assert_eq!(value("[]").unwrap(), Vec::<String>::new().into());
    }

    #[test]
    fn what_ros_has_no_type_for_is_named() {
        for (text, found) in [
            ("~", "nothing"),
            ("{a: 1}", "a map"),
            ("[1, a]", "different types"),
            ("[[1], [2]]", "different types"),
            ("[~]", "nothing in a list"),
            ("!x 1", "the tag !x"),
            ("18446744073709551615", "beyond 64 bits"),
        ] {
            let error = value(text).unwrap_err();
            assert!(error.contains(found), "{text}: {error}");
        }
    }

    #[test]
    fn lines_of_keys_are_found() {
        let text = "a:\n  b: 1\n  c:\n    d: [1,\n      2]\n    e: 2\nb: 3\n";
        assert_eq!(line_of(text, &["a"]), Some(1));
        assert_eq!(line_of(text, &["a", "b"]), Some(2));
        assert_eq!(line_of(text, &["a", "c", "e"]), Some(6));
        assert_eq!(line_of(text, &["b"]), Some(7));
        assert_eq!(line_of(text, &["a", "x"]), None);
    }
}
