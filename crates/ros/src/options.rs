//! How a node is named and which graph it joins.

use std::collections::BTreeMap;
use std::env;
use std::path::PathBuf;
use std::sync::Arc;

use crate::error::Error;
use crate::names::Remap;
use crate::parameters::{self, Overrides, ParameterFile, ParameterValue};

/// Highest domain whose ports stay below Linux's range of ephemeral ports (7400 + 250 * domain).
const MAX_DOMAIN_ID: u16 = 101;

/// How far a node looks for peers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiscoveryRange {
    /// This host only, over the loopback interface.
    Localhost,
    /// Every network interface, by multicast.
    Subnet,
}

/// Everything that decides a node's identity. What is not set here is read from the environment
/// (`ROS_DOMAIN_ID`, `ROS_AUTOMATIC_DISCOVERY_RANGE`) when the node starts.
#[derive(Debug, Clone)]
pub struct NodeOptions {
    pub(crate) name: String,
    pub(crate) namespace: String,
    pub(crate) remaps: Vec<Remap>,
    pub(crate) domain_id: Option<u16>,
    pub(crate) discovery_range: Option<DiscoveryRange>,
    parameters: Vec<ParameterSource>,
}

/// Where start values of parameters come from.
#[derive(Debug, Clone)]
enum ParameterSource {
    Values(BTreeMap<String, ParameterValue>),
    Path(PathBuf),
    File(Arc<ParameterFile>),
}

impl NodeOptions {
    /// A node called `name` in the root namespace.
    pub fn new(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            namespace: "/".into(),
            remaps: Vec::new(),
            domain_id: None,
            discovery_range: None,
            parameters: Vec::new(),
        }
    }

    /// Puts the node below `namespace` (absolute, such as "/cell").
    #[must_use]
    pub fn namespace(mut self, namespace: impl Into<String>) -> Self {
        self.namespace = namespace.into();
        self
    }

    /// Adds a remapping rule; the first that fits wins.
    #[must_use]
    pub fn remap(mut self, rule: Remap) -> Self {
        self.remaps.push(rule);
        self
    }

    /// Joins this domain (0..=101) whatever the environment says.
    #[must_use]
    pub fn domain_id(mut self, domain_id: u16) -> Self {
        self.domain_id = Some(domain_id);
        self
    }

    /// Looks for peers this far, whatever the environment says.
    #[must_use]
    pub fn discovery_range(mut self, range: DiscoveryRange) -> Self {
        self.discovery_range = Some(range);
        self
    }

    /// Gives a parameter its start value; it holds over what was given before.
    #[must_use]
    pub fn parameter(self, name: &str, value: impl Into<ParameterValue>) -> Self {
        self.parameter_overrides(BTreeMap::from([(name.to_owned(), value.into())]))
    }

    /// Gives parameters their start values; these hold over what was given before.
    #[must_use]
    pub fn parameter_overrides(mut self, values: BTreeMap<String, ParameterValue>) -> Self {
        self.parameters.push(ParameterSource::Values(values));
        self
    }

    /// Takes start values of parameters from a ROS 2 parameter file, which is read when the node starts; they hold
    /// over what was given before.
    #[must_use]
    pub fn parameter_file(mut self, path: impl Into<PathBuf>) -> Self {
        self.parameters.push(ParameterSource::Path(path.into()));
        self
    }

    /// Takes start values of parameters from a file that was read already.
    #[must_use]
    pub fn parameters_from(mut self, file: Arc<ParameterFile>) -> Self {
        self.parameters.push(ParameterSource::File(file));
        self
    }

    /// What the node of this fully qualified name starts with.
    pub(crate) fn resolved_overrides(&self, node: &str) -> Result<Overrides, Error> {
        let mut overrides = Overrides::new();
        for source in &self.parameters {
            overrides.extend(match source {
                ParameterSource::Values(values) => parameters::from_options(values),
                ParameterSource::Path(path) => ParameterFile::read(path)?.overrides_for(node),
                ParameterSource::File(file) => file.overrides_for(node),
            });
        }
        Ok(overrides)
    }

    /// The domain that the node will join: as set here, or as the environment says.
    pub fn resolved_domain_id(&self) -> Result<u16, Error> {
        match self.domain_id {
            Some(id) => check_domain_id(&id.to_string()),
            None => domain_id_from(env::var("ROS_DOMAIN_ID").ok().as_deref()),
        }
    }

    /// How far the node will look for peers: as set here, or as the environment says.
    pub fn resolved_discovery_range(&self) -> Result<DiscoveryRange, Error> {
        match self.discovery_range {
            Some(range) => Ok(range),
            None => discovery_range_from(
                env::var("ROS_AUTOMATIC_DISCOVERY_RANGE").ok().as_deref(),
                env::var("ROS_LOCALHOST_ONLY").ok().as_deref(),
            ),
        }
    }
}

fn domain_id_from(value: Option<&str>) -> Result<u16, Error> {
    value.filter(|v| !v.is_empty()).map_or(Ok(0), check_domain_id)
}

pub(crate) fn check_domain_id(value: &str) -> Result<u16, Error> {
    value
        .parse()
        .ok()
        .filter(|id| *id <= MAX_DOMAIN_ID)
        .ok_or_else(|| Error::Setting {
            setting: "ROS_DOMAIN_ID",
            found: value.to_owned(),
            allowed: "0 to 101",
        })
}

fn discovery_range_from(range: Option<&str>, localhost_only: Option<&str>) -> Result<DiscoveryRange, Error> {
    match (range, localhost_only) {
        (Some("LOCALHOST" | "OFF"), _) | (None | Some("" | "SYSTEM_DEFAULT"), Some("1")) => {
            Ok(DiscoveryRange::Localhost)
        }
        (None | Some("" | "SUBNET" | "SYSTEM_DEFAULT"), _) => Ok(DiscoveryRange::Subnet),
        (Some(found), _) => Err(Error::Setting {
            setting: "ROS_AUTOMATIC_DISCOVERY_RANGE",
            found: found.to_owned(),
            allowed: "LOCALHOST, SUBNET, SYSTEM_DEFAULT",
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn domain_ids_are_checked() {
        assert_eq!(domain_id_from(None).unwrap(), 0);
        assert_eq!(domain_id_from(Some("42")).unwrap(), 42);
        let error = domain_id_from(Some("102")).unwrap_err().to_string();
        assert_eq!(error, "ROS_DOMAIN_ID is \"102\"; allowed: 0 to 101");
    }

    #[test]
    fn discovery_range_follows_the_environment() {
        assert_eq!(discovery_range_from(None, None).unwrap(), DiscoveryRange::Subnet);
        assert_eq!(
            discovery_range_from(None, Some("1")).unwrap(),
            DiscoveryRange::Localhost
        );
        assert_eq!(
            discovery_range_from(Some("LOCALHOST"), None).unwrap(),
            DiscoveryRange::Localhost
        );
        assert_eq!(
            discovery_range_from(Some("SUBNET"), Some("1")).unwrap(),
            DiscoveryRange::Subnet
        );
        assert!(discovery_range_from(Some("MOON"), None).is_err());
    }
}
