//! Values of parameters and their types, and both as they travel.

use std::fmt;

use interfaces::rcl_interfaces::msg::{self, ParameterType as WireType};

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterValue {
    /// Yes or no.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Float(f64),
    /// Text.
    String(String),
    /// Raw bytes.
    Bytes(Vec<u8>),
    /// Several yes or no.
    Bools(Vec<bool>),
    /// Several whole numbers.
    Integers(Vec<i64>),
    /// Several numbers.
    Floats(Vec<f64>),
    /// Several texts.
    Strings(Vec<String>),
}

/// The type of a parameter; it never changes after the declaration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterType {
    /// [`ParameterValue::Bool`].
    Bool,
    /// [`ParameterValue::Integer`].
    Integer,
    /// [`ParameterValue::Float`].
    Float,
    /// [`ParameterValue::String`].
    String,
    /// [`ParameterValue::Bytes`].
    Bytes,
    /// [`ParameterValue::Bools`].
    Bools,
    /// [`ParameterValue::Integers`].
    Integers,
    /// [`ParameterValue::Floats`].
    Floats,
    /// [`ParameterValue::Strings`].
    Strings,
}

impl ParameterType {
    /// The number that stands for the type in `rcl_interfaces`.
    pub(crate) fn to_wire(self) -> u8 {
        match self {
            Self::Bool => WireType::PARAMETER_BOOL,
            Self::Integer => WireType::PARAMETER_INTEGER,
            Self::Float => WireType::PARAMETER_DOUBLE,
            Self::String => WireType::PARAMETER_STRING,
            Self::Bytes => WireType::PARAMETER_BYTE_ARRAY,
            Self::Bools => WireType::PARAMETER_BOOL_ARRAY,
            Self::Integers => WireType::PARAMETER_INTEGER_ARRAY,
            Self::Floats => WireType::PARAMETER_DOUBLE_ARRAY,
            Self::Strings => WireType::PARAMETER_STRING_ARRAY,
        }
    }
}

impl fmt::Display for ParameterType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bool => "bool",
            Self::Integer => "integer",
            Self::Float => "float",
            Self::String => "string",
            Self::Bytes => "byte array",
            Self::Bools => "bool array",
            Self::Integers => "integer array",
            Self::Floats => "float array",
            Self::Strings => "string array",
        })
    }
}

impl ParameterValue {
    /// Its type.
    pub fn parameter_type(&self) -> ParameterType {
        match self {
            Self::Bool(_) => ParameterType::Bool,
            Self::Integer(_) => ParameterType::Integer,
            Self::Float(_) => ParameterType::Float,
            Self::String(_) => ParameterType::String,
            Self::Bytes(_) => ParameterType::Bytes,
            Self::Bools(_) => ParameterType::Bools,
            Self::Integers(_) => ParameterType::Integers,
            Self::Floats(_) => ParameterType::Floats,
            Self::Strings(_) => ParameterType::Strings,
        }
    }

    /// As `rcl_interfaces` carries it.
    pub(crate) fn to_wire(&self) -> msg::ParameterValue {
        let mut wire = msg::ParameterValue {
            type_: self.parameter_type().to_wire(),
            ..Default::default()
        };
        match self.clone() {
            Self::Bool(value) => wire.bool_value = value,
            Self::Integer(value) => wire.integer_value = value,
            Self::Float(value) => wire.double_value = value,
            Self::String(value) => wire.string_value = value,
            Self::Bytes(value) => wire.byte_array_value = value.into(),
            Self::Bools(value) => wire.bool_array_value = value,
            Self::Integers(value) => wire.integer_array_value = value,
            Self::Floats(value) => wire.double_array_value = value,
            Self::Strings(value) => wire.string_array_value = value,
        }
        wire
    }

    /// From `rcl_interfaces`; `None` for "not set" and for numbers that stand for no type.
    pub(crate) fn from_wire(wire: &msg::ParameterValue) -> Option<Self> {
        Some(match wire.type_ {
            WireType::PARAMETER_BOOL => Self::Bool(wire.bool_value),
            WireType::PARAMETER_INTEGER => Self::Integer(wire.integer_value),
            WireType::PARAMETER_DOUBLE => Self::Float(wire.double_value),
            WireType::PARAMETER_STRING => Self::String(wire.string_value.clone()),
            WireType::PARAMETER_BYTE_ARRAY => Self::Bytes(wire.byte_array_value.to_vec()),
            WireType::PARAMETER_BOOL_ARRAY => Self::Bools(wire.bool_array_value.clone()),
            WireType::PARAMETER_INTEGER_ARRAY => Self::Integers(wire.integer_array_value.clone()),
            WireType::PARAMETER_DOUBLE_ARRAY => Self::Floats(wire.double_array_value.clone()),
            WireType::PARAMETER_STRING_ARRAY => Self::Strings(wire.string_array_value.clone()),
            _ => return None,
        })
    }

