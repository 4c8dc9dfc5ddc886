//! Turns ROS 2 interface files (`.msg`, `.srv`, `.action`) into Rust types.
//!
//! A library for build scripts: it parses folders of interface files, checks them, and writes one module per package.
//! It is not a middleware and knows no wire format: what it writes derives serde's traits and refers to a *runtime*
//! crate (`interfaces` in this workspace) for the `Message`, `Service` and `Action` traits, the byte sequence and the
//! bounds checks.
//!
//! ```
//! use interface_generator::{Kind, Packages, parse_interface, write_rust};
//!
//! let text = "uint8 WARN=1\nstring<=16 name\nfloat64[] ranges  # metres\n";
//! let report = parse_interface("Report.msg", "demo_msgs", Kind::Msg, "Report", text)?;
//! let mut packages = Packages::new();
//! packages.add_interfaces("demo_msgs", vec![report])?;
//! packages.resolve()?;
//! let rust = write_rust(&packages, &["demo_msgs"], "::interfaces")?;
//! assert!(rust.contains("pub ranges: ::std::vec::Vec<f64>,"));
//! # Ok::<(), interface_generator::Error>(())
//! ```
//!
//! A build script calls [`Packages::add_folder`] for each package, [`Packages::resolve`], [`write_rust`], and prints
//! `cargo::rerun-if-changed` for [`Packages::sources`]; `crates/interfaces/build.rs` is one.
//!
//! # The grammar
//!
//! One declaration a line; `#` starts a comment unless it stands in a quoted value.
//!
//! ```text
//! TYPE name                    # a field
//! TYPE name DEFAULT            # a field with a default
//! TYPE NAME=VALUE              # a constant of a builtin type
//! ---                          # next part (.srv: request, response; .action: goal, result, feedback)
//! ```
//!
//! | in the file | in Rust |
//! |---|---|
//! | `bool`, `int8` to `int64`, `uint8` to `uint64`, `float32`, `float64` | `bool`, `i8` to `i64`, `u8` to `u64`, `f32`, `f64` |
//! | `byte`, `char` | `u8` |
//! | `string`, `string<=N` | `String`; the bound counts bytes of UTF-8 |
//! | `Name`, `package/Name`, `package/msg/Name` | that message's type; a bare `Header` is `std_msgs/Header` |
//! | `T[N]` | `[T; N]` |
//! | `T[]`, `T[<=N]` | `Vec<T>` |
//! | `uint8[]`, `byte[]`, `char[]`, bounded or not | `ByteSequence` |
//! | `wstring` | refused: middlewares disagree on its wire form |
//!
//! Defaults and constants are `true`, `-3`, `1e-3`, `'text'`, `"text"`, bare text, or lists `[1, 2]`. In quoted text a
//! backslash escapes the quote and itself. Bounds are checked when a message is serialised or deserialised.
//!
//! ROS's own tools take a little less: they end a value at a `#` even inside quotes, and know neither
//! `package/msg/Name` nor a bare `Header`. Files that colcon must build, too, should not use these three.
//!
//! Comments become documentation: those above a declaration, behind it, and indented below it belong to it; the block
//! at the head of a file that an empty line follows belongs to the message. Field names that Rust keeps for itself get
//! a trailing `_`. A message without fields has ROS's one hidden byte.

mod error;
mod model;
mod names;
mod packages;
mod parser;
mod types;
mod values;
mod writer;

pub use error::{Error, Problem};
pub use model::{Constant, Count, Element, Field, Interface, Kind, Message, Primitive, TypeName, Value, part_suffixes};
pub use packages::Packages;
pub use parser::parse_interface;
pub use writer::{concatenated_definition, write_rust};
