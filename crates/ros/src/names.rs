//! ROS 2 names: validation, expansion of relative and private names, remapping.
//!
//! Rules: <https://design.ros2.org/articles/topic_and_service_names.html>.

use std::str::FromStr;

/// A name that breaks the rules: which, and why.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{kind} name {name:?} is not valid: {problem}")]
pub struct NameError {
    kind: &'static str,
    name: String,
    problem: String,
}

impl NameError {
    fn new(kind: &'static str, name: &str, problem: impl Into<String>) -> Self {
        Self {
            kind,
            name: name.to_owned(),
            problem: problem.into(),
        }
    }
}

/// One `from:=to` rule; `node:from:=to` holds for that node only.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remap {
    /// Base name of the node that the rule is for; `None` = every node.
    pub node: Option<String>,
    /// Name as the program writes it, or `__node` or `__ns`.
    pub from: String,
    /// Name that takes its place.
    pub to: String,
}

impl FromStr for Remap {
    type Err = NameError;

    fn from_str(rule: &str) -> Result<Self, NameError> {
        let (left, to) = rule
            .split_once(":=")
            .ok_or_else(|| NameError::new("remap", rule, "expected [node:]from:=to"))?;
        let (node, from) = match left.split_once(':') {
            Some((node, from)) => (Some(node.to_owned()), from),
            None => (None, left),
        };
        if from.is_empty() || to.is_empty() {
            return Err(NameError::new(
                "remap",
                rule,
                "expected [node:]from:=to, and neither side empty",
            ));
        }
        Ok(Self {
            node,
            from: from.to_owned(),
            to: to.to_owned(),
        })
    }
}

/// A node's place in the graph, and how it turns the names it is given into fully qualified ones.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct NodeNames {
    pub(crate) base: String,
    pub(crate) namespace: String,
    remaps: Vec<(String, String)>,
}

impl NodeNames {
    /// Applies `__node` and `__ns`, checks the result, and keeps the rules that concern this node.
    pub(crate) fn new(base: &str, namespace: &str, remaps: &[Remap]) -> Result<Self, NameError> {
        let mine = || remaps.iter().filter(|r| r.node.as_deref().is_none_or(|n| n == base));
        let renamed = |key: &str, default: &str| {
            mine()
                .find(|r| r.from == key)
                .map_or_else(|| default.to_owned(), |r| r.to.clone())
        };
        let mut names = Self {
            base: renamed("__node", base),
            namespace: renamed("__ns", namespace),
            remaps: Vec::new(),
        };
        if !names.namespace.starts_with('/') {
            names.namespace.insert(0, '/');
        }
        check_token("node", &names.base)?;
        if names.namespace != "/" {
            check_absolute("namespace", &names.namespace)?;
        }
        for rule in mine().filter(|r| !r.from.starts_with("__")) {
            names
                .remaps
                .push((names.expand("remap", &rule.from)?, names.expand("remap", &rule.to)?));
        }
        Ok(names)
    }

    pub(crate) fn fully_qualified(&self) -> String {
        join(&self.namespace, &self.base)
    }

    /// Absolute, expanded and remapped name of a topic, service or action.
    pub(crate) fn resolve(&self, kind: &'static str, name: &str) -> Result<String, NameError> {
        let full = self.expand(kind, name)?;
        let renamed = self
            .remaps
            .iter()
            .find(|(from, _)| *from == full)
            .map(|(_, to)| to.clone());
        Ok(renamed.unwrap_or(full))
    }

    fn expand(&self, kind: &'static str, name: &str) -> Result<String, NameError> {
        let full = if name.starts_with('/') {
            name.to_owned()
        } else if name == "~" {
            self.fully_qualified()
        } else if let Some(private) = name.strip_prefix("~/") {
            join(&self.fully_qualified(), private)
        } else {
            join(&self.namespace, name)
        };
        check_absolute(kind, &full).map_err(|e| NameError {
            name: name.to_owned(),
            ..e
        })?;
        Ok(full)
    }
}

fn join(namespace: &str, name: &str) -> String {
    if namespace == "/" {
        format!("/{name}")
    } else {
        format!("{namespace}/{name}")
    }
}

fn check_absolute(kind: &'static str, full: &str) -> Result<(), NameError> {
    full[1..]
        .split('/')
        .try_for_each(|token| check_token(kind, token))
        .map_err(|e| NameError {
            name: full.to_owned(),
            ..e
        })
}

fn check_token(kind: &'static str, token: &str) -> Result<(), NameError> {
    let bad = |problem: String| Err(NameError::new(kind, token, problem));
    match token.chars().next() {
        None => return bad("a part of it is empty (no doubled or trailing slash)".into()),
        Some(c) if c.is_ascii_digit() => return bad(format!("a part starts with the digit {c:?}")),
        Some(_) => {}
    }
    if let Some(c) = token.chars().find(|c| !(c.is_ascii_alphanumeric() || *c == '_')) {
        return bad(format!("{c:?} is not a letter, digit or underscore"));
    }
    if token.contains("__") {
        return bad("underscores must not repeat".into());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(remaps: &[&str]) -> NodeNames {
        let remaps: Vec<Remap> = remaps.iter().map(|r| r.parse().unwrap()).collect();
        NodeNames::new("solver", "/cell", &remaps).unwrap()
    }

    #[test]
    fn relative_private_and_absolute_names_expand() {
        let solver = names(&[]);
        assert_eq!(solver.resolve("topic", "c1/normals").unwrap(), "/cell/c1/normals");
        assert_eq!(solver.resolve("topic", "~/state").unwrap(), "/cell/solver/state");
        assert_eq!(solver.resolve("topic", "/tf").unwrap(), "/tf");
    }

    #[test]
    fn remaps_apply_to_the_named_node_only() {
        let solver = names(&["c1/normals:=/elsewhere", "other:/tf:=/tf2"]);
        assert_eq!(solver.resolve("topic", "c1/normals").unwrap(), "/elsewhere");
        assert_eq!(solver.resolve("topic", "/tf").unwrap(), "/tf");
    }

    #[test]
    fn node_and_namespace_can_be_remapped() {
        let solver = names(&["__node:=second", "__ns:=/line2"]);
        assert_eq!(solver.fully_qualified(), "/line2/second");
    }

    #[test]
    fn bad_names_are_refused_with_the_reason() {
        let solver = names(&[]);
        for (name, reason) in [
            ("c1//x", "empty"),
            ("1c", "digit"),
            ("a-b", "'-'"),
            ("a__b", "repeat"),
            ("c1/", "empty"),
            ("", "empty"),
        ] {
            let error = solver.resolve("topic", name).unwrap_err().to_string();
            assert!(
                error.contains(reason) && error.contains(&format!("{name:?}")),
                "{name}: {error}"
            );
        }
    }
}
