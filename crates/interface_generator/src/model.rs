//! What an interface file says, as values.

use std::fmt;

/// The folder an interface comes from, and the middle part of its type name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Kind {
    /// `msg`
    Msg,
    /// `srv`
    Srv,
    /// `action`
    Action,
}

impl Kind {
    /// All three, in the order they are written.
    pub const ALL: [Kind; 3] = [Kind::Msg, Kind::Srv, Kind::Action];

    /// The folder's name, the Rust module's name and the files' extension.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Msg => "msg",
            Kind::Srv => "srv",
            Kind::Action => "action",
        }
    }
}

/// A full ROS type name such as `sensor_msgs/msg/Image` or `std_srvs/srv/Trigger_Request`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TypeName {
    /// The package.
    pub package: String,
    /// The kind.
    pub kind: Kind,
    /// The name; a part of a service or action has a suffix such as `_Request`.
    pub name: String,
}

impl TypeName {
    /// The name of the Rust type: `Trigger_Request` becomes `TriggerRequest`.
    pub fn rust_name(&self) -> String {
        self.name.replace('_', "")
    }
}

impl fmt::Display for TypeName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}/{}", self.package, self.kind.name(), self.name)
    }
}

/// A builtin type of fixed size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "each variant is the builtin type of its name")]
pub enum Primitive {
    Bool,
    Byte,
    Char,
    Float32,
    Float64,
    Int8,
    Int16,
    Int32,
    Int64,
    Uint8,
    Uint16,
    Uint32,
    Uint64,
}

/// The type of one element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Element {
    /// A builtin type of fixed size.
    Primitive(Primitive),
    /// Text, with the largest allowed number of bytes if there is a bound.
    Text {
        /// The bound in bytes of UTF-8.
        bound: Option<usize>,
    },
    /// Another message.
    Message(TypeName),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// One, no array.
    One,
    /// `[N]`
    Fixed(usize),
    /// `[<=N]`
    Bounded(usize),
    /// `[]`
    Unbounded,
}

/// A constant's or default's value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Of `bool`.
    Bool(bool),
    /// Of every integer type, `byte` and `char`; always inside the type's range.
    Integer(i128),
    /// Of `float32` and `float64`.
    Float(f64),
    /// Of `string`.
    Text(String),
    /// Of an array.
    List(Vec<Value>),
}

/// One field of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name as in the file.
    pub name: String,
    /// The type of its elements.
    pub element: Element,
    /// How many elements it has.
    pub count: Count,
    /// Its default, if the file gives one.
    pub default: Option<Value>,
    /// The file's comments on it.
    pub comments: Vec<String>,
    /// The declaration as it stands in the file, without comments.
    pub declaration: String,
    /// Its line, from 1.
    pub line: usize,
}

/// One constant of a message.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    /// Its name as in the file.
    pub name: String,
    /// Its type, never a message.
    pub element: Element,
    /// Its value.
    pub value: Value,
    /// The file's comments on it.
    pub comments: Vec<String>,
    /// The declaration as it stands in the file, without comments.
    pub declaration: String,
    /// Its line, from 1.
    pub line: usize,
}

/// A message, or one part of a service or action.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    /// Its full name.
    pub name: TypeName,
    /// The comment at the head of the file.
    pub comments: Vec<String>,
    /// The fields in the order of the wire. Empty when the file has none.
    pub fields: Vec<Field>,
    /// The constants in the order of the file.
    pub constants: Vec<Constant>,
    /// The text it was read from, which MCAP files store as the schema.
    pub text: String,
    /// The file it was read from, for errors.
    pub file: String,
}

/// One interface file.
#[derive(Debug, Clone, PartialEq)]
pub struct Interface {
    /// Its full name, without a part's suffix.
    pub name: TypeName,
    /// A `.msg` has one part, a `.srv` request and response, an `.action` goal, result and feedback.
    pub parts: Vec<Message>,
}

/// The suffixes of a kind's parts, in the order of the file.
pub fn part_suffixes(kind: Kind) -> &'static [&'static str] {
    match kind {
        Kind::Msg => &[""],
        Kind::Srv => &["_Request", "_Response"],
        Kind::Action => &["_Goal", "_Result", "_Feedback"],
    }
}
