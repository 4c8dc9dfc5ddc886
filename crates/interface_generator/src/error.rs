//! What can be wrong with interface files, always with the place, what was found and what is allowed.

use std::path::PathBuf;

/// Why interface files could not be turned into Rust.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder could not be read.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A line breaks the grammar.
    #[error("{file}:{line}: {problem}")]
    Grammar {
        /// The file as it was named to the parser.
        file: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong with it.
        problem: Problem,
    },
    /// A field names a message that no added package defines.
    #[error("{file}:{line}: `{found}` is defined in none of the packages {known:?}")]
    UnknownType {
        /// The file that names it.
        file: String,
        /// The line, from 1.
        line: usize,
        /// The missing type.
        found: String,
        /// The packages that were searched.
        known: Vec<String>,
    },
    /// A message contains itself, directly or through others.
    #[error("a message cannot contain itself: {}", cycle.join(" -> "))]
    Recursive {
        /// The chain of type names, the first equal to the last.
        cycle: Vec<String>,
    },
    /// Two interfaces of one package would get one Rust name.
    #[error("package {package}: `{first}` and `{second}` would both become the Rust type `{rust_name}`")]
    NameClash {
        /// The package.
        package: String,
        /// One of the two.
        first: String,
        /// The other.
        second: String,
        /// The name both would get.
        rust_name: String,
    },
    /// A package was added twice.
    #[error("package {package} was added before; each package comes from one folder")]
    PackageTwice {
        /// The package.
        package: String,
    },
    /// A package's folder name is not a ROS package name.
    #[error("`{found}` is not a package name; allowed: lower-case letters, digits and single `_`, a letter first")]
    PackageName {
        /// The name found.
        found: String,
    },
    /// Rust was asked for a package that was never added.
    #[error("package {found} was never added; added are {known:?}")]
    UnknownPackage {
        /// The package asked for.
        found: String,
        /// The packages that were added.
        known: Vec<String>,
    },
    /// An `.idl` file lies among the interface files.
    #[error("{}: .idl files are not read; allowed: .msg in msg/, .srv in srv/, .action in action/", path.display())]
    Idl {
        /// The file.
        path: PathBuf,
    },
}

/// What is wrong with one line of an interface file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    /// A type without a name.
    #[error("`{found}` has no name; allowed: `TYPE NAME`, `TYPE NAME DEFAULT` or `TYPE NAME=VALUE`")]
    NoName {
        /// The line's text.
        found: String,
    },
    /// A field's name breaks the ROS rule.
    #[error("field name `{found}`; allowed: lower-case letters, digits and single `_`, a letter first, no `_` last")]
    FieldName {
        /// The name.
        found: String,
    },
    /// A constant's name breaks the ROS rule.
    #[error("constant name `{found}`; allowed: upper-case letters, digits and single `_`, a letter first, no `_` last")]
    ConstantName {
        /// The name.
        found: String,
    },
    /// An interface's name (its file's) breaks the ROS rule.
    #[error("interface name `{found}`; allowed: letters and digits, an upper-case letter first")]
    InterfaceName {
        /// The name.
        found: String,
    },
    /// Something stands in the type's place that is no type.
    #[error(
        "type `{found}`; allowed: bool, byte, char, float32, float64, int8 to uint64, string, `Name`, `package/Name` or \
         `package/msg/Name`, each with `[]`, `[N]` or `[<=N]`, strings with `<=N`"
    )]
    Type {
        /// The text.
        found: String,
    },
    /// Wide strings.
    #[error(
        "`{found}`: wide strings are not supported, because middlewares disagree on their CDR form; allowed: string \
         (UTF-8)"
    )]
    WideString {
        /// The text.
        found: String,
    },
    /// A ROS 1 builtin.
    #[error("`{found}` is a ROS 1 type; allowed: `builtin_interfaces/{instead}`")]
    RosOneType {
        /// The text.
        found: String,
        /// Its successor.
        instead: &'static str,
    },
    /// A bound or a length that is no number from 1 to 2^32 - 1.
    #[error("bound or length `{found}`; allowed: a whole number from 1 to 4294967295")]
    Bound {
        /// The text.
        found: String,
    },
    /// A constant of a type that cannot have constants.
    #[error("a constant of type `{found}`; allowed: one value of a builtin type")]
    ConstantType {
        /// The type's text.
        found: String,
    },
    /// A default for a message.
    #[error("default `{found}` for a message; allowed: defaults for builtin types and arrays of them")]
    DefaultOfMessage {
        /// The default's text.
        found: String,
    },
    /// A value that its type cannot read.
    #[error("value `{found}`; allowed: {allowed}")]
    Value {
        /// The text.
        found: String,
        /// What would be right.
        allowed: String,
    },
    /// A default with too many or too few elements or characters.
    #[error("default of length {found}; allowed: {allowed}")]
    DefaultLength {
        /// Its length.
        found: usize,
        /// What would be right.
        allowed: String,
    },
    /// A name used twice in one message.
    #[error("the name `{found}` was used in line {first_line}; allowed: each name once")]
    Duplicate {
        /// The name.
        found: String,
        /// Where it was used first, from 1.
        first_line: usize,
    },
    /// A file with the wrong number of sections.
    #[error("{found} sections; allowed: {allowed}, separated by lines of `---`")]
    Sections {
        /// How many there are.
        found: usize,
        /// How many there must be.
        allowed: usize,
    },
}
