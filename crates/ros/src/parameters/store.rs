//! The parameters of one node: declared once, checked at every change.

use std::collections::BTreeMap;

use interfaces::rcl_interfaces::msg::ParameterDescriptor;
use tokio::sync::watch;

use super::declaration::{Declaration, Parameter};
use super::error::ParameterError;
use super::overrides::Overrides;
use super::value::{ParameterKind, ParameterValue};

/// Declared parameters, their values, and the start values that nobody has claimed yet.
pub(crate) struct ParameterStore {
    entries: BTreeMap<String, Entry>,
    unclaimed: Overrides,
}

struct Entry {
    declaration: Declaration,
    value: ParameterValue,
    /// Tells the typed handles.
    tell: Box<dyn Fn(&ParameterValue) + Send + Sync>,
}

/// A parameter that was declared or got another value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Change {
    pub(crate) name: String,
    pub(crate) value: ParameterValue,
    pub(crate) declared: bool,
}

impl ParameterStore {
    pub(crate) fn new(overrides: Overrides) -> Self {
        Self {
            entries: BTreeMap::new(),
            unclaimed: overrides,
        }
    }

    /// Adds a parameter. It starts with its override, if there is one that fits, else with its default.
    pub(crate) fn declare<T: ParameterKind>(
        &mut self,
        parameter: Parameter<T>,
    ) -> Result<(watch::Receiver<T>, Change), ParameterError> {
        let declaration = parameter.declaration;
        let name = declaration.name.clone();
        let contradicts = |problem: String| ParameterError::Declaration {
            name: name.clone(),
            problem,
        };
        declaration.check()?;
        if self.entries.contains_key(&name) {
            return Err(contradicts("it is declared already".into()));
        }
        let value = self.start_value(&declaration)?;
        let typed = T::from_value(&value).ok_or_else(|| contradicts(format!("its value {value} has another type")))?;
        let (sender, receiver) = watch::channel(typed);
        let tell = move |value: &ParameterValue| {
            if let Some(value) = T::from_value(value) {
                sender.send_if_modified(|held| std::mem::replace(held, value.clone()) != value);
            }
        };
        let change = Change {
            name: name.clone(),
            value: value.clone(),
            declared: true,
        };
        self.entries.insert(
            name,
            Entry {
                declaration,
                value,
                tell: Box::new(tell),
            },
        );
        Ok((receiver, change))
    }

    fn start_value(&mut self, declaration: &Declaration) -> Result<ParameterValue, ParameterError> {
        let Some(written) = self.unclaimed.remove(&declaration.name) else {
            return Ok(declaration.default.clone());
        };
        let value = written.value.written_as(declaration.parameter_type());
        match declaration.check_value(&value) {
            Ok(()) => Ok(value),
            Err(problem) => Err(ParameterError::Override {
                origin: written.origin,
                problem: Box::new(problem),
            }),
        }
    }

    /// Refuses start values for parameters that were never declared.
    pub(crate) fn seal(&self) -> Result<(), ParameterError> {
        match self.unclaimed.iter().next() {
            None => Ok(()),
            Some((name, written)) => Err(ParameterError::Override {
                origin: written.origin.clone(),
                problem: Box::new(self.unknown(name)),
            }),
        }
    }

    /// Sets all or none; gives back what changed.
    pub(crate) fn set(&mut self, wanted: &[(String, ParameterValue)]) -> Result<Vec<Change>, ParameterError> {
        wanted.iter().try_for_each(|(name, value)| self.check(name, value))?;
        Ok(wanted
            .iter()
            .filter_map(|(name, value)| self.replace(name, value))
            .collect())
    }

    fn check(&self, name: &str, value: &ParameterValue) -> Result<(), ParameterError> {
        let entry = self.entry(name)?;
        if entry.declaration.read_only {
            let value = entry.value.to_string();
            return Err(ParameterError::ReadOnly {
                name: name.to_owned(),
                value,
            });
        }
        entry.declaration.check_value(value)
    }

    fn replace(&mut self, name: &str, value: &ParameterValue) -> Option<Change> {
        let entry = self.entries.get_mut(name)?;
        entry.value = value.clone();
        (entry.tell)(value);
        Some(Change {
            name: name.to_owned(),
            value: value.clone(),
            declared: false,
        })
    }

    pub(crate) fn get(&self, name: &str) -> Result<&ParameterValue, ParameterError> {
        self.entry(name).map(|entry| &entry.value)
    }

    pub(crate) fn describe(&self, name: &str) -> Result<ParameterDescriptor, ParameterError> {
        self.entry(name).map(|entry| entry.declaration.to_descriptor())
    }

    /// The refusal of a request that would take the value away.
    pub(crate) fn refuse_deletion(&self, name: &str) -> ParameterError {
        match self.entry(name) {
            Err(unknown) => unknown,
            Ok(entry) => ParameterError::Value {
                name: name.to_owned(),
                found: "not set".into(),
                allowed: entry.declaration.to_string(),
            },
        }
    }

    /// All names, sorted.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.keys().map(String::as_str)
    }

    fn entry(&self, name: &str) -> Result<&Entry, ParameterError> {
        self.entries.get(name).ok_or_else(|| self.unknown(name))
    }

    fn unknown(&self, name: &str) -> ParameterError {
        ParameterError::Unknown {
            name: name.to_owned(),
            known: self.names().map(str::to_owned).collect(),
        }
    }
}
