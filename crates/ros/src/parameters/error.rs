//! What can be wrong with a parameter.

use std::path::PathBuf;

use super::overrides::Origin;

/// Why a parameter was not declared, set or read from a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// The program declares a parameter that cannot be.
    #[error("parameter {name:?} cannot be declared: {problem}")]
    Declaration {
        /// The parameter.
        name: String,
        /// What is wrong with the declaration.
        problem: String,
    },
    /// The value has the wrong type or is outside the allowed range.
    #[error("parameter {name:?} is {found}; allowed: {allowed}")]
    Value {
        /// The parameter.
        name: String,
        /// Value and type.
        found: String,
        /// Type, range, unit.
        allowed: String,
    },
    /// The parameter can be given a value at the node's start only.
    #[error("parameter {name:?} is read-only; it stays {value}")]
    ReadOnly {
        /// The parameter.
        name: String,
        /// Its value.
        value: String,
    },
    /// Nobody declared it.
    #[error("there is no parameter {name:?}; known: {}", .known.join(", "))]
    Unknown {
        /// The parameter.
        name: String,
        /// What is declared, sorted.
        known: Vec<String>,
    },
    /// A value that the node was started with is refused.
    #[error("{origin}: {problem}")]
    Override {
        /// Where the value was written.
        origin: Origin,
        /// Why it is refused.
        #[source]
        problem: Box<ParameterError>,
    },
    /// A file could not be opened.
    #[error("cannot read {}: {reason}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A file is not in the ROS 2 parameter-file form.
    #[error("{origin}: {found}; allowed: {allowed}")]
    Form {
        /// Where.
        origin: Origin,
        /// What stands there.
        found: String,
        /// What should.
        allowed: String,
    },
    /// A file is not YAML, or a block of it does not have the form that is asked for.
    #[error("{origin}: {problem}")]
    Yaml {
        /// Where.
        origin: Origin,
        /// What the parser says.
        problem: String,
    },
}
