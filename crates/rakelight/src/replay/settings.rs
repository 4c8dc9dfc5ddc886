//! With what the nodes solve and plan.

use std::collections::BTreeMap;

use anyhow::Context;
use calibration_files::LightsFile;
use ros::{LaunchConfig, ParameterValue};

use super::{Arguments, Nodes};
use crate::failure::Failure;
use crate::nodes::Running;
use crate::up::locate;

/// How long a capture may take to solve on a busy machine, seconds.
const PATIENCE: f64 = 120.0;

/// Parameters of the nodes.
pub(super) struct Settings {
    solver: BTreeMap<String, ParameterValue>,
    planner: BTreeMap<String, ParameterValue>,
}

impl Settings {
    /// Of the launch config that is named, else of the usual one, if there is one here. What is published live takes the
    /// lights to be far away unless told otherwise: that is quick enough for full-sized images in a row.
    pub(super) fn read(arguments: &Arguments) -> Result<Self, Failure> {
        let config = match &arguments.config {
            Some(path) => Some(path.clone()),
            None if arguments.r#loop => None,
            None => locate::config(None).ok(),
        };
        let config = config.map(LaunchConfig::read).transpose().map_err(Failure::usage)?;
        let of = |node: &str| {
            config
                .as_ref()
                .map(|config| config.parameters(node))
                .unwrap_or_default()
        };
        let mut settings = Self {
            solver: of(normal_solver::NAME),
            planner: of(grasp_planner::NAME),
        };
        if let Some(path) = &arguments.lights {
            LightsFile::read(path)
                .with_context(|| format!("{}", path.display()))
                .map_err(Failure::usage)?;
            settings
                .solver
                .insert("lights.file".into(), path.display().to_string().into());
        }
        settings.solver.insert("solve_timeout".into(), PATIENCE.into());
        settings.planner.insert("result_timeout".into(), PATIENCE.into());
        if !settings.has_lights() && !arguments.r#loop {
            eprintln!(
                "no calibration of the lights: normals are rough, and nothing can be planned; name one with --lights FILE"
            );
        }
        Ok(settings)
    }

    /// Without calibrated lights there are normals alone.
    pub(super) fn has_lights(&self) -> bool {
        let file = self.solver.get("lights.file");
        file.is_some_and(|file| *file != ParameterValue::from(""))
    }

    /// Of the cup's lip, metres, if the config says.
    pub(super) fn cup_diameter(&self) -> Option<f64> {
        match self.planner.get("cup.diameter") {
            Some(ParameterValue::Float(diameter)) => Some(*diameter),
            _ => None,
        }
    }

    pub(super) async fn start_nodes(&self, nodes: &Nodes<'_>, running: &mut Running) -> Result<(), Failure> {
        let options = |name, parameters: &BTreeMap<_, _>| nodes.options(name).parameter_overrides(parameters.clone());
        let (solver, planner) = (normal_solver::NAME, grasp_planner::NAME);
        running.start(solver, options(solver, &self.solver)).await?;
        if self.has_lights() {
            running.start(planner, options(planner, &self.planner)).await?;
        }
        Ok(())
    }
}
