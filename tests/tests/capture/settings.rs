//! Parameters of the cameras while the node runs.

use interfaces::rcl_interfaces::srv::{SetParameters, SetParametersRequest};
use scenarios::{Logs, eventually, within};

use crate::images::Reader;
use crate::rig::{Plan, Rig};

fn value(rig: &Rig, name: &str) -> String {
    rig.camera_node.parameters().get(name).unwrap().to_string()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_changed_exposure_and_region_hold_from_the_next_capture() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let reader = Reader::new(&rig.viewer, "c2").await;
    let parameters = rig.camera_node.parameters();
    let changes = [
        ("c2.AcquisitionControl.ExposureTime", 1250.0.into()),
        ("c2.ImageFormatControl.Width", 64.into()),
        ("c2.ImageFormatControl.Height", 48.into()),
        ("c2.ImageFormatControl.OffsetX", 32.into()),
    ];
    parameters
        .set_all(&changes.map(|(name, value): (&str, ros::ParameterValue)| (name.to_owned(), value)))
        .unwrap();
    let answer = rig.capture(&[]).await;
    assert!(answer.success, "{}", answer.message);
    for taken in reader.taken(8).await {
        assert_eq!((taken.image.width, taken.image.height, taken.image.step), (64, 48, 128));
        assert_eq!(taken.exposure.exposure_time.nanosec, 1_250_000);
    }
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_value_that_the_camera_refuses_is_told_and_put_back() {
    let logs = Logs::collect();
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let reader = Reader::new(&rig.viewer, "c1").await;
    let width = "c1.ImageFormatControl.Width".to_owned();
    let height = "c1.ImageFormatControl.Height".to_owned();
    rig.camera_node
        .parameters()
        .set_all(&[(width.clone(), 60_000.into()), (height.clone(), 100.into())])
        .unwrap();
    eventually("the old width", || {
        value(&rig, &width) == "0" && value(&rig, &height) == "0"
    })
    .await;
    logs.wait_for(&["refused; the old values hold", "60000"]).await;
    let answer = rig.capture(&[]).await;
    assert!(answer.success, "{}", answer.message);
    assert!(reader.taken(8).await.iter().all(|taken| taken.image.width == 96));
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn values_out_of_range_are_refused_to_who_asks() {
    let Some(rig) = Rig::start(Plan::default()).await else {
        return;
    };
    let client = rig
        .viewer
        .service_client::<SetParameters>("camera_capture/set_parameters")
        .unwrap();
    let mut request = SetParametersRequest::default();
    let mut parameter = interfaces::rcl_interfaces::msg::Parameter {
        name: "c1.AcquisitionControl.ExposureTime".into(),
        ..Default::default()
    };
    parameter.value.type_ = interfaces::rcl_interfaces::msg::ParameterType::PARAMETER_DOUBLE;
    parameter.value.double_value = 1e9;
    request.parameters.push(parameter);
    let answer = within("the refusal", client.call(request, scenarios::TIMEOUT))
        .await
        .unwrap();
    assert!(
        !answer.results[0].successful && answer.results[0].reason.contains("900000"),
        "{answer:?}"
    );
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn start_values_that_mean_nothing_stop_the_node() {
    for (name, value, expected) in [
        (
            "cameras",
            ros::ParameterValue::from(Vec::<String>::new()),
            "one name or more",
        ),
        ("c1.pose", vec![0.0, 1.0].into(), "x y z qx qy qz qw"),
        ("c1.pose", vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0].into(), "c1.pose"),
        ("c1.camera_info_url", "/no/such/file.yaml".into(), "/no/such/file.yaml"),
        ("c2.ImageFormatControl.Width", 64.into(), "Width and Height 1 at least"),
        ("c1.guid", "".into(), "guid"),
        ("c3.guid", "10.0.0.1".into(), "c3.guid"),
    ] {
        let plan = Plan {
            parameters: vec![(name, value)],
            lights: false,
            ..Plan::default()
        };
        let Some(mut rig) = Rig::assemble(plan).await else {
            return;
        };
        let task = rig.camera_task.take().unwrap();
        let error = within("the refusal", task).await.unwrap().unwrap_err().to_string();
        assert!(error.contains(expected), "{name}: {error}");
        rig.stop().await;
    }
}
