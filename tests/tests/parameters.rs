//! Parameters as another node sees them: by the six services and `/parameter_events`.

use std::collections::BTreeMap;
use std::time::Duration;

use interfaces::Service;
use interfaces::rcl_interfaces::msg::{Parameter as WireParameter, ParameterEvent, ParameterType, ParameterValue};
use interfaces::rcl_interfaces::srv::{
    DescribeParameters, DescribeParametersRequest, GetParameterTypes, GetParameterTypesRequest, GetParameters,
    GetParametersRequest, ListParameters, ListParametersRequest, SetParameters, SetParametersAtomically,
    SetParametersAtomicallyRequest, SetParametersRequest,
};
use ros::{Node, Parameter, ParameterHandle, Qos};
use scenarios::{Domain, TIMEOUT, within};

const SOLVER: &str = "/cell/normal_solver";

fn declare_threshold(node: &Node) -> ParameterHandle<f64> {
    let threshold = Parameter::float("signal.threshold", 0.002)
        .unit("fraction of full scale")
        .range(0.0..=1.0);
    node.parameters().declare(threshold).expect("the declaration is sound")
}

async fn ask<S: Service>(node: &Node, service: &str, request: S::Request) -> S::Response {
    let client = node
        .service_client::<S>(&format!("{SOLVER}/{service}"))
        .expect("a client can be made");
    let response = client.call(request, TIMEOUT).await.expect("the solver answers");
    S::Response::clone(&response)
}

fn wire(name: &str, value: f64) -> WireParameter {
    let value = ParameterValue {
        type_: ParameterType::PARAMETER_DOUBLE,
        double_value: value,
        ..Default::default()
    };
    WireParameter {
        name: name.into(),
        value,
    }
}

#[tokio::test]
async fn another_node_lists_describes_gets_and_sets_parameters() {
    let domain = Domain::claim();
    let (solver, observer) = (domain.node("normal_solver").await, domain.node("observer").await);
    let handle = declare_threshold(&solver);
    let names = vec!["signal.threshold".to_owned()];

    let request = ListParametersRequest {
        prefixes: vec!["signal".into()],
        ..Default::default()
    };
    let listed = ask::<ListParameters>(&observer, "list_parameters", request)
        .await
        .result;
    assert_eq!(
        (listed.names, listed.prefixes),
        (names.clone(), vec!["signal".to_owned()])
    );

    let request = DescribeParametersRequest { names: names.clone() };
    let described = ask::<DescribeParameters>(&observer, "describe_parameters", request)
        .await
        .descriptors;
    assert_eq!(
        described[0].floating_point_range[0].to_value.to_bits(),
        1.0_f64.to_bits()
    );
    assert_eq!(described[0].additional_constraints, "unit: fraction of full scale");

    let request = GetParameterTypesRequest { names: names.clone() };
    let types = ask::<GetParameterTypes>(&observer, "get_parameter_types", request)
        .await
        .types;
    assert_eq!(&types[..], [ParameterType::PARAMETER_DOUBLE]);

    let request = SetParametersRequest {
        parameters: vec![wire("signal.threshold", 0.5), wire("signal.threshold", 2.0)],
    };
    let results = ask::<SetParameters>(&observer, "set_parameters", request).await.results;
    assert!(results[0].successful && !results[1].successful);
    let expected = "parameter \"signal.threshold\" is 2.0 (float); allowed: float from 0.0 to 1.0";
    assert!(results[1].reason.starts_with(expected), "{}", results[1].reason);

    let request = SetParametersAtomicallyRequest {
        parameters: vec![wire("signal.threshold", 0.1), wire("absent", 2.0)],
    };
    let result = ask::<SetParametersAtomically>(&observer, "set_parameters_atomically", request)
        .await
        .result;
    assert_eq!(
        result.reason,
        "there is no parameter \"absent\"; known: signal.threshold, use_sim_time"
    );

    let values = ask::<GetParameters>(&observer, "get_parameters", GetParametersRequest { names })
        .await
        .values;
    assert_eq!(values[0].double_value.to_bits(), 0.5_f64.to_bits());
    assert_eq!(handle.get().to_bits(), 0.5_f64.to_bits());
    solver.shutdown().await;
}

