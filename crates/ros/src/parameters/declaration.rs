//! What a node says about a parameter: type, default, range, unit. The one place where values are checked.

use std::fmt;
use std::marker::PhantomData;
use std::ops::RangeInclusive;

use interfaces::rcl_interfaces::msg::{FloatingPointRange, IntegerRange, ParameterDescriptor};

use super::error::ParameterError;
use super::value::{ParameterKind, ParameterType, ParameterValue};

/// How far a value may be from a multiple of the step, relative to the step.
const STEP_TOLERANCE: f64 = 1e-6;

/// A parameter to declare, in the manner of a builder:
///
/// ```
/// use ros::parameters::Parameter;
/// let threshold = Parameter::float("signal_threshold", 0.002)
///     .unit("fraction of full scale")
///     .range(0.0..=1.0)
///     .describe("Darker pixels are not measured");
/// ```
#[derive(Debug, Clone)]
pub struct Parameter<T> {
    pub(crate) declaration: Declaration,
    kind: PhantomData<T>,
}

/// A parameter without its Rust type.
#[derive(Debug, Clone)]
pub(crate) struct Declaration {
    pub(crate) name: String,
    pub(crate) default: ParameterValue,
    description: String,
    unit: Option<String>,
    pub(crate) read_only: bool,
    allowed: Allowed,
}

#[derive(Debug, Clone)]
enum Allowed {
    Anything,
    Floats { range: RangeInclusive<f64>, step: f64 },
    Integers { range: RangeInclusive<i64>, step: u64 },
    Strings(Vec<String>),
}

impl<T: ParameterKind> Parameter<T> {
    /// A parameter of any type; `lights.c1.gain` is the same as `gain` in the nested block `lights: c1:` of a file.
    pub fn new(name: impl Into<String>, default: T) -> Self {
        let declaration = Declaration {
            name: name.into(),
            default: default.into_value(),
            description: String::new(),
            unit: None,
            read_only: false,
            allowed: Allowed::Anything,
        };
        Self {
            declaration,
            kind: PhantomData,
        }
    }

    /// What it does, for people.
    #[must_use]
    pub fn describe(mut self, description: impl Into<String>) -> Self {
        self.declaration.description = description.into();
        self
    }

    /// The unit of the number ("m", "rad", "fraction of full scale").
    #[must_use]
    pub fn unit(mut self, unit: impl Into<String>) -> Self {
        self.declaration.unit = Some(unit.into());
        self
    }

    /// It keeps the value it has when the node starts.
    #[must_use]
    pub fn read_only(mut self) -> Self {
        self.declaration.read_only = true;
        self
    }
}

macro_rules! constructors {
    ($($name:ident: $rust:ty, $what:literal;)*) => { $(
        impl Parameter<$rust> {
            #[doc = concat!("A parameter that is ", $what, ".")]
            pub fn $name(name: impl Into<String>, default: impl Into<$rust>) -> Self {
                Self::new(name, default.into())
            }
        }
    )* };
}

constructors! {
    bool: bool, "true or false";
    integer: i64, "a whole number";
    float: f64, "a number";
    string: String, "text";
    integers: Vec<i64>, "a list of whole numbers";
    floats: Vec<f64>, "a list of numbers";
    strings: Vec<String>, "a list of texts";
}

macro_rules! float_ranges {
    ($($rust:ty),*) => { $(
        impl Parameter<$rust> {
            /// Values outside, both ends included, are refused. Of a list, every element must be inside.
            #[must_use]
            pub fn range(mut self, range: RangeInclusive<f64>) -> Self {
                self.declaration.allowed = Allowed::Floats { range, step: 0.0 };
                self
            }

            /// A range of which only the start and every `step` from it are allowed, and the end.
            #[must_use]
            pub fn stepped_range(mut self, range: RangeInclusive<f64>, step: f64) -> Self {
                self.declaration.allowed = Allowed::Floats { range, step };
                self
            }
        }
    )* };
}

macro_rules! integer_ranges {
    ($($rust:ty),*) => { $(
        impl Parameter<$rust> {
            /// Values outside, both ends included, are refused. Of a list, every element must be inside.
            #[must_use]
            pub fn range(mut self, range: RangeInclusive<i64>) -> Self {
                self.declaration.allowed = Allowed::Integers { range, step: 1 };
                self
            }

            /// A range of which only the start and every `step` from it are allowed, and the end.
            #[must_use]
            pub fn stepped_range(mut self, range: RangeInclusive<i64>, step: u64) -> Self {
                self.declaration.allowed = Allowed::Integers { range, step };
                self
            }
        }
    )* };
}

float_ranges!(f64, Vec<f64>);
integer_ranges!(i64, Vec<i64>);

impl Parameter<String> {
    /// Only these texts are allowed.
    #[must_use]
    pub fn one_of<S: Into<String>>(mut self, texts: impl IntoIterator<Item = S>) -> Self {
        self.declaration.allowed = Allowed::Strings(texts.into_iter().map(Into::into).collect());
        self
    }
}

impl Parameter<Vec<String>> {
    /// Only these texts are allowed as elements.
    #[must_use]
    pub fn each_one_of<S: Into<String>>(mut self, texts: impl IntoIterator<Item = S>) -> Self {
        self.declaration.allowed = Allowed::Strings(texts.into_iter().map(Into::into).collect());
        self
    }
}

