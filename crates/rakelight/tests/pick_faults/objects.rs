//! What lies on the table.

use interfaces::rakelight_msgs::msg::{ArmState, CellState};
use ros::Qos;
use scenarios::{eventually, table_with, within};
use sim::cell::Place;

use crate::{
    BLOCK, assert_failed, assert_last_error, assert_picks_again, assert_safe, cell, objects, pick, places, stage,
};

const SMALL: &str = "{shape: {kind: box, size: [0.014, 0.014, 0.02]}, pose: {x: 0.45, y: 0.02}, albedo: 0.7}";

/// Hills and dents everywhere.
const TEXTURED: &str = "{shape: {kind: relief, size: [0.06, 0.06], height: 0.03, depth: 0.02, cells: 80}, \
                        pose: {x: 0.45, y: 0.02}, albedo: 0.7}";

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_the_cup_cannot_hold_is_refused_with_the_test_that_failed_and_nothing_moves() {
    let Some(cell) = cell("").await else { return };
    let joints = || cell.simulated.arm().unwrap().moment().joints;
    let home = joints();
    for (list, texts) in [
        ("", ["nothing to pick", ""]),
        (SMALL, ["nothing to pick", "border"]),
        (TEXTURED, ["nothing to pick", ""]),
    ] {
        cell.set_world(table_with(&objects(list)).unwrap()).unwrap();
        let result = pick(&cell).await;
        assert_failed(&result, CellState::PLAN, &texts);
        assert_last_error(&cell, &result.reason).await;
        let moved = joints().into_iter().zip(home).map(|(now, then)| (now - then).abs());
        assert!(moved.fold(0.0, f64::max) < 1e-9, "the arm has moved");
    }
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_object_that_moves_after_the_capture_is_found_where_it_is() {
    let Some(cell) = cell(BLOCK).await else { return };
    let goal = cell.begin(crate::solid()).await.unwrap();
    stage(&cell, CellState::EXECUTE).await;
    let moved = BLOCK.replace("x: 0.45, y: 0.02", "x: 0.40, y: -0.05");
    cell.set_world(table_with(&objects(&moved)).unwrap()).unwrap();
    let (_, result) = cell.end_of(&goal).await.unwrap();
    assert!(result.success, "{}", result.reason);
    assert_eq!(places(&cell), [Place::InBin]);
    let captures = result
        .timings
        .iter()
        .filter(|timing| timing.stage == CellState::CAPTURE);
    assert!(
        captures.count() > 2,
        "it was seen once more before it was taken: {result:?}"
    );
    assert_safe(&cell).await;
    cell.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_object_that_is_lost_in_transit_is_told() {
    let Some(cell) = cell(BLOCK).await else { return };
    let mut states = cell
        .operator
        .subscription::<ArmState>("arm/state", Qos::STREAM)
        .unwrap();
    let goal = cell.begin(crate::solid()).await.unwrap();
    eventually("the object to hang on the cup", || places(&cell) == [Place::Held]).await;
    within("the arm to know it", async {
        while states.next().await.expect("the node runs").message.vacuum != ArmState::VACUUM_HELD {}
    })
    .await;
    tokio::time::sleep(std::time::Duration::from_secs(1)).await;
    cell.simulated.arm().unwrap().lose_object();
    let (_, result) = cell.end_of(&goal).await.unwrap();
    assert!(result.reason.contains("dropped on the way"), "{}", result.reason);
    assert_safe(&cell).await;
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}
