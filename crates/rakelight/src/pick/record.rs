//! `--record`: the coordinator's parameters, set for these picks and set back after them.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, ensure};
use interfaces::rcl_interfaces::msg::{Parameter, ParameterType, ParameterValue};
use interfaces::rcl_interfaces::srv::{GetParameters, GetParametersRequest, SetParameters, SetParametersRequest};
use ros::{Node, ServiceClient};

const PATIENCE: Duration = Duration::from_secs(6);
const NAMES: [&str; 2] = ["record", "record_folder"];

/// The coordinator records every cycle.
pub(super) struct Recording {
    set: ServiceClient<SetParameters>,
    before: Vec<Parameter>,
}

impl Recording {
    /// Into a folder, which is made.
    pub(super) async fn begin(node: &Node, folder: &Path) -> anyhow::Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
        let folder = std::path::absolute(folder)?;
        let service = |name| format!("{}/{name}", cell_coordinator::NAME);
        let get = node.service_client::<GetParameters>(&service("get_parameters"))?;
        let names = NAMES.map(str::to_owned).to_vec();
        let answer = get.call(GetParametersRequest { names }, PATIENCE).await?;
        let before = NAMES.iter().zip(&answer.values);
        let recording = Self {
            set: node.service_client(&service("set_parameters"))?,
            before: before.map(|(name, value)| parameter(name, value.clone())).collect(),
        };
        let values = ["all".to_owned(), folder.display().to_string()].map(text);
        let wanted = NAMES.into_iter().zip(values);
        let wanted = wanted.map(|(name, value)| parameter(name, value)).collect();
        set(&recording.set, wanted).await?;
        Ok(recording)
    }

    /// As it was before.
    pub(super) async fn end(self) -> anyhow::Result<()> {
        set(&self.set, self.before).await
    }
}

async fn set(client: &ServiceClient<SetParameters>, parameters: Vec<Parameter>) -> anyhow::Result<()> {
    let answer = client.call(SetParametersRequest { parameters }, PATIENCE).await?;
    for result in &answer.results {
        ensure!(
            result.successful,
            "the coordinator does not record so: {}",
            result.reason
        );
    }
    Ok(())
}

fn parameter(name: &str, value: ParameterValue) -> Parameter {
    Parameter {
        name: name.to_owned(),
        value,
    }
}

fn text(value: String) -> ParameterValue {
    ParameterValue {
        type_: ParameterType::PARAMETER_STRING,
        string_value: value,
        ..ParameterValue::default()
    }
}
