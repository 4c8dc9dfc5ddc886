//! Parameters: declared with type, default, range and unit; checked in one place; served to every ROS client.
//!
//! ```no_run
//! # async fn example() -> Result<(), ros::Error> {
//! use ros::parameters::Parameter;
//!
//! let node = ros::Node::start(ros::NodeOptions::new("normal_solver").parameter_file("launch_configs/sim.yaml")).await?;
//! let threshold = node.parameters().declare(
//!     Parameter::float("signal_threshold", 0.002).unit("fraction of full scale").range(0.0..=1.0),
//! )?;
//! node.parameters().seal()?; // start values for anything else are errors
//! let darkest = threshold.get();
//! # Ok(())
//! # }
//! ```

mod declaration;
mod error;
mod events;
mod file;
mod listing;
mod overrides;
mod services;
mod store;
#[cfg(test)]
mod tests;
mod value;
pub(crate) mod yaml;

use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::{mpsc, watch};

pub use declaration::Parameter;
pub use error::ParameterError;
pub use file::ParameterFile;
pub use overrides::{Origin, Override, Overrides};
pub use value::{ParameterKind, ParameterType, ParameterValue};

pub(crate) use events::publish as publish_events;
pub(crate) use overrides::from_options;
pub(crate) use services::serve;

use store::{Change, ParameterStore};

/// What changed, one batch per set request.
pub(crate) type Changes = mpsc::UnboundedReceiver<Vec<Change>>;

/// The parameters of a node. Clones are handles to the same parameters.
#[derive(Clone)]
pub struct Parameters {
    inner: Arc<Inner>,
}

struct Inner {
    store: Mutex<ParameterStore>,
    /// What changed, one message per set request, for `/parameter_events`.
    changes: mpsc::UnboundedSender<Vec<Change>>,
}

impl Parameters {
    /// The parameters of a node that is started with `overrides`, and the changes to tell others of.
    pub(crate) fn new(overrides: Overrides) -> (Self, Changes) {
        let (changes, receiver) = mpsc::unbounded_channel();
        let store = Mutex::new(ParameterStore::new(overrides));
        (
            Self {
                inner: Arc::new(Inner { store, changes }),
            },
            receiver,
        )
    }

    /// Declares a parameter. Its first value is the one the node was started with, or the default.
    pub fn declare<T: ParameterKind>(&self, parameter: Parameter<T>) -> Result<ParameterHandle<T>, ParameterError> {
        let name = parameter.declaration.name.clone();
        let mut store = self.inner.store.lock();
        let (value, change) = store.declare(parameter)?;
        self.tell(vec![change]);
        Ok(ParameterHandle {
            name,
            value,
            parameters: self.clone(),
        })
    }

    /// Ends the declarations: fails when the node was started with a value for a parameter that nobody declared.
    pub fn seal(&self) -> Result<(), ParameterError> {
        self.inner.store.lock().seal()
    }

    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Result<ParameterValue, ParameterError> {
        self.inner.store.lock().get(name).cloned()
    }

    /// Sets a parameter.
    pub fn set(&self, name: &str, value: impl Into<ParameterValue>) -> Result<(), ParameterError> {
        self.set_all(&[(name.to_owned(), value.into())])
    }

    /// Sets all of these or, when one of them is refused, none.
    pub fn set_all(&self, wanted: &[(String, ParameterValue)]) -> Result<(), ParameterError> {
        // The lock is held until the change is queued, so that changes are told in the order they were made.
        let mut store = self.inner.store.lock();
        let changes = store.set(wanted)?;
        self.tell(changes);
        Ok(())
    }

    /// Names of all parameters, sorted.
    pub fn names(&self) -> Vec<String> {
        self.inner.store.lock().names().map(str::to_owned).collect()
    }

    fn tell(&self, changes: Vec<Change>) {
        if !changes.is_empty() {
            // The receiver is gone only when the node is: then nobody is left to be told.
            let _ = self.inner.changes.send(changes);
        }
    }
}

/// A declared parameter: its value now, and a way to wait for the next one.
#[derive(Clone)]
pub struct ParameterHandle<T> {
    name: String,
    value: watch::Receiver<T>,
    parameters: Parameters,
}

impl<T: ParameterKind> ParameterHandle<T> {
    /// The value now.
    pub fn get(&self) -> T {
        self.value.borrow().clone()
    }

    /// Waits until the parameter has another value than before and gives that. Cancel safe.
    pub async fn changed(&mut self) -> T {
        // The sender lives in the store, which this handle keeps alive.
        let _ = self.value.changed().await;
        self.value.borrow_and_update().clone()
    }

    /// Sets it.
    pub fn set(&self, value: T) -> Result<(), ParameterError> {
        self.parameters.set_all(&[(self.name.clone(), value.into_value())])
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }
}
