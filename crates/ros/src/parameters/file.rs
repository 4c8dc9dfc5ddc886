//! Parameter files in the form that ROS 2 has for them.
//!
//! ```yaml
//! /**:                        # every node
//!   ros__parameters:
//!     use_sim_time: true
//! normal_solver:              # this node, in whatever namespace
//!   ros__parameters:
//!     lights:
//!       count: 6              # lights.count
//! /cell/grasp_planner:        # exactly this node
//!   ros__parameters: {margin: 0.01}
//! ```
//!
//! `*` stands for one part of a name and `**` for any number of parts. Of two sections that fit a node the more exact
//! one holds: full names, then bare names, then patterns; among equals, the later. What a section sets must be declared
//! by every node that it fits.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use serde_yaml_ng::{Mapping, Value};

use super::error::ParameterError;
use super::overrides::{Origin, Override, Overrides};
use super::value::ParameterValue;
use super::yaml;

const PARAMETERS: &str = "ros__parameters";
const FORM: &str = "`node:` with `ros__parameters:` below it";

/// The values that a file gives, by node.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterFile {
    sections: Vec<Section>,
}

/// The values for the nodes that a pattern fits.
#[derive(Debug, Clone, PartialEq)]
struct Section {
    pattern: String,
    origin: Origin,
    overrides: Overrides,
}

impl ParameterFile {
    /// Reads and checks a file. A `cell:` block, which launch configs have, is passed over.
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
        let source: Arc<str> = source.into();
        let value: Value = serde_yaml_ng::from_str(text).map_err(|error| ParameterError::Yaml {
            origin: Origin {
                source: Arc::clone(&source),
                line: error.location().map(|at| at.line()),
            },
            problem: error.to_string(),
        })?;
        let mut reader = Reader {
            text,
            source,
            path: Vec::new(),
            sections: Vec::new(),
        };
        match &value {
            Value::Null => {}
            Value::Mapping(nodes) => reader.nodes(nodes, "")?,
            _ => return Err(reader.form("no map", FORM)),
        }
        Ok(Self {
            sections: reader.sections,
        })
    }

    /// The same with every text changed.
    pub(crate) fn map_texts(mut self, change: impl Fn(&str) -> String) -> Self {
        let values = self
            .sections
            .iter_mut()
            .flat_map(|section| section.overrides.values_mut());
        for text in values.flat_map(|set| match &mut set.value {
            ParameterValue::String(text) => std::slice::from_mut(text),
            ParameterValue::Strings(texts) => texts.as_mut_slice(),
            _ => &mut [],
        }) {
            *text = change(text);
        }
        self
    }

    /// What the file sets for the node of this fully qualified name.
    pub fn overrides_for(&self, node: &str) -> Overrides {
        let mut fitting: Vec<&Section> = self.sections.iter().filter(|s| fits(&s.pattern, node)).collect();
        fitting.sort_by_key(|section| exactness(&section.pattern));
        fitting
            .into_iter()
            .flat_map(|section| section.overrides.clone())
            .collect()
    }

    /// Sections that name a single node, and that fit none of `nodes` (fully qualified names).
    pub(crate) fn strays<'a>(&'a self, nodes: &'a [String]) -> impl Iterator<Item = (&'a str, &'a Origin)> {
        self.sections
            .iter()
            .filter(|section| !nodes.iter().any(|node| fits(&section.pattern, node)) && section.pattern != "/**")
            .map(|section| (section.pattern.as_str(), &section.origin))
    }
}

struct Reader<'a> {
    text: &'a str,
    source: Arc<str>,
    /// Keys from the document's root to what is read now.
    path: Vec<String>,
    sections: Vec<Section>,
}

