//! Lights and cameras.

use gige_vision::Faults;
use scenarios::table_with;
use sim::cell::Place;

use crate::{BLOCK, assert_picks_again, assert_safe, cell, objects, pick, places};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_a_dead_light_the_others_do_and_the_result_says_so() {
    let Some(cell) = cell(BLOCK).await else { return };
    let dead = format!("{}\nlights: {{dead: [3]}}", objects(BLOCK));
    cell.set_world(table_with(&dead).unwrap()).unwrap();
    let result = pick(&cell).await;
    let says_so = result.reason.contains("c1: solved without L3, which gives no light");
    assert!(result.success && says_so, "{}", result.reason);
    assert_eq!(places(&cell), [Place::InBin]);
    assert_safe(&cell).await;
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn with_one_camera_gone_the_other_goes_on_and_the_result_says_so() {
    let Some(cell) = cell(BLOCK).await else { return };
    let cable = |out: bool| {
        let faults = Faults {
            muted: out,
            ..Faults::default()
        };
        cell.simulated.camera("c2").unwrap().set_faults(faults);
    };
    cable(true);
    let result = pick(&cell).await;
    assert!(result.success && result.reason.contains("c2"), "{}", result.reason);
    assert_eq!(places(&cell), [Place::InBin]);
    cable(false);
    assert_picks_again(&cell).await;
    cell.stop().await.unwrap();
}
