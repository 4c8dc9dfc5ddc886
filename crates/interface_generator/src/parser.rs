//! Interface files: text to [`Interface`].

use std::collections::HashMap;

use crate::error::{Error, Problem};
use crate::model::{Constant, Element, Field, Interface, Kind, Message, TypeName, part_suffixes};
use crate::names::{is_interface_name, is_lower_name, is_upper_name};
use crate::types::parse_type;
use crate::values::{parse_default, parse_scalar, quoted_end};

/// Reads one interface file. `file` is only used in errors.
///
/// ```
/// use interface_generator::{Count, Kind, parse_interface};
/// let text = "# A reading.\n\nfloat64[3] axis [0.0, 0.0, 1.0]  # unit vector\n";
/// let reading = parse_interface("Reading.msg", "demo_msgs", Kind::Msg, "Reading", text).unwrap();
/// let axis = &reading.parts[0].fields[0];
/// assert_eq!((axis.name.as_str(), axis.count), ("axis", Count::Fixed(3)));
/// assert_eq!(axis.comments, ["unit vector"]);
/// ```
pub fn parse_interface(file: &str, package: &str, kind: Kind, name: &str, text: &str) -> Result<Interface, Error> {
    let at_head = |problem| Error::Grammar {
        file: file.to_owned(),
        line: 1,
        problem,
    };
    if !is_interface_name(name) {
        return Err(at_head(Problem::InterfaceName { found: name.to_owned() }));
    }
    let suffixes = part_suffixes(kind);
    let sections = split_sections(text);
    if sections.len() != suffixes.len() {
        return Err(at_head(Problem::Sections {
            found: sections.len(),
            allowed: suffixes.len(),
        }));
    }
    let parts = suffixes.iter().zip(&sections).map(|(suffix, section)| {
        let name = TypeName {
            package: package.to_owned(),
            kind,
            name: format!("{name}{suffix}"),
        };
        parse_part(file, name, section)
    });
    Ok(Interface {
        name: TypeName {
            package: package.to_owned(),
            kind,
            name: name.to_owned(),
        },
        parts: parts.collect::<Result<_, _>>()?,
    })
}

/// The lines between two `---`, with the number of the first.
struct Section<'a> {
    first_line: usize,
    lines: Vec<&'a str>,
}

fn split_sections(text: &str) -> Vec<Section<'_>> {
    let mut sections = vec![Section {
        first_line: 1,
        lines: Vec::new(),
    }];
    for (index, line) in text.lines().enumerate() {
        if line.trim_end() == "---" {
            sections.push(Section {
                first_line: index + 2,
                lines: Vec::new(),
            });
        } else if let Some(section) = sections.last_mut() {
            section.lines.push(line);
        }
    }
    sections
}

fn parse_part(file: &str, name: TypeName, section: &Section<'_>) -> Result<Message, Error> {
    let mut reader = PartReader::new(file, name);
    for (index, line) in section.lines.iter().enumerate() {
        let line_number = section.first_line + index;
        reader.read_line(line_number, line).map_err(|problem| Error::Grammar {
            file: file.to_owned(),
            line: line_number,
            problem,
        })?;
    }
    let mut message = reader.finish();
    message.text = section.lines.iter().flat_map(|line| [line.trim_end(), "\n"]).collect();
    Ok(message)
}

/// Collects one part line by line.
struct PartReader {
    message: Message,
    /// Comment lines that belong to whatever comes next.
    pending: Vec<String>,
    /// Where each name was first used.
    names: HashMap<String, usize>,
    last: Last,
}

/// What the line before was, which decides whose an indented comment is.
enum Last {
    Field,
    Constant,
    Other,
}

impl PartReader {
    fn new(file: &str, name: TypeName) -> Self {
        let message = Message {
            name,
            comments: Vec::new(),
            fields: Vec::new(),
            constants: Vec::new(),
            text: String::new(),
            file: file.to_owned(),
        };
        Self {
            message,
            pending: Vec::new(),
            names: HashMap::new(),
            last: Last::Other,
        }
    }

    fn read_line(&mut self, line_number: usize, line: &str) -> Result<(), Problem> {
        let text = line.trim();
        if text.is_empty() {
            self.end_comment_block();
        } else if let Some(comment) = text.strip_prefix('#') {
            self.read_comment(line.starts_with(char::is_whitespace), comment);
        } else {
            self.read_declaration(line_number, text)?;
        }
        Ok(())
    }

    /// A comment block with an empty line after it belongs to the message at its head, and to nothing further down.
    fn end_comment_block(&mut self) {
        let block = std::mem::take(&mut self.pending);
        if self.names.is_empty() {
            self.message.comments.extend(block);
        }
        self.last = Last::Other;
    }

