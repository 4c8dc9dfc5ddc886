//! ROS's naming rules and Rust's keywords.

/// Is this a package or field name: lower-case words joined by single underscores?
pub(crate) fn is_lower_name(text: &str) -> bool {
    is_name(text, |c| c.is_ascii_lowercase())
}

/// Is this a constant's name: upper-case words joined by single underscores?
pub(crate) fn is_upper_name(text: &str) -> bool {
    is_name(text, |c| c.is_ascii_uppercase())
}

fn is_name(text: &str, is_letter: impl Fn(char) -> bool) -> bool {
    text.starts_with(&is_letter)
        && !text.ends_with('_')
        && !text.contains("__")
        && text.chars().all(|c| is_letter(c) || c.is_ascii_digit() || c == '_')
}

/// Is this an interface's name: letters and digits, an upper-case letter first?
pub(crate) fn is_interface_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_uppercase()) && text.chars().all(|c| c.is_ascii_alphanumeric())
}

const KEYWORDS: &[&str] = &[
    "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do", "dyn", "else",
    "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop", "macro", "match", "mod",
    "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static", "struct", "super", "trait", "true",
    "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];

/// The Rust identifier for a field: its own name, with a trailing `_` where Rust keeps the word for itself.
pub(crate) fn rust_field(name: &str) -> String {
    let suffix = if KEYWORDS.contains(&name) { "_" } else { "" };
    format!("{name}{suffix}")
}
