//! Launch configs: a ROS 2 parameter file with a `cell:` block that says which nodes run in which process.
//!
//! ```yaml
//! cell:
//!   namespace: /cell
//!   discovery_range: localhost     # or subnet; without it, the environment decides
//!   domain_id: 7                   # 0..=101; without it, the environment decides
//!   simulator: worlds/table.yaml   # world of the simulated cell, relative to this file; none on hardware
//!   processes:
//!     vision: [bag_player, normal_solver]
//! normal_solver:
//!   ros__parameters:
//!     signal_threshold: 0.002
//!     calibration: $(dirname)/calibration.yaml   # in the folder of this file, wherever rakelight is started
//! ```

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;

use crate::names::NodeNames;
use crate::options::{self, DiscoveryRange, NodeOptions};
use crate::parameters::{Origin, ParameterError, ParameterFile, ParameterValue, yaml};

/// As in ROS 2's own launch files.
const FOLDER: &str = "$(dirname)";

/// What a launch config says, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct LaunchConfig {
    /// The `cell:` block.
    pub cell: Cell,
    parameters: Arc<ParameterFile>,
    processes_origin: Origin,
}

/// Where the nodes are in the graph and in which process each runs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cell {
    /// Absolute namespace of all nodes.
    pub namespace: String,
    /// How far the nodes look for peers; `None` = as the environment says.
    pub discovery_range: Option<DiscoveryRange>,
    /// The ROS domain; `None` = as the environment says.
    pub domain_id: Option<u16>,
    /// World file of the simulated cell; `None` on hardware.
    pub simulator: Option<PathBuf>,
    /// Names of nodes by name of process.
    pub processes: BTreeMap<String, Vec<String>>,
}

impl LaunchConfig {
    /// Reads and checks a file.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, ParameterError> {
        let path = path.as_ref();
        let text = fs::read_to_string(path).map_err(|e| ParameterError::Read {
            path: path.to_owned(),
            reason: e.to_string(),
        })?;
        Self::parse(&text, &path.display().to_string())
    }

    /// Checks the text of a file; `source` names it in errors.
    pub fn parse(text: &str, source: &str) -> Result<Self, ParameterError> {
        let written: Document = serde_yaml_ng::from_str(text).map_err(|error| ParameterError::Yaml {
            origin: Origin {
                source: source.into(),
                line: error.location().map(|at| at.line()),
            },
            problem: error.to_string(),
        })?;
        let checker = Checker { text, source };
        let folder = checker.folder().display().to_string();
        let parameters = ParameterFile::parse(text, source)?.map_texts(|text| text.replace(FOLDER, &folder));
        let config = Self {
            cell: checker.cell(written.cell)?,
            parameters: Arc::new(parameters),
            processes_origin: checker.origin("processes"),
        };
        config.refuse_strays()?;
        Ok(config)
    }

    /// Options for a node of the cell: its namespace, domain, discovery range and parameters.
    pub fn node_options(&self, node: &str) -> NodeOptions {
        let options = NodeOptions::new(node)
            .namespace(&self.cell.namespace)
            .parameters_from(Arc::clone(&self.parameters));
        let options = self.cell.domain_id.into_iter().fold(options, NodeOptions::domain_id);
        self.cell
            .discovery_range
            .into_iter()
            .fold(options, NodeOptions::discovery_range)
    }

    /// What the config sets a node's parameters to, by name.
    pub fn parameters(&self, node: &str) -> BTreeMap<String, ParameterValue> {
        let name = format!("{}/{node}", self.cell.namespace.trim_end_matches('/'));
        let overrides = self.parameters.overrides_for(&name);
        overrides.into_iter().map(|(name, set)| (name, set.value)).collect()
    }

    /// Names of all nodes, process by process.
    pub fn nodes(&self) -> impl Iterator<Item = &str> {
        self.cell.processes.values().flatten().map(String::as_str)
    }

    /// Refuses a config with nodes that are not among `known`.
    pub fn check_nodes(&self, known: &[&str]) -> Result<(), ParameterError> {
        match self.nodes().find(|node| !known.contains(node)) {
            None => Ok(()),
            Some(node) => Err(ParameterError::Form {
                origin: self.processes_origin.clone(),
                found: format!("no node {node:?}"),
                allowed: known.join(", "),
            }),
        }
    }

    fn refuse_strays(&self) -> Result<(), ParameterError> {
        let prefix = self.cell.namespace.trim_end_matches('/');
        let nodes: Vec<String> = self.nodes().map(|node| format!("{prefix}/{node}")).collect();
        match self.parameters.strays(&nodes).next() {
            None => Ok(()),
            Some((pattern, origin)) => Err(ParameterError::Form {
                origin: origin.clone(),
                found: format!("parameters for {pattern}, which no process runs"),
                allowed: format!("cell, /**, {}", self.nodes().collect::<Vec<_>>().join(", ")),
            }),
        }
    }
}