    /// An indented comment right under a declaration continues that declaration's comment.
    fn read_comment(&mut self, indented: bool, comment: &str) {
        let comment = tidy_comment(comment);
        let owner = match self.last {
            Last::Field if indented => self.message.fields.last_mut().map(|field| &mut field.comments),
            Last::Constant if indented => self.message.constants.last_mut().map(|constant| &mut constant.comments),
            _ => None,
        };
        if let Some(comments) = owner {
            comments.push(comment);
        } else {
            self.pending.push(comment);
            self.last = Last::Other;
        }
    }

    fn read_declaration(&mut self, line: usize, text: &str) -> Result<(), Problem> {
        let parts = split_declaration(text)?;
        let (element, count) = parse_type(parts.type_text, &self.message.name.package)?;
        let mut comments = std::mem::take(&mut self.pending);
        comments.extend(parts.comment.map(tidy_comment));
        let name = parts.name.to_owned();
        let declaration = parts.text.to_owned();
        match parts.value {
            DeclaredValue::Constant(value) => {
                if count != crate::model::Count::One || matches!(element, Element::Message(_)) {
                    return Err(Problem::ConstantType {
                        found: parts.type_text.to_owned(),
                    });
                }
                check_name(is_upper_name(&name), || Problem::ConstantName { found: name.clone() })?;
                let value = parse_scalar(&element, value)?;
                self.claim_name(&name, line)?;
                self.message.constants.push(Constant {
                    name,
                    element,
                    value,
                    comments,
                    declaration,
                    line,
                });
                self.last = Last::Constant;
            }
            DeclaredValue::Default(value) => {
                check_name(is_lower_name(&name), || Problem::FieldName { found: name.clone() })?;
                let default = value.map(|value| parse_default(&element, count, value)).transpose()?;
                self.claim_name(&name, line)?;
                self.message.fields.push(Field {
                    name,
                    element,
                    count,
                    default,
                    comments,
                    declaration,
                    line,
                });
                self.last = Last::Field;
            }
        }
        Ok(())
    }

    fn claim_name(&mut self, name: &str, line: usize) -> Result<(), Problem> {
        match self.names.insert(name.to_owned(), line) {
            None => Ok(()),
            Some(first_line) => Err(Problem::Duplicate {
                found: name.to_owned(),
                first_line,
            }),
        }
    }

    fn finish(mut self) -> Message {
        self.end_comment_block();
        self.message
    }
}

fn check_name(right: bool, problem: impl FnOnce() -> Problem) -> Result<(), Problem> {
    if right { Ok(()) } else { Err(problem()) }
}

/// Drops the extra `#` of box comments and one leading space.
fn tidy_comment(comment: &str) -> String {
    let comment = comment.trim_start_matches('#').trim_end();
    comment.strip_prefix(' ').unwrap_or(comment).to_owned()
}

/// One line cut into its pieces.
struct Declaration<'a> {
    type_text: &'a str,
    name: &'a str,
    value: DeclaredValue<'a>,
    comment: Option<&'a str>,
    text: &'a str,
}

enum DeclaredValue<'a> {
    Constant(&'a str),
    Default(Option<&'a str>),
}

fn split_declaration(line: &str) -> Result<Declaration<'_>, Problem> {
    let (type_text, after_type) = split_word(line);
    let name_end = after_type
        .find(|c: char| c.is_whitespace() || c == '=' || c == '#')
        .unwrap_or(after_type.len());
    let (name, after_name) = after_type.split_at(name_end);
    if name.is_empty() {
        return Err(Problem::NoName { found: line.to_owned() });
    }
    let after_name = after_name.trim_start();
    let (is_constant, after_name) = match after_name.strip_prefix('=') {
        Some(rest) => (true, rest.trim_start()),
        None => (false, after_name),
    };
    let (value, comment) = split_comment(after_name);
    let text = match comment {
        Some(comment) => line[..line.len() - comment.len() - 1].trim_end(),
        None => line,
    };
    let value = match (is_constant, value) {
        (true, value) => DeclaredValue::Constant(value),
        (false, "") => DeclaredValue::Default(None),
        (false, value) => DeclaredValue::Default(Some(value)),
    };
    Ok(Declaration {
        type_text,
        name,
        value,
        comment,
        text,
    })
}

/// Cuts off the first word, which ends at a space or a comment.
fn split_word(text: &str) -> (&str, &str) {
    let end = text.find(|c: char| c.is_whitespace() || c == '#').unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}

/// Cuts a value from the comment behind it. A `#` inside quotes at the start of a value, or of a list's item, is text.
fn split_comment(text: &str) -> (&str, Option<&str>) {
    let mut at = 0;
    let mut expects_value = true;
    while let Some(c) = text[at..].chars().next() {
        if c == '#' {
            return (text[..at].trim_end(), Some(&text[at + 1..]));
        }
        let quoted = (expects_value && matches!(c, '"' | '\''))
            .then(|| quoted_end(&text[at..], c))
            .flatten();
        at += quoted.unwrap_or(c.len_utf8());
        expects_value = quoted.is_none() && (matches!(c, ',' | '[') || (expects_value && c.is_whitespace()));
    }
    (text.trim_end(), None)
}
