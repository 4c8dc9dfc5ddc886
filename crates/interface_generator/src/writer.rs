//! Rust from interface files.

mod expressions;

use crate::error::Error;
use crate::model::{Count, Element, Field, Interface, Kind, Message, Primitive};
use crate::names::rust_field;
use crate::packages::Packages;
use expressions::{constant_type, default_expression, rust_type, scalar_expression};

/// ROS gives a message without fields one byte on the wire, because IDL has no empty structures.
const EMPTY_MEMBER: &str = "structure_needs_at_least_one_member";

/// The line MCAP's `ros2msg` form puts between a message and each message it needs: 80 times `=`.
const SEPARATOR: &str = "================================================================================";

/// Lints that say nothing useful about written code. Comments of interface files are not Markdown.
const ALLOWED: &str = "#[allow(non_camel_case_types, clippy::all, clippy::pedantic, rustdoc::bare_urls, rustdoc::broken_intra_doc_links, rustdoc::invalid_html_tags)]";

/// Writes the Rust modules of `packages`, which must be resolved.
///
/// `written` names the packages to write. The others must exist as `{runtime}::{package}`, because types refer to them
/// there. `runtime` is the path of the crate with the traits and helpers that written code uses: `crate` inside the
/// `interfaces` crate, `::interfaces` elsewhere. The text holds one module per package, with modules `msg`, `srv` and
/// `action` in it, and a function `visit_messages`.
pub fn write_rust(packages: &Packages, written: &[&str], runtime: &str) -> Result<String, Error> {
    let mut writer = Writer {
        packages,
        written,
        runtime,
        out: Out::default(),
    };
    for package in written {
        writer.write_package(package)?;
    }
    writer.write_visitor()?;
    Ok(writer.out.text)
}

/// The text of `message` and of every message it needs, as MCAP files hold it (encoding `ros2msg`).
pub fn concatenated_definition(packages: &Packages, message: &Message) -> String {
    let mut text = message.text.clone();
    for needed in packages.dependencies(message) {
        let head = format!("{SEPARATOR}\nMSG: {}/{}\n", needed.name.package, needed.name.name);
        text.push_str(&head);
        text.push_str(&needed.text);
    }
    text
}

struct Writer<'a> {
    packages: &'a Packages,
    written: &'a [&'a str],
    runtime: &'a str,
    out: Out,
}

/// Indented lines.
#[derive(Default)]
struct Out {
    text: String,
    depth: usize,
}

impl Out {
    fn line(&mut self, line: impl AsRef<str>) {
        let line = line.as_ref();
        let closes = line.starts_with('}');
        self.depth -= usize::from(closes);
        self.text.extend(std::iter::repeat_n("    ", self.depth));
        self.text.push_str(line);
        self.text.push('\n');
        self.depth += usize::from(line.ends_with('{'));
    }

    /// A doc comment; indentation goes, because Markdown would take it for code.
    fn doc<'l>(&mut self, lines: impl IntoIterator<Item = &'l str>) {
        for line in lines {
            self.line(format!("#[doc = {:?}]", format!(" {}", line.trim())));
        }
    }
}