    /// The same value where people write a whole number and mean a float (`1` for `1.0`), or an empty array.
    ///
    /// For configuration files only: over the wire a client says what type it means.
    pub(crate) fn written_as(self, wanted: ParameterType) -> Self {
        match (self, wanted) {
            (Self::Integer(value), ParameterType::Float) => Self::Float(value as f64),
            (Self::Integers(values), ParameterType::Floats) => {
                Self::Floats(values.into_iter().map(|value| value as f64).collect())
            }
            (value, wanted) if value.is_empty_array() => match wanted {
                ParameterType::Bytes => Self::Bytes(Vec::new()),
                ParameterType::Bools => Self::Bools(Vec::new()),
                ParameterType::Integers => Self::Integers(Vec::new()),
                ParameterType::Floats => Self::Floats(Vec::new()),
                ParameterType::Strings => Self::Strings(Vec::new()),
                _ => value,
            },
            (value, _) => value,
        }
    }

    fn is_empty_array(&self) -> bool {
        match self {
            Self::Bytes(values) => values.is_empty(),
            Self::Bools(values) => values.is_empty(),
            Self::Integers(values) => values.is_empty(),
            Self::Floats(values) => values.is_empty(),
            Self::Strings(values) => values.is_empty(),
            Self::Bool(_) | Self::Integer(_) | Self::Float(_) | Self::String(_) => false,
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value:?}"),
            Self::String(value) => write!(f, "{value:?}"),
            Self::Bytes(values) => write!(f, "{} bytes", values.len()),
            Self::Bools(values) => write!(f, "{values:?}"),
            Self::Integers(values) => write!(f, "{values:?}"),
            Self::Floats(values) => write!(f, "{values:?}"),
            Self::Strings(values) => write!(f, "{values:?}"),
        }
    }
}

/// The Rust types that a parameter can have.
pub trait ParameterKind: Clone + PartialEq + Send + Sync + 'static {
    /// The type it is declared as.
    const TYPE: ParameterType;

    /// Wraps a value.
    fn into_value(self) -> ParameterValue;

    /// Unwraps a value; `None` when it is of another type.
    fn from_value(value: &ParameterValue) -> Option<Self>;
}

macro_rules! kinds {
    ($($rust:ty => $variant:ident),* $(,)?) => { $(
        impl ParameterKind for $rust {
            const TYPE: ParameterType = ParameterType::$variant;

            fn into_value(self) -> ParameterValue {
                ParameterValue::$variant(self)
            }

            fn from_value(value: &ParameterValue) -> Option<Self> {
                match value {
                    ParameterValue::$variant(value) => Some(value.clone()),
                    _ => None,
                }
            }
        }

        impl From<$rust> for ParameterValue {
            fn from(value: $rust) -> Self {
                Self::$variant(value)
            }
        }
    )* };
}

kinds!(
    bool => Bool,
    i64 => Integer,
    f64 => Float,
    String => String,
    Vec<u8> => Bytes,
    Vec<bool> => Bools,
    Vec<i64> => Integers,
    Vec<f64> => Floats,
    Vec<String> => Strings,
);

impl From<&str> for ParameterValue {
    fn from(value: &str) -> Self {
        Self::String(value.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_travels_and_comes_back() {
        let values = [
            ParameterValue::from(true),
            (-7_i64).into(),
            0.25.into(),
            "software".into(),
            vec![1_u8, 255].into(),
            vec![true, false].into(),
            vec![i64::MIN, 0].into(),
            vec![0.5, -1.0].into(),
            vec!["a".to_owned(), String::new()].into(),
        ];
        for value in values {
            let wire = value.to_wire();
            assert_eq!(wire.type_, value.parameter_type().to_wire());
            assert_eq!(ParameterValue::from_wire(&wire), Some(value));
        }
        assert_eq!(ParameterValue::from_wire(&msg::ParameterValue::default()), None);
        assert_eq!(
            ParameterValue::from_wire(&msg::ParameterValue {
                type_: 77,
                ..Default::default()
            }),
            None
        );
    }

    #[test]
    fn whole_numbers_and_empty_lists_in_files_take_the_declared_type() {
        let written = |value: ParameterValue, wanted| value.written_as(wanted);
        assert_eq!(written(3_i64.into(), ParameterType::Float), 3.0.into());
        assert_eq!(
            written(vec![1_i64, 2].into(), ParameterType::Floats),
            vec![1.0, 2.0].into()
        );
        assert_eq!(
            written(Vec::<String>::new().into(), ParameterType::Floats),
            Vec::<f64>::new().into()
        );
        assert_eq!(written(0.5.into(), ParameterType::Integer), 0.5.into());
        assert_eq!(written("3".into(), ParameterType::Float), "3".into());
    }
}
