//! Values that a node is started with, and where they were written.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use super::value::ParameterValue;

/// A place in a file, or the program itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The file, or "node options".
    pub source: Arc<str>,
    /// The line, counted from 1, where it is known.
    pub line: Option<usize>,
}

impl Origin {
    /// A value that the program itself gave.
    pub(crate) fn options() -> Self {
        Self {
            source: "node options".into(),
            line: None,
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.source)?;
        self.line.map_or(Ok(()), |line| write!(f, ":{line}"))
    }
}

/// One value and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Override {
    /// The value as written.
    pub value: ParameterValue,
    /// Where.
    pub origin: Origin,
}

/// Values by parameter name; of two, the one added later holds.
pub type Overrides = BTreeMap<String, Override>;

/// Values that the program gives itself.
pub(crate) fn from_options(values: &BTreeMap<String, ParameterValue>) -> Overrides {
    let with_origin = |(name, value): (&String, &ParameterValue)| {
        (
            name.clone(),
            Override {
                value: value.clone(),
                origin: Origin::options(),
            },
        )
    };
    values.iter().map(with_origin).collect()
}