/// The part of the file that serde reads; the sections of the nodes are [`ParameterFile`]'s.
#[derive(Deserialize)]
struct Document {
    cell: WrittenCell,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenCell {
    #[serde(default = "default_namespace")]
    namespace: String,
    discovery_range: Option<WrittenRange>,
    domain_id: Option<u16>,
    simulator: Option<PathBuf>,
    processes: BTreeMap<String, Vec<String>>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
enum WrittenRange {
    Localhost,
    Subnet,
}

fn default_namespace() -> String {
    "/cell".into()
}

struct Checker<'a> {
    text: &'a str,
    source: &'a str,
}

impl Checker<'_> {
    fn cell(&self, written: WrittenCell) -> Result<Cell, ParameterError> {
        self.processes(&written.processes)?;
        // A namespace is valid when a node can be in it.
        NodeNames::new("node", &written.namespace, &[]).map_err(|e| self.yaml("namespace", &e))?;
        if let Some(id) = written.domain_id {
            options::check_domain_id(&id.to_string()).map_err(|e| self.yaml("domain_id", &e))?;
        }
        let discovery_range = written.discovery_range.map(|range| match range {
            WrittenRange::Localhost => DiscoveryRange::Localhost,
            WrittenRange::Subnet => DiscoveryRange::Subnet,
        });
        let simulator = written.simulator.map(|world| self.beside(&world)).transpose()?;
        let WrittenCell {
            namespace,
            domain_id,
            processes,
            ..
        } = written;
        Ok(Cell {
            namespace,
            discovery_range,
            domain_id,
            simulator,
            processes,
        })
    }

    /// A path that is written relative to the config's own folder.
    fn beside(&self, path: &Path) -> Result<PathBuf, ParameterError> {
        if path.as_os_str().is_empty() {
            return Err(ParameterError::Form {
                origin: self.origin("simulator"),
                found: "simulator is empty".into(),
                allowed: "the path of a world file, or no such key on hardware".into(),
            });
        }
        Ok(self.folder().join(path))
    }

