//! The command-line arguments that every ROS 2 program takes: `--ros-args -r from:=to -p name:=value ...`.

use std::sync::Arc;

use crate::error::Error;
use crate::names::Remap;
use crate::options::NodeOptions;
use crate::parameters::ParameterFile;

const ALLOWED: &str = "-r or --remap [node:]from:=to, -p or --param [node:]name:=value, --params-file FILE, -- to end";

/// What stood behind `--ros-args`.
#[derive(Debug, Clone, Default)]
pub struct RosArguments {
    remaps: Vec<Remap>,
    parameters: Vec<Arc<ParameterFile>>,
}

impl RosArguments {
    /// Takes the ROS arguments out of a command line (as of `std::env::args`) and gives back the rest.
    pub fn split(arguments: impl IntoIterator<Item = String>) -> Result<(Vec<String>, Self), Error> {
        let mut rest = Vec::new();
        let mut found = Self::default();
        let mut arguments = arguments.into_iter();
        while let Some(argument) = arguments.next() {
            if argument == "--ros-args" {
                found.take(&mut arguments)?;
            } else {
                rest.push(argument);
            }
        }
        Ok((rest, found))
    }

    fn take(&mut self, arguments: &mut impl Iterator<Item = String>) -> Result<(), Error> {
        while let Some(flag) = arguments.next() {
            if flag == "--" {
                break;
            }
            let refused = || Error::Setting {
                setting: "--ros-args",
                found: flag.clone(),
                allowed: ALLOWED,
            };
            let mut value = || arguments.next().ok_or_else(refused);
            match flag.as_str() {
                "-r" | "--remap" => self.remaps.push(value()?.parse()?),
                "-p" | "--param" => self.parameters.push(Arc::new(one_parameter(&value()?)?)),
                "--params-file" => self.parameters.push(Arc::new(ParameterFile::read(value()?)?)),
                _ => return Err(refused()),
            }
        }
        Ok(())
    }

    /// Whether there were none.
    pub fn is_empty(&self) -> bool {
        self.remaps.is_empty() && self.parameters.is_empty()
    }

    /// Adds them to a node's options.
    #[must_use]
    pub fn apply_to(&self, options: NodeOptions) -> NodeOptions {
        let options = self.remaps.iter().cloned().fold(options, NodeOptions::remap);
        self.parameters
            .iter()
            .cloned()
            .fold(options, NodeOptions::parameters_from)
    }
}

/// `[node:]name:=value`, the value in YAML, as a parameter file of one line.
fn one_parameter(rule: &str) -> Result<ParameterFile, Error> {
    let refused = || Error::Setting {
        setting: "--param",
        found: rule.to_owned(),
        allowed: "[node:]name:=value",
    };
    let (left, value) = rule.split_once(":=").ok_or_else(refused)?;
    let (node, name) = left.split_once(':').unwrap_or(("/**", left));
    if node.is_empty() || name.is_empty() {
        return Err(refused());
    }
    let file = format!("{node}: {{ros__parameters: {{{name}: {value}}}}}");
    Ok(ParameterFile::parse(&file, &format!("--param {rule}"))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(line: &str) -> Result<(Vec<String>, RosArguments), Error> {
        RosArguments::split(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn ros_arguments_are_taken_out_of_the_command_line() {
        let (rest, ros) = split("node solver --ros-args -r a:=b -p solver:rate:=2.5 -- --config x").unwrap();
        assert_eq!(rest, ["node", "solver", "--config", "x"]);
        assert_eq!(ros.remaps.len(), 1);
        let overrides = ros.parameters[0].overrides_for("/solver");
        assert_eq!(overrides["rate"].value, crate::parameters::ParameterValue::Float(2.5));
    }

    #[test]
    fn what_means_nothing_is_refused() {
        for (line, part) in [
            ("--ros-args -x", "-x"),
            ("--ros-args -r", "-r"),
            ("--ros-args -p rate", "rate"),
        ] {
            let error = split(line).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains("allowed"), "{line}: {error}");
        }
    }
}