impl Declaration {
    pub(crate) fn parameter_type(&self) -> ParameterType {
        self.default.parameter_type()
    }

    /// Refuses declarations that contradict themselves.
    pub(crate) fn check(&self) -> Result<(), ParameterError> {
        let refuse = |problem: String| {
            Err(ParameterError::Declaration {
                name: self.name.clone(),
                problem,
            })
        };
        let good = |token: &str| !token.is_empty() && token.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !self.name.split('.').all(good) {
            return refuse("a name is made of letters, digits and underscores, with single dots between".into());
        }
        match &self.allowed {
            Allowed::Floats { range, step } if !(range.start() <= range.end() && *step >= 0.0 && step.is_finite()) => {
                return refuse(format!(
                    "range {:?} to {:?} with step {step:?} is empty",
                    range.start(),
                    range.end()
                ));
            }
            Allowed::Integers { range, step } if range.is_empty() || *step == 0 => {
                return refuse(format!(
                    "range {} to {} with step {step} is empty",
                    range.start(),
                    range.end()
                ));
            }
            _ => {}
        }
        self.check_value(&self.default)
            .or_else(|error| refuse(format!("its default does not fit: {error}")))
    }

    /// Whether the parameter may have this value.
    pub(crate) fn check_value(&self, value: &ParameterValue) -> Result<(), ParameterError> {
        let fits = value.parameter_type() == self.parameter_type() && self.allowed.contains(value);
        if fits {
            return Ok(());
        }
        Err(ParameterError::Value {
            name: self.name.clone(),
            found: format!("{value} ({})", value.parameter_type()),
            allowed: self.to_string(),
        })
    }

    pub(crate) fn to_descriptor(&self) -> ParameterDescriptor {
        let mut descriptor = ParameterDescriptor {
            name: self.name.clone(),
            type_: self.parameter_type().to_wire(),
            description: self.description.clone(),
            additional_constraints: self.constraints().join("; "),
            read_only: self.read_only,
            ..ParameterDescriptor::default()
        };
        match &self.allowed {
            Allowed::Floats { range, step } => descriptor.floating_point_range.push(FloatingPointRange {
                from_value: *range.start(),
                to_value: *range.end(),
                step: *step,
            }),
            Allowed::Integers { range, step } => descriptor.integer_range.push(IntegerRange {
                from_value: *range.start(),
                to_value: *range.end(),
                step: *step,
            }),
            Allowed::Anything | Allowed::Strings(_) => {}
        }
        descriptor
    }

    /// What the descriptor has no field for.
    fn constraints(&self) -> Vec<String> {
        let unit = self.unit.iter().map(|unit| format!("unit: {unit}"));
        let texts = match &self.allowed {
            Allowed::Strings(texts) => Some(format!("one of: {}", texts.join(", "))),
            _ => None,
        };
        unit.chain(texts).collect()
    }
}

impl Allowed {
    fn contains(&self, value: &ParameterValue) -> bool {
        use ParameterValue as Value;
        match (self, value) {
            // Not a number passes no comparison, so it would pass no limit test written as "not above" either.
            (Self::Anything, Value::Float(x)) => !x.is_nan(),
            (Self::Anything, Value::Floats(xs)) => xs.iter().all(|x| !x.is_nan()),
            (Self::Floats { range, step }, Value::Float(x)) => on_steps(range, *step, *x),
            (Self::Floats { range, step }, Value::Floats(xs)) => xs.iter().all(|x| on_steps(range, *step, *x)),
            (Self::Integers { range, step }, Value::Integer(n)) => on_whole_steps(range, *step, *n),
            (Self::Integers { range, step }, Value::Integers(ns)) => {
                ns.iter().all(|n| on_whole_steps(range, *step, *n))
            }
            (Self::Strings(texts), Value::String(text)) => texts.contains(text),
            (Self::Strings(texts), Value::Strings(found)) => found.iter().all(|text| texts.contains(text)),
            _ => true,
        }
    }
}

#[allow(clippy::float_cmp)] // The end of a range is allowed exactly, whatever the step.
fn on_steps(range: &RangeInclusive<f64>, step: f64, value: f64) -> bool {
    if !range.contains(&value) {
        return false;
    }
    let steps = (value - range.start()) / step;
    step == 0.0 || value == *range.end() || (steps - steps.round()).abs() <= STEP_TOLERANCE
}

fn on_whole_steps(range: &RangeInclusive<i64>, step: u64, value: i64) -> bool {
    range.contains(&value) && (value == *range.end() || value.abs_diff(*range.start()).is_multiple_of(step))
}

/// "float from 0.0 to 1.0, unit: fraction of full scale".
impl fmt::Display for Declaration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.parameter_type())?;
        match &self.allowed {
            Allowed::Floats { range, step } => {
                write!(f, " from {:?} to {:?}", range.start(), range.end())?;
                if *step != 0.0 {
                    write!(f, " in steps of {step:?}")?;
                }
            }
            Allowed::Integers { range, step } => {
                write!(f, " from {} to {}", range.start(), range.end())?;
                if *step != 1 {
                    write!(f, " in steps of {step}")?;
                }
            }
            Allowed::Anything | Allowed::Strings(_) => {}
        }
        self.constraints()
            .iter()
            .try_for_each(|constraint| write!(f, ", {constraint}"))
    }
}