    fn folder(&self) -> &Path {
        match Path::new(self.source).parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        }
    }

    /// Every node is in one process and has a name that ROS allows.
    fn processes(&self, processes: &BTreeMap<String, Vec<String>>) -> Result<(), ParameterError> {
        let mut seen = BTreeMap::new();
        for (process, nodes) in processes {
            for node in nodes {
                NodeNames::new(node, "/", &[]).map_err(|e| self.yaml("processes", &e))?;
                if let Some(other) = seen.insert(node, process) {
                    let found = format!("node {node} in process {other} and in {process}");
                    return Err(ParameterError::Form {
                        origin: self.origin("processes"),
                        found,
                        allowed: "every node once".into(),
                    });
                }
            }
        }
        Ok(())
    }

    fn yaml(&self, key: &str, problem: &impl ToString) -> ParameterError {
        ParameterError::Yaml {
            origin: self.origin(key),
            problem: problem.to_string(),
        }
    }

    fn origin(&self, key: &str) -> Origin {
        Origin {
            source: self.source.into(),
            line: yaml::line_of(self.text, &["cell", key]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
cell:
  discovery_range: localhost
  domain_id: 7
  processes:
    vision: [bag_player, normal_solver]
    recorder: [bag_recorder]
/**:
  ros__parameters: {use_sim_time: true}
normal_solver:
  ros__parameters: {signal_threshold: 0.002}
";

    #[test]
    fn a_config_says_who_runs_where_and_with_what() {
        let config = LaunchConfig::parse(TEXT, "sim.yaml").unwrap();
        assert_eq!(config.cell.namespace, "/cell");
        assert_eq!(config.cell.domain_id, Some(7));
        assert_eq!(config.cell.discovery_range, Some(DiscoveryRange::Localhost));
        assert_eq!(
            config.nodes().collect::<Vec<_>>(),
            ["bag_recorder", "bag_player", "normal_solver"]
        );
        assert_eq!(
            config.check_nodes(&["bag_recorder", "bag_player", "normal_solver"]),
            Ok(())
        );
        let error = config.check_nodes(&["bag_player", "normal_solver"]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "sim.yaml:4: no node \"bag_recorder\"; allowed: bag_player, normal_solver"
        );
        let overrides = config
            .node_options("normal_solver")
            .resolved_overrides("/cell/normal_solver")
            .unwrap();
        assert_eq!(
            overrides.keys().collect::<Vec<_>>(),
            ["signal_threshold", "use_sim_time"]
        );
    }

    #[test]
    fn dirname_is_the_folder_of_the_config() {
        let text = TEXT.replacen(
            "signal_threshold: 0.002",
            "files: [$(dirname)/a.yaml, b], file: $(dirname)/c",
            1,
        );
        for (source, folder) in [("configs/sim.yaml", "configs"), ("sim.yaml", "."), ("/sim.yaml", "/")] {
            let parameters = LaunchConfig::parse(&text, source).unwrap().parameters("normal_solver");
            let files = vec![format!("{folder}/a.yaml"), "b".to_owned()];
            assert_eq!(parameters["files"], files.into());
            assert_eq!(parameters["file"], format!("{folder}/c").into());
        }
    }

    #[test]
    fn the_world_lies_relative_to_the_config() {
        let world = |line: &str, source: &str| {
            let text = TEXT.replacen("domain_id: 7", line, 1);
            LaunchConfig::parse(&text, source).map(|config| config.cell.simulator)
        };
        let relative = world("simulator: worlds/table.yaml", "configs/sim.yaml").unwrap();
        assert_eq!(relative.as_deref(), Some(Path::new("configs/worlds/table.yaml")));
        let absolute = world("simulator: /worlds/table.yaml", "configs/sim.yaml").unwrap();
        assert_eq!(absolute.as_deref(), Some(Path::new("/worlds/table.yaml")));
        assert_eq!(world("domain_id: 7", "sim.yaml").unwrap(), None);
        let error = world("simulator: ''", "sim.yaml").unwrap_err().to_string();
        assert!(
            error.starts_with("sim.yaml:3: simulator is empty; allowed: "),
            "{error}"
        );
    }

    #[test]
    fn unknown_keys_and_bad_values_are_refused_with_line_found_and_allowed() {
        for (from, to, expected) in [
            (
                "domain_id: 7",
                "domain: 7",
                "sim.yaml:3: cell: unknown field `domain`, expected one of `namespace`",
            ),
            (
                "domain_id: 7",
                "domain_id: 102",
                "sim.yaml:3: ROS_DOMAIN_ID is \"102\"; allowed: 0 to 101",
            ),
            (
                "localhost",
                "moon",
                "sim.yaml:2: cell.discovery_range: unknown variant `moon`, expected `localhost` or `subnet`",
            ),
            (
                "discovery_range: localhost",
                "namespace: 1cell",
                "sim.yaml:2: namespace name \"/1cell\" is not valid",
            ),
            (
                "[bag_recorder]",
                "[bag_player]",
                "sim.yaml:4: node bag_player in process recorder and in vision; allowed: every node once",
            ),
            (
                "[bag_recorder]",
                "[bag-recorder]",
                "sim.yaml:4: node name \"bag-recorder\" is not valid",
            ),
            (
                "[bag_recorder]",
                "bag_recorder",
                "sim.yaml:6: cell.processes.recorder: invalid type",
            ),
            (
                "\nnormal_solver:",
                "\nnormal_solvr:",
                "sim.yaml:9: parameters for normal_solvr, which no process runs; allowed: cell, /**, bag_recorder, bag_player, normal_solver",
            ),
            ("cell:", "cel:", "sim.yaml:1: missing field `cell`"),
        ] {
            let text = TEXT.replacen(from, to, 1);
            let error = LaunchConfig::parse(&text, "sim.yaml").unwrap_err().to_string();
            assert!(error.starts_with(expected), "{to}: {error}");
        }
    }

    #[test]
    fn every_launch_config_of_the_repository_is_valid() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../launch_configs");
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "yaml") {
                LaunchConfig::read(&path).unwrap();
            }
        }
    }
}
