//! `/rosout` and `/diagnostics` as another node sees them.

use interfaces::diagnostic_msgs::msg::{DiagnosticArray, DiagnosticStatus};
use interfaces::rcl_interfaces::msg::Log;
use ros::diagnostics::Status;
use ros::{Durability, Qos, RosoutLayer, Subscription};
use scenarios::{Domain, TIMEOUT, within};
use tracing::Instrument;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// What `ros2 topic echo /rosout` asks for.
const ROSOUT: Qos = Qos {
    durability: Durability::TransientLocal,
    ..Qos::reliable(1000)
};

fn install_layer() {
    // Tests of one process share the logger.
    let _ = tracing_subscriber::registry().with(RosoutLayer).try_init();
}

async fn record(records: &mut Subscription<Log>, text: &str) -> Log {
    let wanted = async {
        loop {
            let record = records.next().await.expect("the observer runs").message;
            if record.msg.contains(text) {
                return Log::clone(&record);
            }
        }
    };
    within(&format!("the record {text:?}"), wanted).await
}

#[tokio::test]
async fn what_a_node_logs_reaches_rosout_also_for_who_comes_late() {
    install_layer();
    let domain = Domain::claim();
    let solver = domain.node("normal_solver").await;
    tracing::warn!(node = solver.fully_qualified_name(), pixels = 31, "pixels are dark");
    async { tracing::error!("no light model") }
        .instrument(solver.span())
        .await;

    let observer = domain.node("observer").await;
    let mut records = observer.subscription::<Log>("/rosout", ROSOUT).unwrap();
    let dark = record(&mut records, "pixels are dark").await;
    assert_eq!((dark.level, dark.name.as_str()), (Log::WARN, "cell.normal_solver"));
    assert_eq!(dark.msg, "pixels are dark pixels=31");
    assert!(dark.file.ends_with("logging.rs") && dark.line > 0 && dark.stamp.sec > 0);
    let error = record(&mut records, "no light model").await;
    assert_eq!((error.level, error.name.as_str()), (Log::ERROR, "cell.normal_solver"));

    tracing::info!(node = solver.fully_qualified_name(), "still here");
    record(&mut records, "still here").await;
}

#[tokio::test]
async fn the_last_words_of_a_node_are_published() {
    install_layer();
    let domain = Domain::claim();
    let observer = domain.node("observer").await;
    let mut records = observer.subscription::<Log>("/rosout", ROSOUT).unwrap();
    let solver = domain.node("normal_solver").await;
    tracing::error!(node = solver.fully_qualified_name(), "going down");
    solver.shutdown().await;
    record(&mut records, "going down").await;
}

#[tokio::test]
async fn diagnostics_tell_of_every_part_and_of_the_transport() {
    let domain = Domain::claim();
    let (camera, observer) = (domain.node("camera_capture").await, domain.node("observer").await);
    camera.diagnostics().register("c1", "serial 42", || {
        Status::warn("warm").value("temperature", 61.5, "degC")
    });
    let mut reports = observer
        .subscription::<DiagnosticArray>("/diagnostics", Qos::reliable(10))
        .unwrap();
    reports.wait_for_publishers(1, TIMEOUT).await.unwrap();
    let statuses = within("a report of the camera", async {
        loop {
            let report = reports.next().await.expect("the observer runs").message;
            if report
                .status
                .iter()
                .any(|status| status.name == "cell/camera_capture: c1")
            {
                return report.status.clone();
            }
        }
    })
    .await;
    let part = |name: &str| {
        statuses
            .iter()
            .find(|status| status.name == name)
            .expect("the part is there")
    };
    let c1 = part("cell/camera_capture: c1");
    assert_eq!(
        (c1.level, c1.message.as_str(), c1.hardware_id.as_str()),
        (DiagnosticStatus::WARN, "warm", "serial 42")
    );
    assert_eq!(
        (c1.values[0].key.as_str(), c1.values[0].value.as_str()),
        ("temperature", "61.5 degC")
    );
    let transport = part("cell/camera_capture: transport");
    assert_eq!(transport.level, DiagnosticStatus::OK);
    assert!(
        transport
            .values
            .iter()
            .any(|value| value.key == "unreadable" && value.value == "0 messages")
    );
}
