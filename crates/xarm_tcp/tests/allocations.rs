//! Sending a set-point takes no memory. A test of its own: the allocator that counts is for the whole program.

use std::time::Duration;

use devices::{Arm, ArmLink, SetPointStream};
use sim::arm::{ArmConfig, ArmController};
use xarm_tcp::{XArm, XArmConfig};

const HOME: [f64; 7] = [0.0, -0.4, 0.0, 0.7, 0.0, 1.1, 0.0];

#[tokio::test(flavor = "multi_thread")]
async fn sending_set_points_allocates_nothing() {
    let controller = ArmController::start(ArmConfig::default()).expect("ports are free");
    let ports = controller.ports();
    let arm = XArm::open(XArmConfig {
        control_port: ports.control,
        real_time_report_port: ports.real,
        rich_report_port: ports.rich,
        ..XArmConfig::new(controller.address().to_string())
    });
    let connected = |state: &devices::ArmState| matches!(state.link, ArmLink::Connected { .. });
    arm.state().wait_for(connected).await.expect("it runs");
    let stream = arm.arm().await.expect("it can be armed");
    let (sent, allocations) = tokio::task::spawn_blocking(|| measure(stream)).await.expect("it ends");
    assert_eq!(sent, 250);
    assert_eq!(allocations, 0);
    arm.close().await;
}

/// Set-points sent, and allocations of this thread meanwhile.
fn measure(mut stream: Box<dyn SetPointStream>) -> (usize, u64) {
    let mut sent = 0;
    let counted = allocation_counter::measure(|| {
        for _ in 0..250 {
            sent += usize::from(stream.send(&HOME).is_ok());
            std::thread::sleep(Duration::from_millis(4));
        }
    });
    let checked = allocation_counter::measure(|| drop(std::hint::black_box(vec![1_u8; 100])));
    assert_eq!(checked.count_total, 1, "what is allocated is counted");
    (sent, counted.count_total)
}