impl Reader<'_> {
    /// Node names, or namespaces with node names below them.
    fn nodes(&mut self, nodes: &Mapping, namespace: &str) -> Result<(), ParameterError> {
        for (key, value) in nodes {
            let name = self.enter(key, "the name of a node")?;
            if !(namespace.is_empty() && name == "cell" && is_cell_block(value)) {
                self.node(value, join(namespace, &name))?;
            }
            self.path.pop();
        }
        Ok(())
    }

    fn node(&mut self, value: &Value, pattern: String) -> Result<(), ParameterError> {
        let Value::Mapping(body) = value else {
            return Err(self.form(&describe(value), FORM));
        };
        let Some(parameters) = body.get(PARAMETERS) else {
            return self.nodes(body, &pattern);
        };
        if let Some(extra) = body.keys().find(|key| key.as_str() != Some(PARAMETERS)) {
            let found = format!("key {}", self.enter(extra, PARAMETERS)?);
            return Err(self.form(&found, PARAMETERS));
        }
        let origin = self.origin();
        let mut overrides = Overrides::new();
        self.path.push(PARAMETERS.into());
        match parameters {
            Value::Null => {}
            Value::Mapping(parameters) => self.parameters(parameters, "", &mut overrides)?,
            other => return Err(self.form(&describe(other), "a map of parameters")),
        }
        self.path.pop();
        self.sections.push(Section {
            pattern,
            origin,
            overrides,
        });
        Ok(())
    }

    /// Nested maps are names with dots.
    fn parameters(&mut self, block: &Mapping, prefix: &str, into: &mut Overrides) -> Result<(), ParameterError> {
        for (key, value) in block {
            let key = self.enter(key, "the name of a parameter")?;
            let name = if prefix.is_empty() {
                key
            } else {
                format!("{prefix}.{key}")
            };
            if let Value::Mapping(inner) = value {
                self.parameters(inner, &name, into)?;
            } else {
                let value = yaml::parameter_value(value)
                    .map_err(|found| self.form(&format!("{name} is {found}"), yaml::ALLOWED_VALUES))?;
                let origin = self.origin();
                if into.contains_key(&name) {
                    return Err(self.form(&format!("{name} is set for the second time"), "every parameter once"));
                }
                into.insert(name, Override { value, origin });
            }
            self.path.pop();
        }
        Ok(())
    }

    fn enter(&mut self, key: &Value, wanted: &str) -> Result<String, ParameterError> {
        let name = key
            .as_str()
            .ok_or_else(|| self.form(&format!("key {}", describe(key)), wanted))?
            .to_owned();
        self.path.push(name.clone());
        Ok(name)
    }

    fn origin(&self) -> Origin {
        let path: Vec<&str> = self.path.iter().map(String::as_str).collect();
        Origin {
            source: Arc::clone(&self.source),
            line: yaml::line_of(self.text, &path),
        }
    }

    fn form(&self, found: &str, allowed: &str) -> ParameterError {
        ParameterError::Form {
            origin: self.origin(),
            found: found.to_owned(),
            allowed: allowed.to_owned(),
        }
    }
}

/// A node or a namespace may be called `cell` too: then there are parameters or nodes below it.
fn is_cell_block(value: &Value) -> bool {
    value
        .get("processes")
        .is_some_and(|processes| processes.get(PARAMETERS).is_none())
}

fn describe(value: &Value) -> String {
    yaml::parameter_value(value).map_or_else(|found| found, |value| format!("{value} ({})", value.parameter_type()))
}

fn join(namespace: &str, name: &str) -> String {
    let name = if namespace.is_empty() {
        name
    } else {
        name.trim_start_matches('/')
    };
    match namespace {
        "" => name.to_owned(),
        // A namespace is absolute, with or without its slash.
        _ if namespace.starts_with('/') => format!("{namespace}/{name}"),
        _ => format!("/{namespace}/{name}"),
    }
}

/// How exactly a pattern says which node it means.
fn exactness(pattern: &str) -> u8 {
    match pattern {
        _ if pattern.contains('*') => 0,
        _ if !pattern.starts_with('/') => 1,
        _ => 2,
    }
}

fn fits(pattern: &str, node: &str) -> bool {
    let Some(absolute) = pattern.strip_prefix('/') else {
        return fits(&format!("/**/{pattern}"), node);
    };
    let pattern: Vec<&str> = absolute.split('/').collect();
    let node: Vec<&str> = node.trim_start_matches('/').split('/').collect();
    parts_fit(&pattern, &node)
}

