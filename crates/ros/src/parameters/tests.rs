//! Declarations, checks, and what the services answer; no wires.

#![allow(clippy::float_cmp)] // Parameters come back exactly as they were set.

use std::collections::BTreeMap;

use interfaces::rcl_interfaces::msg::{self, ParameterType as WireType};
use interfaces::rcl_interfaces::srv::{
    DescribeParametersRequest, GetParameterTypesRequest, GetParametersRequest, ListParametersRequest,
    SetParametersAtomicallyRequest, SetParametersRequest,
};

use super::*;

fn parameters() -> (Parameters, Changes) {
    Parameters::new(Overrides::new())
}

fn threshold() -> Parameter<f64> {
    Parameter::float("signal_threshold", 0.002)
        .unit("fraction of full scale")
        .range(0.0..=1.0)
        .describe("Darker is void")
}

fn started_with(name: &str, value: impl Into<ParameterValue>) -> Parameters {
    let values = BTreeMap::from([(name.to_owned(), value.into())]);
    Parameters::new(from_options(&values)).0
}

fn wire(name: &str, value: impl Into<ParameterValue>) -> msg::Parameter {
    msg::Parameter {
        name: name.into(),
        value: value.into().to_wire(),
    }
}

#[tokio::test]
async fn a_handle_sees_every_value() {
    let (parameters, _changes) = parameters();
    let mut handle = parameters.declare(threshold()).unwrap();
    assert_eq!(handle.get(), 0.002);
    parameters.set("signal_threshold", 0.5).unwrap();
    assert_eq!(handle.changed().await, 0.5);
    handle.set(0.25).unwrap();
    assert_eq!(handle.get(), 0.25);
    assert_eq!(parameters.get("signal_threshold").unwrap(), 0.25.into());
}

#[test]
fn values_outside_type_or_range_are_refused_with_found_and_allowed() {
    let (parameters, _changes) = parameters();
    parameters.declare(threshold()).unwrap();
    parameters
        .declare(Parameter::integer("count", 4).stepped_range(0..=9, 2))
        .unwrap();
    parameters
        .declare(Parameter::string("trigger", "hardware").one_of(["hardware", "software"]))
        .unwrap();
    parameters
        .declare(Parameter::floats("gains", [1.0]).range(0.0..=2.0))
        .unwrap();
    let allowed_threshold = "float from 0.0 to 1.0, unit: fraction of full scale";
    for (name, value, expected) in [
        (
            "signal_threshold",
            1.5.into(),
            format!("is 1.5 (float); allowed: {allowed_threshold}"),
        ),
        (
            "signal_threshold",
            f64::NAN.into(),
            format!("is NaN (float); allowed: {allowed_threshold}"),
        ),
        (
            "signal_threshold",
            1_i64.into(),
            format!("is 1 (integer); allowed: {allowed_threshold}"),
        ),
        (
            "count",
            3_i64.into(),
            "is 3 (integer); allowed: integer from 0 to 9 in steps of 2".into(),
        ),
        ("count", (-2_i64).into(), "is -2 (integer); allowed".into()),
        (
            "trigger",
            "soft".into(),
            "is \"soft\" (string); allowed: string, one of: hardware, software".into(),
        ),
        (
            "gains",
            vec![1.0, 2.5].into(),
            "is [1.0, 2.5] (float array); allowed: float array from 0.0 to 2.0".into(),
        ),
    ] {
        let error = parameters
            .set(name, ParameterValue::clone(&value))
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(&format!("parameter {name:?} {expected}")), "{error}");
    }
    for (name, value) in [
        ("count", ParameterValue::from(9_i64)),
        ("count", 8_i64.into()),
        ("signal_threshold", 1.0.into()),
    ] {
        parameters.set(name, value).unwrap();
    }
}

#[test]
fn stepped_floats_allow_every_step_and_the_end() {
    let (parameters, _changes) = parameters();
    let handle = parameters
        .declare(Parameter::float("angle", 0.0).stepped_range(0.0..=1.05, 0.1))
        .unwrap();
    for good in [0.1, 0.3, 0.7, 1.05] {
        handle.set(good).unwrap();
    }
    assert!(
        handle
            .set(0.15)
            .unwrap_err()
            .to_string()
            .ends_with("float from 0.0 to 1.05 in steps of 0.1")
    );
}

