//! Types and values of single fields and constants, as Rust expressions.

use super::is_byte;
use crate::model::{Count, Element, Field, Primitive, TypeName, Value};

/// The Rust type of a field, seen from a module two levels below the packages.
pub(super) fn rust_type(field: &Field, written: &[&str], runtime: &str) -> String {
    let element = match &field.element {
        Element::Primitive(primitive) => primitive_type(*primitive).to_owned(),
        Element::Text { .. } => "::std::string::String".to_owned(),
        Element::Message(name) => message_type(name, written, runtime),
    };
    match field.count {
        Count::One => element,
        Count::Fixed(length) => format!("[{element}; {length}]"),
        Count::Bounded(_) | Count::Unbounded if is_byte(&field.element) => format!("{runtime}::ByteSequence"),
        Count::Bounded(_) | Count::Unbounded => format!("::std::vec::Vec<{element}>"),
    }
}

fn message_type(name: &TypeName, written: &[&str], runtime: &str) -> String {
    let root = if written.contains(&name.package.as_str()) {
        "super::super"
    } else {
        runtime
    };
    format!("{root}::{}::{}::{}", name.package, name.kind.name(), name.rust_name())
}

/// The Rust type of a constant.
pub(super) fn constant_type(element: &Element) -> &'static str {
    match element {
        Element::Primitive(primitive) => primitive_type(*primitive),
        Element::Text { .. } | Element::Message(_) => "&'static str",
    }
}

fn primitive_type(primitive: Primitive) -> &'static str {
    match primitive {
        Primitive::Bool => "bool",
        Primitive::Byte | Primitive::Char | Primitive::Uint8 => "u8",
        Primitive::Float32 => "f32",
        Primitive::Float64 => "f64",
        Primitive::Int8 => "i8",
        Primitive::Int16 => "i16",
        Primitive::Int32 => "i32",
        Primitive::Int64 => "i64",
        Primitive::Uint16 => "u16",
        Primitive::Uint32 => "u32",
        Primitive::Uint64 => "u64",
    }
}

/// What a field holds before anybody sets it.
pub(super) fn default_expression(field: &Field, runtime: &str) -> String {
    let Some(value) = &field.default else {
        return zero_expression(field.count);
    };
    let Value::List(items) = value else {
        return owned_expression(&field.element, value);
    };
    let items: Vec<_> = items
        .iter()
        .map(|item| owned_expression(&field.element, item))
        .collect();
    let items = items.join(", ");
    match field.count {
        Count::One | Count::Fixed(_) => format!("[{items}]"),
        _ if is_byte(&field.element) => format!("{runtime}::ByteSequence::from(::std::vec![{items}])"),
        _ => format!("::std::vec![{items}]"),
    }
}

fn zero_expression(count: Count) -> String {
    let zero = "::core::default::Default::default()";
    match count {
        Count::Fixed(_) => format!("::core::array::from_fn(|_| {zero})"),
        _ => zero.to_owned(),
    }
}

fn owned_expression(element: &Element, value: &Value) -> String {
    let literal = scalar_expression(element, value);
    match element {
        Element::Text { .. } => format!("::std::string::String::from({literal})"),
        _ => literal,
    }
}

/// One value as a constant expression.
pub(super) fn scalar_expression(element: &Element, value: &Value) -> String {
    match value {
        Value::Bool(value) => value.to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Float(value) => float_expression(*value, constant_type(element)),
        Value::Text(value) => format!("{value:?}"),
        Value::List(items) => {
            let items: Vec<_> = items.iter().map(|item| scalar_expression(element, item)).collect();
            format!("[{}]", items.join(", "))
        }
    }
}

fn float_expression(value: f64, float_type: &str) -> String {
    if value.is_nan() {
        format!("{float_type}::NAN")
    } else if value.is_infinite() {
        format!("{float_type}::{}INFINITY", if value < 0.0 { "NEG_" } else { "" })
    } else {
        format!("{value:?}_{float_type}")
    }
}
