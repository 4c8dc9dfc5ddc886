//! The six services by which ROS clients see and change a node's parameters.
//!
//! Served here because the client library's own describe neither range nor unit.

use interfaces::Service;
use interfaces::rcl_interfaces::msg::{self, ParameterDescriptor, SetParametersResult};
use interfaces::rcl_interfaces::srv::{
    DescribeParameters, DescribeParametersRequest, DescribeParametersResponse, GetParameterTypes,
    GetParameterTypesRequest, GetParameterTypesResponse, GetParameters, GetParametersRequest, GetParametersResponse,
    ListParameters, ListParametersRequest, ListParametersResponse, SetParameters, SetParametersAtomically,
    SetParametersAtomicallyRequest, SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
};

use super::{ParameterError, ParameterValue, Parameters, listing};
use crate::error::Error;
use crate::node::Node;
use crate::service::ServiceServer;

/// Starts the services below the node's private name.
pub(crate) fn serve(node: &Node, parameters: &Parameters) -> Result<(), Error> {
    answer::<ListParameters>(node, parameters, "~/list_parameters", Parameters::on_list)?;
    answer::<GetParameters>(node, parameters, "~/get_parameters", Parameters::on_get)?;
    answer::<GetParameterTypes>(node, parameters, "~/get_parameter_types", Parameters::on_get_types)?;
    answer::<DescribeParameters>(node, parameters, "~/describe_parameters", Parameters::on_describe)?;
    answer::<SetParameters>(node, parameters, "~/set_parameters", Parameters::on_set)?;
    answer::<SetParametersAtomically>(
        node,
        parameters,
        "~/set_parameters_atomically",
        Parameters::on_set_atomically,
    )
}

fn answer<S: Service>(
    node: &Node,
    parameters: &Parameters,
    name: &str,
    respond: fn(&Parameters, &S::Request) -> S::Response,
) -> Result<(), Error> {
    let mut server: ServiceServer<S> = node.service_server(name)?;
    let parameters = parameters.clone();
    node.spawn(async move {
        while let Some(call) = server.next().await {
            let response = respond(&parameters, call.request());
            if let Err(error) = call.respond(response).await {
                tracing::warn!(service = server.name(), %error, "an answer is lost");
            }
        }
    });
    Ok(())
}

impl Parameters {
    pub(super) fn on_list(&self, request: &ListParametersRequest) -> ListParametersResponse {
        let store = self.inner.store.lock();
        ListParametersResponse {
            result: listing::list(store.names(), request),
        }
    }

    /// What is not declared is answered with "not set", so that values and names stay side by side.
    pub(super) fn on_get(&self, request: &GetParametersRequest) -> GetParametersResponse {
        let value = |name: &String| self.get(name).map(|value| value.to_wire()).unwrap_or_default();
        GetParametersResponse {
            values: request.names.iter().map(value).collect(),
        }
    }

    pub(super) fn on_get_types(&self, request: &GetParameterTypesRequest) -> GetParameterTypesResponse {
        let types: Vec<u8> = request
            .names
            .iter()
            .map(|name| {
                self.get(name)
                    .map_or(msg::ParameterType::PARAMETER_NOT_SET, |v| v.parameter_type().to_wire())
            })
            .collect();
        GetParameterTypesResponse { types: types.into() }
    }

    pub(super) fn on_describe(&self, request: &DescribeParametersRequest) -> DescribeParametersResponse {
        let store = self.inner.store.lock();
        let describe = |name: &String| {
            store.describe(name).unwrap_or_else(|_| ParameterDescriptor {
                name: name.clone(),
                ..Default::default()
            })
        };
        DescribeParametersResponse {
            descriptors: request.names.iter().map(describe).collect(),
        }
    }

    pub(super) fn on_set(&self, request: &SetParametersRequest) -> SetParametersResponse {
        let results = request
            .parameters
            .iter()
            .map(|one| self.set_from_wire(std::slice::from_ref(one)))
            .collect();
        SetParametersResponse { results }
    }

    pub(super) fn on_set_atomically(
        &self,
        request: &SetParametersAtomicallyRequest,
    ) -> SetParametersAtomicallyResponse {
        SetParametersAtomicallyResponse {
            result: self.set_from_wire(&request.parameters),
        }
    }

    fn set_from_wire(&self, wanted: &[msg::Parameter]) -> SetParametersResult {
        let outcome = wanted
            .iter()
            .map(|parameter| self.read_wire(parameter))
            .collect::<Result<Vec<_>, _>>()
            .and_then(|wanted| self.set_all(&wanted));
        match outcome {
            Ok(()) => SetParametersResult {
                successful: true,
                reason: String::new(),
            },
            Err(error) => SetParametersResult {
                successful: false,
                reason: error.to_string(),
            },
        }
    }

    fn read_wire(&self, parameter: &msg::Parameter) -> Result<(String, ParameterValue), ParameterError> {
        match ParameterValue::from_wire(&parameter.value) {
            Some(value) => Ok((parameter.name.clone(), value)),
            None => Err(self.inner.store.lock().refuse_deletion(&parameter.name)),
        }
    }
}