#[test]
fn declarations_that_contradict_themselves_are_refused() {
    let (parameters, _changes) = parameters();
    parameters.declare(Parameter::bool("twice", true)).unwrap();
    let failed = |result: Result<(), ParameterError>, expected: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    };
    let declare = |parameter| parameters.declare(parameter).map(drop);
    failed(
        parameters.declare(Parameter::bool("twice", true)).map(drop),
        "declared already",
    );
    failed(
        declare(Parameter::float("x", 3.0).range(0.0..=1.0)),
        "default does not fit: parameter \"x\" is 3.0",
    );
    failed(
        declare(Parameter::float("x", 3.0).stepped_range(0.0..=1.0, -1.0)),
        "is empty",
    );
    #[allow(clippy::reversed_empty_ranges)]
    {
        failed(declare(Parameter::float("x", 3.0).range(1.0..=0.0)), "is empty");
    }
    for name in ["", "a..b", "a b", "a."] {
        failed(declare(Parameter::float(name, 3.0)), "letters, digits and underscores");
    }
}

#[test]
fn read_only_parameters_take_their_value_at_the_start_only() {
    let parameters = started_with("serial", "COM3");
    let handle = parameters
        .declare(Parameter::string("serial", "none").read_only())
        .unwrap();
    assert_eq!(handle.get(), "COM3");
    let error = handle.set("COM4".into()).unwrap_err().to_string();
    assert_eq!(error, "parameter \"serial\" is read-only; it stays \"COM3\"");
}

#[test]
fn start_values_must_fit_and_be_declared() {
    let error = started_with("signal_threshold", 3.0)
        .declare(threshold())
        .err()
        .unwrap()
        .to_string();
    assert!(
        error.starts_with("node options: parameter \"signal_threshold\" is 3.0 (float); allowed: float from"),
        "{error}"
    );

    let parameters = started_with("signal_treshold", 0.1);
    parameters.declare(threshold()).unwrap();
    parameters.declare(Parameter::bool("use_sim_time", false)).unwrap();
    let error = parameters.seal().unwrap_err().to_string();
    let expected = "node options: there is no parameter \"signal_treshold\"; known: signal_threshold, use_sim_time";
    assert_eq!(error, expected);

    let parameters = started_with("signal_threshold", 1_i64);
    assert_eq!(parameters.declare(threshold()).unwrap().get(), 1.0);
    parameters.seal().unwrap();
}

#[test]
fn errors_in_files_name_file_line_key_and_what_is_known() {
    let text = "solver:\n  ros__parameters:\n    signal_threshold: dark\n    signal_treshold: 0.1\n";
    let overrides = ParameterFile::parse(text, "sim.yaml")
        .unwrap()
        .overrides_for("/cell/solver");
    let (parameters, _changes) = Parameters::new(overrides);
    let error = parameters.declare(threshold()).err().unwrap().to_string();
    assert!(
        error.starts_with("sim.yaml:3: parameter \"signal_threshold\" is \"dark\" (string); allowed: float"),
        "{error}"
    );
    parameters.declare(Parameter::bool("use_sim_time", false)).unwrap();
    let error = parameters.seal().unwrap_err().to_string();
    assert_eq!(
        error,
        "sim.yaml:4: there is no parameter \"signal_treshold\"; known: use_sim_time"
    );
}