impl Writer<'_> {
    fn write_package(&mut self, package: &str) -> Result<(), Error> {
        let interfaces = self.packages.interfaces(package)?;
        self.out
            .doc([format!("The interfaces of package `{package}`.").as_str()]);
        self.out.line(ALLOWED);
        self.out.line(format!("pub mod {package} {{"));
        for kind in Kind::ALL {
            let of_kind: Vec<_> = interfaces
                .iter()
                .filter(|interface| interface.name.kind == kind)
                .collect();
            if !of_kind.is_empty() {
                self.out.doc([format!("`{package}/{}`", kind.name()).as_str()]);
                self.out.line(format!("pub mod {} {{", kind.name()));
                for interface in of_kind {
                    self.write_interface(interface);
                }
                self.out.line("}");
            }
        }
        self.out.line("}");
        Ok(())
    }

    fn write_interface(&mut self, interface: &Interface) {
        for part in &interface.parts {
            self.write_message(part);
        }
        let (trait_name, associated): (_, &[&str]) = match interface.name.kind {
            Kind::Msg => return,
            Kind::Srv => ("Service", &["Request", "Response"]),
            Kind::Action => ("Action", &["Goal", "Result", "Feedback"]),
        };
        let (name, runtime) = (&interface.name.name, self.runtime);
        self.out.doc([format!("`{}`", interface.name).as_str()]);
        self.out.line("#[derive(Debug, Clone, Copy, PartialEq, Eq)]");
        self.out.line(format!("pub struct {name};"));
        self.out.line(format!("impl {runtime}::{trait_name} for {name} {{"));
        for part in associated {
            self.out.line(format!("type {part} = {name}{part};"));
        }
        self.out.line(format!(
            "const TYPE_NAME: &'static str = {:?};",
            interface.name.to_string()
        ));
        self.out.line("}");
    }

    fn write_message(&mut self, message: &Message) {
        self.write_struct(message);
        self.write_constants(message);
        self.write_default(message);
        for field in &message.fields {
            self.write_bound(message, field);
        }
        let definition = concatenated_definition(self.packages, message);
        self.out.line(format!(
            "impl {}::Message for {} {{",
            self.runtime,
            message.name.rust_name()
        ));
        self.out.line(format!(
            "const TYPE_NAME: &'static str = {:?};",
            message.name.to_string()
        ));
        self.out
            .line(format!("const DEFINITION: &'static str = {definition:?};"));
        self.out.line("}");
    }

    fn write_struct(&mut self, message: &Message) {
        let serde = format!("{}::support::serde", self.runtime);
        self.out.doc(message.comments.iter().map(String::as_str));
        self.out.doc(message.comments.first().map(|_| ""));
        self.out.doc([format!("`{}`", message.name).as_str()]);
        let copy = if self.is_copy(message) { " Copy," } else { "" };
        self.out.line(format!(
            "#[derive(Debug, Clone,{copy} PartialEq, {serde}::Serialize, {serde}::Deserialize)]"
        ));
        self.out.line(format!("#[serde(crate = {serde:?})]"));
        self.out.line(format!("pub struct {} {{", message.name.rust_name()));
        for field in &message.fields {
            self.write_field(message, field);
        }
        if message.fields.is_empty() {
            self.out
                .doc(["Stands on the wire where there are no fields; always 0."]);
            self.out.line("#[doc(hidden)]");
            self.out.line(format!("pub {EMPTY_MEMBER}: u8,"));
        }
        self.out.line("}");
    }

    /// Times, points and poses are values like numbers; what holds text or sequences is not.
    fn is_copy(&self, message: &Message) -> bool {
        let is_plain = |field: &Field| {
            !matches!(field.element, Element::Text { .. }) && matches!(field.count, Count::One | Count::Fixed(_))
        };
        message.fields.iter().all(is_plain)
            && self
                .packages
                .dependencies(message)
                .into_iter()
                .all(|needed| needed.fields.iter().all(is_plain))
    }

    fn write_field(&mut self, message: &Message, field: &Field) {
        self.out.doc(field.comments.iter().map(String::as_str));
        self.out.doc(field.comments.first().map(|_| ""));
        self.out.doc([format!("`{}`", field.declaration).as_str()]);
        let support = format!("{}::support", self.runtime);
        let is_array = matches!(field.count, Count::Fixed(_));
        if is_bounded(field) {
            let array = if is_array { "_array" } else { "" };
            let bound = bound_name(message, field);
            self.out.line(format!(
                "#[serde(serialize_with = \"{support}::serialize_bounded{array}::<_, _, {bound}>\", \
                 deserialize_with = \"{support}::deserialize_bounded{array}::<_, _, {bound}>\")]"
            ));
        } else if is_array {
            self.out.line(format!("#[serde(with = \"{support}::array\")]"));
        }
        let field_type = rust_type(field, self.written, self.runtime);
        self.out.line(format!("pub {}: {field_type},", rust_field(&field.name)));
    }

    fn write_constants(&mut self, message: &Message) {
        if message.constants.is_empty() {
            return;
        }
        self.out.line(format!("impl {} {{", message.name.rust_name()));
        for constant in &message.constants {
            self.out.doc(constant.comments.iter().map(String::as_str));
            self.out.doc(constant.comments.first().map(|_| ""));
            self.out.doc([format!("`{}`", constant.declaration).as_str()]);
            let constant_type = constant_type(&constant.element);
            let value = scalar_expression(&constant.element, &constant.value);
            self.out
                .line(format!("pub const {}: {constant_type} = {value};", constant.name));
        }
        self.out.line("}");
    }

    fn write_default(&mut self, message: &Message) {
        self.out.line(format!(
            "impl ::core::default::Default for {} {{",
            message.name.rust_name()
        ));
        self.out.line("fn default() -> Self {");
        self.out.line("Self {");
        for field in &message.fields {
            let value = default_expression(field, self.runtime);
            self.out.line(format!("{}: {value},", rust_field(&field.name)));
        }
        if message.fields.is_empty() {
            self.out.line(format!("{EMPTY_MEMBER}: 0,"));
        }
        for close in ["}", "}", "}"] {
            self.out.line(close);
        }
    }

    /// The type that tells the helpers a field's bounds.
    fn write_bound(&mut self, message: &Message, field: &Field) {
        if !is_bounded(field) {
            return;
        }
        let sequence = match field.count {
            Count::Bounded(bound) => Some(bound),
            _ => None,
        };
        let text = match field.element {
            Element::Text { bound } => bound,
            _ => None,
        };
        let name = bound_name(message, field);
        self.out.line(format!("struct {name};"));
        self.out
            .line(format!("impl {}::support::Bounds for {name} {{", self.runtime));
        self.out.line(format!(
            "const TYPE_NAME: &'static str = {:?};",
            message.name.to_string()
        ));
        self.out.line(format!("const FIELD: &'static str = {:?};", field.name));
        self.out.line(format!(
            "const SEQUENCE: ::core::option::Option<usize> = {};",
            option_expression(sequence)
        ));
        self.out.line(format!(
            "const TEXT: ::core::option::Option<usize> = {};",
            option_expression(text)
        ));
        self.out.line("}");
    }

    fn write_visitor(&mut self) -> Result<(), Error> {
        let runtime = self.runtime;
        self.out
            .doc(["Calls `visitor` once for every message of these packages, parts of services and actions too."]);
        self.out.line(ALLOWED);
        self.out.line(format!(
            "pub fn visit_messages<V: {runtime}::MessageVisitor>(visitor: &mut V) {{"
        ));
        for package in self.written {
            for part in self
                .packages
                .interfaces(package)?
                .iter()
                .flat_map(|interface| &interface.parts)
            {
                let (kind, name) = (part.name.kind.name(), part.name.rust_name());
                self.out.line(format!("visitor.visit::<{package}::{kind}::{name}>();"));
            }
        }
        self.out.line("}");
        Ok(())
    }
}

fn option_expression(value: Option<usize>) -> String {
    value.map_or_else(
        || "::core::option::Option::None".to_owned(),
        |n| format!("::core::option::Option::Some({n})"),
    )
}

fn is_bounded(field: &Field) -> bool {
    matches!(field.count, Count::Bounded(_)) || matches!(field.element, Element::Text { bound: Some(_) })
}

/// `PickCycleGoal` and `mode` give `PickCycleGoal_mode_Bound`, which no interface's own type can be called.
fn bound_name(message: &Message, field: &Field) -> String {
    format!("{}_{}_Bound", message.name.rust_name(), field.name)
}

/// Are sequences of this element held as a byte sequence?
fn is_byte(element: &Element) -> bool {
    matches!(
        element,
        Element::Primitive(Primitive::Byte | Primitive::Char | Primitive::Uint8)
    )
}
