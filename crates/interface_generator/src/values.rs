//! Constants' and defaults' values: text to [`Value`].

use crate::error::Problem;
use crate::model::{Count, Element, Primitive, Value};

/// Reads the value of one element; `text` has no surrounding spaces.
pub(crate) fn parse_scalar(element: &Element, text: &str) -> Result<Value, Problem> {
    match element {
        Element::Primitive(Primitive::Bool) => parse_bool(text),
        Element::Primitive(Primitive::Float32) => parse_float(text, f64::from(f32::MAX)),
        Element::Primitive(Primitive::Float64) => parse_float(text, f64::MAX),
        Element::Primitive(integer) => parse_integer(*integer, text),
        Element::Text { bound } => parse_text(text, *bound),
        Element::Message(_) => Err(Problem::DefaultOfMessage { found: text.to_owned() }),
    }
}

/// Reads a field's default.
pub(crate) fn parse_default(element: &Element, count: Count, text: &str) -> Result<Value, Problem> {
    if let Element::Message(_) = element {
        return Err(Problem::DefaultOfMessage { found: text.to_owned() });
    }
    if count == Count::One {
        return parse_scalar(element, text);
    }
    let values = split_list(text)?
        .into_iter()
        .map(|item| parse_scalar(element, item))
        .collect::<Result<Vec<_>, _>>()?;
    let found = values.len();
    match count {
        Count::Fixed(n) if found != n => Err(Problem::DefaultLength {
            found,
            allowed: format!("exactly {n}"),
        }),
        Count::Bounded(n) if found > n => Err(Problem::DefaultLength {
            found,
            allowed: format!("at most {n}"),
        }),
        _ => Ok(Value::List(values)),
    }
}

fn parse_bool(text: &str) -> Result<Value, Problem> {
    match text.to_ascii_lowercase().as_str() {
        "true" | "1" => Ok(Value::Bool(true)),
        "false" | "0" => Ok(Value::Bool(false)),
        _ => Err(wrong_value(text, "true, false, 1 or 0")),
    }
}

fn parse_float(text: &str, largest: f64) -> Result<Value, Problem> {
    let value: f64 = text
        .parse()
        .map_err(|_| wrong_value(text, "a number such as 1, -0.5 or 1e-3"))?;
    if value.is_finite() && value.abs() > largest {
        return Err(wrong_value(
            text,
            format!("a number from {:e} to {largest:e}", -largest),
        ));
    }
    Ok(Value::Float(value))
}

fn parse_integer(kind: Primitive, text: &str) -> Result<Value, Problem> {
    let (smallest, largest) = integer_range(kind);
    let allowed = || format!("a whole number from {smallest} to {largest}");
    let value: i128 = text.parse().map_err(|_| wrong_value(text, allowed()))?;
    if (smallest..=largest).contains(&value) {
        Ok(Value::Integer(value))
    } else {
        Err(wrong_value(text, allowed()))
    }
}

fn integer_range(kind: Primitive) -> (i128, i128) {
    match kind {
        Primitive::Int8 => (i8::MIN.into(), i8::MAX.into()),
        Primitive::Int16 => (i16::MIN.into(), i16::MAX.into()),
        Primitive::Int32 => (i32::MIN.into(), i32::MAX.into()),
        Primitive::Int64 => (i64::MIN.into(), i64::MAX.into()),
        Primitive::Uint16 => (0, u16::MAX.into()),
        Primitive::Uint32 => (0, u32::MAX.into()),
        Primitive::Uint64 => (0, u64::MAX.into()),
        _ => (0, u8::MAX.into()),
    }
}

fn parse_text(text: &str, bound: Option<usize>) -> Result<Value, Problem> {
    let value = match quote_of(text) {
        None => text.to_owned(),
        Some(quote) => match quoted_end(text, quote) {
            Some(end) if end == text.len() => unescape(&text[1..end - 1], quote),
            _ => {
                return Err(wrong_value(
                    text,
                    format!("text that ends with the {quote} it began with"),
                ));
            }
        },
    };
    match bound {
        Some(bound) if value.len() > bound => Err(Problem::DefaultLength {
            found: value.len(),
            allowed: format!("at most {bound} bytes"),
        }),
        _ => Ok(Value::Text(value)),
    }
}

fn quote_of(text: &str) -> Option<char> {
    text.chars().next().filter(|c| matches!(c, '"' | '\''))
}

/// The byte after the closing quote of text that begins with `quote`.
pub(crate) fn quoted_end(text: &str, quote: char) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        if c == quote && !escaped {
            return Some(at + c.len_utf8());
        }
        escaped = c == '\\' && !escaped;
    }
    None
}

/// Only the quote itself and the backslash can be escaped; every other backslash stands for itself.
fn unescape(text: &str, quote: char) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        match rest.peek() {
            Some(&next) if c == '\\' && (next == quote || next == '\\') => {
                out.push(next);
                rest.next();
            }
            _ => out.push(c),
        }
    }
    out
}

/// Cuts `[a, "b, c", d]` into its items.
fn split_list(text: &str) -> Result<Vec<&str>, Problem> {
    let inner = text
        .strip_prefix('[')
        .and_then(|rest| rest.strip_suffix(']'))
        .ok_or_else(|| wrong_value(text, "a list such as [1, 2] or []"))?;
    let mut items = Vec::new();
    let mut rest = inner.trim();
    while !rest.is_empty() {
        let end = item_end(rest);
        let item = rest[..end].trim();
        if item.is_empty() {
            return Err(wrong_value(text, "one value between commas"));
        }
        items.push(item);
        rest = rest[end..].strip_prefix(',').unwrap_or("").trim_start();
    }
    Ok(items)
}

/// The byte of the comma that ends the first item, or the text's end. A quoted item may hold commas.
fn item_end(text: &str) -> usize {
    let start = quote_of(text).and_then(|quote| quoted_end(text, quote)).unwrap_or(0);
    text[start..].find(',').map_or(text.len(), |at| start + at)
}

fn wrong_value(found: &str, allowed: impl Into<String>) -> Problem {
    Problem::Value {
        found: found.to_owned(),
        allowed: allowed.into(),
    }
}