#[test]
fn describe_tells_type_range_unit_and_read_only() {
    let (parameters, _changes) = parameters();
    parameters.declare(threshold()).unwrap();
    parameters
        .declare(Parameter::integer("count", 4).range(1..=8).read_only())
        .unwrap();
    parameters
        .declare(
            Parameter::string("mode", "solid")
                .one_of(["solid", "thin"])
                .unit("none"),
        )
        .unwrap();
    let names = ["signal_threshold", "count", "mode", "absent"]
        .map(str::to_owned)
        .to_vec();
    let described = parameters.on_describe(&DescribeParametersRequest { names }).descriptors;
    let [float, integer, text, absent] = &described[..] else {
        panic!("{described:?}")
    };
    assert_eq!(
        (float.name.as_str(), float.type_),
        ("signal_threshold", WireType::PARAMETER_DOUBLE)
    );
    assert_eq!(float.description, "Darker is void");
    assert_eq!(float.additional_constraints, "unit: fraction of full scale");
    let range = &float.floating_point_range[0];
    assert_eq!((range.from_value, range.to_value, range.step), (0.0, 1.0, 0.0));
    assert!(integer.read_only && !float.read_only && !float.dynamic_typing);
    let range = &integer.integer_range[0];
    assert_eq!((range.from_value, range.to_value, range.step), (1, 8, 1));
    assert_eq!(text.additional_constraints, "unit: none; one of: solid, thin");
    assert_eq!(
        (absent.name.as_str(), absent.type_),
        ("absent", WireType::PARAMETER_NOT_SET)
    );
}

#[test]
fn get_and_types_answer_in_order_also_for_the_unknown() {
    let (parameters, _changes) = parameters();
    parameters.declare(threshold()).unwrap();
    let names = vec!["absent".to_owned(), "signal_threshold".to_owned()];
    let values = parameters.on_get(&GetParametersRequest { names: names.clone() }).values;
    assert_eq!(
        (values[0].type_, values[1].double_value),
        (WireType::PARAMETER_NOT_SET, 0.002)
    );
    let types = parameters.on_get_types(&GetParameterTypesRequest { names }).types;
    assert_eq!(&types[..], [WireType::PARAMETER_NOT_SET, WireType::PARAMETER_DOUBLE]);
    let listed = parameters.on_list(&ListParametersRequest::default()).result.names;
    assert_eq!(listed, ["signal_threshold"]);
}

#[test]
fn set_treats_each_alone_and_set_atomically_all_or_none() {
    let (parameters, _changes) = parameters();
    parameters.declare(threshold()).unwrap();
    parameters.declare(Parameter::bool("enabled", false)).unwrap();
    let wanted = vec![
        wire("signal_threshold", 7.0),
        wire("enabled", true),
        wire("absent", true),
    ];
    let result = parameters
        .on_set_atomically(&SetParametersAtomicallyRequest {
            parameters: wanted.clone(),
        })
        .result;
    assert!(
        !result.successful && result.reason.contains("is 7.0 (float); allowed"),
        "{}",
        result.reason
    );
    assert_eq!(parameters.get("enabled").unwrap(), false.into());

    let results = parameters.on_set(&SetParametersRequest { parameters: wanted }).results;
    let outcomes: Vec<bool> = results.iter().map(|result| result.successful).collect();
    assert_eq!(outcomes, [false, true, false]);
    assert_eq!(
        results[2].reason,
        "there is no parameter \"absent\"; known: enabled, signal_threshold"
    );
    assert_eq!(parameters.get("enabled").unwrap(), true.into());

    let deletion = vec![msg::Parameter {
        name: "enabled".into(),
        ..Default::default()
    }];
    let result = &parameters
        .on_set(&SetParametersRequest { parameters: deletion })
        .results[0];
    assert_eq!(result.reason, "parameter \"enabled\" is not set; allowed: bool");
}

#[test]
fn changes_are_told_in_order_and_only_when_they_happened() {
    let (parameters, mut changes) = parameters();
    parameters.declare(threshold()).unwrap();
    parameters.set("signal_threshold", 2.0).unwrap_err();
    let both = [
        ("signal_threshold".to_owned(), 0.5.into()),
        ("signal_threshold".to_owned(), 0.75.into()),
    ];
    parameters.set_all(&both).unwrap();
    let told: Vec<Vec<(f64, bool)>> = std::iter::from_fn(|| changes.try_recv().ok())
        .map(|batch| {
            batch
                .iter()
                .map(|c| (f64::from_value(&c.value).unwrap(), c.declared))
                .collect()
        })
        .collect();
    assert_eq!(told, [vec![(0.002, true)], vec![(0.5, false), (0.75, false)]]);
}
