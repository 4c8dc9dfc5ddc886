//! What goes wrong while something is lit.

use std::time::{Duration, Instant};

use devices::{LightBank, LightError, LightMode, LightSequence, PanelSet};
use sim::board::Pin;

use crate::rig::{Rig, capture, disconnected, sequence};

const ALL: PanelSet = PanelSet([true; 7]);

/// Half a second: time enough for a fault in its middle.
fn slow() -> LightSequence {
    sequence(Duration::from_millis(60), Duration::from_millis(5))
}

/// Does something once L2 is on, and gives back what the sequence came to.
async fn during_a_sequence(rig: &Rig, fault: impl FnOnce()) -> (usize, String) {
    rig.board.forget_edges();
    let (outcome, ()) = tokio::join!(rig.lights.run_sequence(slow()), async {
        rig.state("a sequence", |state| state.mode == LightMode::Sequence).await;
        tokio::task::block_in_place(|| {
            rig.board.wait_for_edge(Pin::Panel(2), true);
            fault();
        });
    });
    match outcome {
        Err(LightError::Incomplete { done, steps: 8, reason }) => (done, reason),
        other => panic!("{other:?}"),
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn unplugged_in_mid_sequence_it_is_void_and_back_within_seconds() {
    let Some(rig) = Rig::start().await else { return };
    let mut unplugged = Instant::now();
    let (done, reason) = during_a_sequence(&rig, || {
        rig.board.simulated.unplug().expect("it can be unplugged");
        unplugged = Instant::now();
    })
    .await;
    println!(
        "void after {done} steps, {:?} after the fault: {reason}",
        unplugged.elapsed()
    );
    assert!(reason.contains("was lost") && (1..8).contains(&done), "{reason}");
    rig.board.goes_dark();
    let reason = disconnected(&rig.lights, "does not exist").await;
    assert!(reason.contains("plugged in"), "{reason}");
    let refused = rig.lights.run_sequence(capture()).await;
    assert!(matches!(refused, Err(LightError::Disconnected { .. })), "{refused:?}");
    rig.board.simulated.plug().expect("it can be plugged");
    let plugged = Instant::now();
    rig.connected().await;
    println!("connected {:?} after it was plugged in again", plugged.elapsed());
    assert!(plugged.elapsed() < Duration::from_secs(4));
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
    assert_eq!(rig.lights.statistics().reconnects(), 1);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reset_in_mid_sequence_is_noticed_at_once() {
    let Some(rig) = Rig::start().await else { return };
    let mut reset = Instant::now();
    let (_, reason) = during_a_sequence(&rig, || {
        rig.board.simulated.reset(Duration::ZERO).expect("it can be reset");
        reset = Instant::now();
    })
    .await;
    println!("noticed {:?} after the reset: {reason}", reset.elapsed());
    assert!(reason.contains("reset line"), "{reason}");
    assert!(reset.elapsed() < Duration::from_millis(300));
    rig.board.goes_dark();
    rig.connected().await;
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
    assert_eq!(rig.lights.statistics().firmware_resets, 1);
}

/// Behind a boot loader there is silence first, and the BOOT is the last that is heard.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_reset_with_a_boot_loader_voids_the_sequence_too() {
    let Some(rig) = Rig::start().await else { return };
    let (_, reason) = during_a_sequence(&rig, || {
        rig.board
            .simulated
            .reset(Duration::from_secs(1))
            .expect("it can be reset");
    })
    .await;
    assert!(
        reason.contains("reset line") || reason.contains("its end was not reported"),
        "{reason}"
    );
    rig.board.goes_dark();
    rig.connected().await;
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_hung_firmware_resets_itself_and_is_found_again() {
    let Some(rig) = Rig::start().await else { return };
    let (_, reason) = during_a_sequence(&rig, || rig.board.simulated.hang().expect("it can hang")).await;
    assert!(reason.contains("hardware watchdog"), "{reason}");
    rig.board.goes_dark();
    rig.connected().await;
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_damaged_report_voids_the_sequence() {
    let Some(rig) = Rig::start().await else { return };
    let (done, reason) = during_a_sequence(&rig, || {
        // Of the report of L2's step, which is about to come; pings are answered in between.
        rig.board.wait_for_edge(Pin::Panel(2), false);
        rig.board
            .simulated
            .corrupt_bytes_to_host(30)
            .expect("it can be garbled");
    })
    .await;
    println!("{reason}");
    assert!(reason.starts_with("no report arrived of step ") && done < 8, "{reason}");
    assert!(rig.lights.statistics().bad_frames_received > 0);
    rig.board.goes_dark();
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn garbage_on_the_line_is_survived() {
    let Some(rig) = Rig::start().await else { return };
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..20 {
        let garbage: Vec<u8> = (0..random.usize(1..400)).map(|_| random.u8(..)).collect();
        rig.board.simulated.inject(&garbage).expect("it can be injected");
    }
    rig.lights.set(ALL, Duration::from_secs(5)).await.expect("it is lit");
    rig.lights.off().await.expect("it is off");
    assert!(rig.board.is_dark());
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
    let statistics = rig.lights.statistics();
    assert!(statistics.bad_frames_received > 0, "{statistics:?}");
    assert_eq!(statistics.connections, 1, "{statistics:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_command_that_arrives_damaged_is_sent_again() {
    let Some(rig) = Rig::start().await else { return };
    rig.board
        .simulated
        .corrupt_bytes_to_firmware(6)
        .expect("it can be garbled");
    rig.lights.set(ALL, Duration::from_secs(5)).await.expect("it is lit");
    assert_eq!(rig.lights.state().borrow().on, ALL);
    rig.board
        .simulated
        .drop_bytes_to_firmware(7)
        .expect("bytes can be lost");
    rig.lights.off().await.expect("it is off");
    assert!(rig.board.is_dark());
}

/// It may run or not: the cameras would see the triggers twice.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_sequence_that_arrives_damaged_is_void_and_not_sent_again() {
    let Some(rig) = Rig::start().await else { return };
    rig.board.forget_edges();
    for lost in [false, true] {
        // More than a ping, less than a sequence: whatever comes first.
        if lost {
            rig.board
                .simulated
                .drop_bytes_to_firmware(40)
                .expect("bytes can be lost");
        } else {
            rig.board
                .simulated
                .corrupt_bytes_to_firmware(40)
                .expect("it can be garbled");
        }
        let outcome = rig.lights.run_sequence(capture()).await;
        println!("{outcome:?}");
        assert!(
            matches!(outcome, Err(LightError::Incomplete { done: 0, steps: 8, .. })),
            "{outcome:?}"
        );
    }
    let edges = rig.board.edges();
    assert!(
        !edges.iter().any(|edge| edge.high),
        "nothing was lit, no camera triggered"
    );
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn off_aborts_a_sequence() {
    let Some(rig) = Rig::start().await else { return };
    rig.board.forget_edges();
    let (outcome, off) = tokio::join!(rig.lights.run_sequence(slow()), async {
        rig.state("a sequence", |state| state.mode == LightMode::Sequence).await;
        tokio::task::block_in_place(|| rig.board.wait_for_edge(Pin::Panel(2), true));
        rig.lights.off().await
    });
    assert_eq!(off, Ok(()));
    let Err(LightError::Incomplete { done, reason, .. }) = outcome else {
        panic!("{outcome:?}");
    };
    assert!(reason == "stopped by the host" && done >= 1, "{done}: {reason}");
    assert!(rig.board.is_dark());
    assert_eq!(
        rig.lights.run_sequence(capture()).await.expect("it runs").steps.len(),
        8
    );
}