#[tokio::test]
async fn changes_are_told_as_parameter_events() {
    let domain = Domain::claim();
    let observer = domain.node("observer").await;
    let mut events = observer
        .subscription::<ParameterEvent>("/parameter_events", Qos::reliable(1000))
        .unwrap();
    let solver = domain.node("normal_solver").await;
    let handle = declare_threshold(&solver);
    handle.set(0.5).unwrap();
    handle.set(7.0).unwrap_err();

    let (mut declared, mut changed) = (Vec::new(), BTreeMap::new());
    while changed.is_empty() {
        let event = within("a parameter event", events.next())
            .await
            .expect("the observer runs")
            .message;
        if event.node != SOLVER {
            continue;
        }
        assert!(event.stamp.sec > 0 && event.deleted_parameters.is_empty());
        declared.extend(event.new_parameters.iter().map(|parameter| parameter.name.clone()));
        changed.extend(
            event
                .changed_parameters
                .iter()
                .map(|p| (p.name.clone(), p.value.double_value.to_string())),
        );
    }
    assert_eq!(declared, ["use_sim_time", "signal.threshold"]);
    assert_eq!(
        changed,
        BTreeMap::from([("signal.threshold".to_owned(), "0.5".to_owned())])
    );
}

#[tokio::test]
async fn a_node_starts_with_the_values_of_its_file_and_refuses_what_it_does_not_know() {
    let domain = Domain::claim();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cell.yaml");
    let text = "normal_solver:\n  ros__parameters:\n    signal: {threshold: 0.25, treshold: 0.5}\n";
    std::fs::write(&path, text).unwrap();
    let options = domain.options("normal_solver").parameter_file(&path);
    let solver = Node::start(options.clone()).await.unwrap();
    assert_eq!(declare_threshold(&solver).get().to_bits(), 0.25_f64.to_bits());
    let error = solver.parameters().seal().unwrap_err().to_string();
    let known = "there is no parameter \"signal.treshold\"; known: signal.threshold, use_sim_time";
    assert_eq!(error, format!("{}:3: {known}", path.display()));
    solver.shutdown().await;

    std::fs::write(&path, "normal_solver:\n  ros__parameters:\n    use_sim_time: often\n").unwrap();
    let error = Node::start(options.clone())
        .await
        .err()
        .expect("the value is wrong")
        .to_string();
    assert_eq!(
        error,
        format!(
            "{}:3: parameter \"use_sim_time\" is \"often\" (string); allowed: bool",
            path.display()
        )
    );

    std::fs::remove_file(&path).unwrap();
    let error = Node::start(options)
        .await
        .err()
        .expect("the file is missing")
        .to_string();
    assert!(error.starts_with(&format!("cannot read {}", path.display())), "{error}");
}

#[tokio::test]
async fn a_handle_wakes_when_another_node_sets_its_parameter() {
    let domain = Domain::claim();
    let (solver, observer) = (domain.node("normal_solver").await, domain.node("observer").await);
    let mut handle = declare_threshold(&solver);
    let request = SetParametersRequest {
        parameters: vec![wire("signal.threshold", 0.75)],
    };
    let set = ask::<SetParameters>(&observer, "set_parameters", request);
    let (value, _) = tokio::join!(within("the new value", handle.changed()), set);
    assert_eq!(value.to_bits(), 0.75_f64.to_bits());
}

#[tokio::test]
async fn a_silent_node_answers_nobody() {
    let domain = Domain::claim();
    let observer = domain.node("observer").await;
    let client = observer
        .service_client::<ListParameters>(&format!("{SOLVER}/list_parameters"))
        .unwrap();
    let error = client
        .call(ListParametersRequest::default(), Duration::from_millis(50))
        .await
        .unwrap_err();
    assert!(
        error.to_string().contains("/cell/normal_solver/list_parameters"),
        "{error}"
    );
}
