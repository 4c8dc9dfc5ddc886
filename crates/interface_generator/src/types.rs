//! The type at the head of a line: text to [`Element`] and [`Count`].

use crate::error::Problem;
use crate::model::{Count, Element, Kind, Primitive, TypeName};
use crate::names::{is_interface_name, is_lower_name};

/// Reads a type such as `string<=8[<=3]`; `package` is where unqualified names are looked for.
pub(crate) fn parse_type(text: &str, package: &str) -> Result<(Element, Count), Problem> {
    let wrong = || Problem::Type { found: text.to_owned() };
    let (base, count) = match text.strip_suffix(']') {
        None => (text, Count::One),
        Some(rest) => {
            let (base, length) = rest.rsplit_once('[').ok_or_else(wrong)?;
            (base, parse_count(length)?)
        }
    };
    if base.contains(['[', ']']) {
        return Err(wrong());
    }
    Ok((parse_element(base, text, package)?, count))
}

fn parse_count(text: &str) -> Result<Count, Problem> {
    if text.is_empty() {
        return Ok(Count::Unbounded);
    }
    match text.strip_prefix("<=") {
        Some(bound) => parse_bound(bound).map(Count::Bounded),
        None => parse_bound(text).map(Count::Fixed),
    }
}

fn parse_bound(text: &str) -> Result<usize, Problem> {
    match text.parse::<u32>() {
        Ok(bound) if bound > 0 && !text.starts_with('+') => Ok(bound as usize),
        _ => Err(Problem::Bound { found: text.to_owned() }),
    }
}

fn parse_element(base: &str, whole: &str, package: &str) -> Result<Element, Problem> {
    let (name, bound) = match base.split_once("<=") {
        None => (base, None),
        Some((name, bound)) => (name, Some(parse_bound(bound)?)),
    };
    let found = || whole.to_owned();
    match name {
        "string" => return Ok(Element::Text { bound }),
        "wstring" => return Err(Problem::WideString { found: found() }),
        _ if bound.is_some() => return Err(Problem::Type { found: found() }),
        "time" => {
            return Err(Problem::RosOneType {
                found: found(),
                instead: "Time",
            });
        }
        "duration" => {
            return Err(Problem::RosOneType {
                found: found(),
                instead: "Duration",
            });
        }
        _ => {}
    }
    if let Some(primitive) = parse_primitive(name) {
        return Ok(Element::Primitive(primitive));
    }
    parse_message_name(name, package)
        .map(Element::Message)
        .ok_or_else(|| Problem::Type { found: found() })
}

fn parse_primitive(name: &str) -> Option<Primitive> {
    Some(match name {
        "bool" => Primitive::Bool,
        "byte" => Primitive::Byte,
        "char" => Primitive::Char,
        "float32" => Primitive::Float32,
        "float64" => Primitive::Float64,
        "int8" => Primitive::Int8,
        "int16" => Primitive::Int16,
        "int32" => Primitive::Int32,
        "int64" => Primitive::Int64,
        "uint8" => Primitive::Uint8,
        "uint16" => Primitive::Uint16,
        "uint32" => Primitive::Uint32,
        "uint64" => Primitive::Uint64,
        _ => return None,
    })
}

fn parse_message_name(text: &str, package: &str) -> Option<TypeName> {
    let words: Vec<&str> = text.split('/').collect();
    let (package, name) = match words[..] {
        [name] => (package, name),
        [package, name] | [package, "msg", name] => (package, name),
        _ => return None,
    };
    let right = is_lower_name(package) && is_interface_name(name);
    right.then(|| TypeName {
        package: package.to_owned(),
        kind: Kind::Msg,
        name: name.to_owned(),
    })
}