fn parts_fit(pattern: &[&str], name: &[&str]) -> bool {
    match (pattern, name) {
        ([], []) => true,
        (["**", rest @ ..], _) => (0..=name.len()).any(|skipped| parts_fit(rest, &name[skipped..])),
        (["*", rest @ ..], [_, after @ ..]) => parts_fit(rest, after),
        ([part, rest @ ..], [first, after @ ..]) => part == first && parts_fit(rest, after),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
cell: {processes: {vision: [normal_solver]}}
/cell/normal_solver:
  ros__parameters:
    lights: {count: 7}
/**:
  ros__parameters:
    use_sim_time: true
    lights.count: 1
normal_solver:
  ros__parameters:
    lights:
      count: 6
      panels: [a, b]
line2:
  planner:
    ros__parameters:
";

    fn value(overrides: &Overrides, name: &str) -> (String, Option<usize>) {
        let found = &overrides[name];
        (found.value.to_string(), found.origin.line)
    }

    #[test]
    fn the_most_exact_section_holds() {
        let file = ParameterFile::parse(TEXT, "sim.yaml").unwrap();
        let solver = file.overrides_for("/cell/normal_solver");
        assert_eq!(value(&solver, "lights.count"), ("7".into(), Some(4)));
        assert_eq!(value(&solver, "lights.panels"), ("[\"a\", \"b\"]".into(), Some(13)));
        assert_eq!(
            value(&file.overrides_for("/other/normal_solver"), "lights.count"),
            ("6".into(), Some(12))
        );
        let other = file.overrides_for("/cell/other");
        assert_eq!(value(&other, "use_sim_time"), ("true".into(), Some(7)));
        assert_eq!(value(&other, "lights.count"), ("1".into(), Some(8)));
    }

    #[test]
    fn patterns_fit_whole_parts() {
        for (pattern, node, expected) in [
            ("/**", "/a", true),
            ("/**", "/cell/a", true),
            ("/*", "/a", true),
            ("/*", "/cell/a", false),
            ("/cell/*", "/cell/a", true),
            ("/**/a", "/x/y/a", true),
            ("/**/a", "/x/y/ba", false),
            ("a", "/a", true),
            ("/a", "/cell/a", false),
            ("cell/a", "/cell/a", true),
        ] {
            assert_eq!(fits(pattern, node), expected, "{pattern} {node}");
        }
    }

    #[test]
    fn a_namespace_called_cell_is_no_cell_block() {
        let text = "cell:\n  solver:\n    ros__parameters: {x: 1}\n";
        let overrides = ParameterFile::parse(text, "sim.yaml")
            .unwrap()
            .overrides_for("/cell/solver");
        assert_eq!(value(&overrides, "x"), ("1".into(), Some(3)));
    }

    #[test]
    fn sections_for_absent_nodes_are_strays() {
        let file = ParameterFile::parse(TEXT, "sim.yaml").unwrap();
        let nodes = ["/cell/normal_solver".to_owned()];
        let strays: Vec<_> = file.strays(&nodes).map(|(name, origin)| (name, origin.line)).collect();
        assert_eq!(strays, [("/line2/planner", Some(15))]);
    }

    #[test]
    fn files_of_another_form_are_refused_with_the_line() {
        for (text, expected) in [
            ("- a\n", "sim.yaml:1: no map; allowed: `node:`"),
            (
                "a:\n  ros_parameters:\n    x: 1\n",
                "sim.yaml:3: 1 (integer); allowed: `node:` with `ros__parameters:`",
            ),
            (
                "a:\n  ros__parameters: {}\n  extra: 1\n",
                "sim.yaml:3: key extra; allowed: ros__parameters",
            ),
            (
                "a:\n  ros__parameters:\n    x: ~\n",
                "sim.yaml:3: x is nothing; allowed: true or false",
            ),
            (
                "a:\n  ros__parameters:\n    x: [1, b]\n",
                "sim.yaml:3: x is a list of different types",
            ),
            (
                "a:\n  ros__parameters: 3\n",
                "sim.yaml:2: 3 (integer); allowed: a map of parameters",
            ),
            (
                "a:\n  1: {}\n",
                "sim.yaml:1: key 1 (integer); allowed: the name of a node",
            ),
            ("a:\n  x: 1\n  x: 2\n", "sim.yaml:2: a: duplicate entry"),
            (
                "a:\n  ros__parameters:\n    x: {y: 1}\n    x.y: 2\n",
                "sim.yaml:4: x.y is set for the second time; allowed: every parameter once",
            ),
            ("a: [1\n", "sim.yaml:2: did not find"),
        ] {
            let error = ParameterFile::parse(text, "sim.yaml").unwrap_err().to_string();
            assert!(error.starts_with(expected), "{text:?}: {error}");
        }
    }

    #[test]
    fn any_text_is_read_or_refused() {
        use proptest::prelude::*;
        proptest!(|(text in r"([a-c/*~:{}\[\]\-, \n]|ros__parameters:|\n  ){0,40}")| {
            let _ = ParameterFile::parse(&text, "sim.yaml");
        });
    }
}
