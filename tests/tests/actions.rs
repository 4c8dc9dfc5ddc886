//! Actions between processes and within one.

use std::time::Duration;

use interfaces::rakelight_msgs::action::{PickCycle, PickCycleGoal, PickCycleResult};
use ros::{ActionClient, Error, GoalStatus, Node};
use scenarios::{Domain, Logs, Program, TIMEOUT, within};

const PROBE: &str = env!("CARGO_BIN_EXE_probe_node");

fn goal(target: &str) -> PickCycleGoal {
    PickCycleGoal {
        target: target.into(),
        ..PickCycleGoal::default()
    }
}

async fn client_of_probe(domain: &Domain) -> (Node, ActionClient<PickCycle>) {
    let node = domain.node("client").await;
    let client = node.action_client::<PickCycle>("pick_cycle").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    (node, client)
}

fn probe(domain: &Domain, step_millis: &str) -> Program {
    Program::start(
        domain,
        PROBE,
        &["--mute", "--step-millis", step_millis, "--end-with-stdin"],
    )
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_goal_is_accepted_tells_every_step_and_succeeds() {
    let domain = Domain::claim();
    let _probe = probe(&domain, "5");
    let (_node, client) = client_of_probe(&domain).await;
    let mut handle = client.send_goal(goal("cup"), TIMEOUT).await.unwrap();
    let mut steps = Vec::new();
    while let Some(feedback) = within("feedback", handle.feedback()).await {
        assert_eq!(feedback.capture_id, "cup");
        steps.push((feedback.progress * 5.0).round() as u32);
    }
    assert_eq!(steps, [1, 2, 3, 4, 5]);
    let (status, result) = handle.result(TIMEOUT).await.unwrap();
    assert_eq!(
        (status, result.success, result.capture_id.as_str()),
        (GoalStatus::Succeeded, true, "cup")
    );
    // The result stays for whoever asks again.
    assert_eq!(handle.result(TIMEOUT).await.unwrap().0, GoalStatus::Succeeded);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_rejected_goal_is_an_error_of_its_own() {
    let domain = Domain::claim();
    let _probe = probe(&domain, "5");
    let (_node, client) = client_of_probe(&domain).await;
    let error = client.send_goal(goal("reject"), TIMEOUT).await.err().unwrap();
    assert!(
        matches!(&error, Error::GoalRejected { action } if action == "/cell/pick_cycle"),
        "{error:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_cancel_reaches_its_goal_among_three() {
    let domain = Domain::claim();
    let _probe = probe(&domain, "20");
    let (_node, client) = client_of_probe(&domain).await;
    let mut first = client.send_goal(goal("hang"), TIMEOUT).await.unwrap();
    let second = client.send_goal(goal("hang"), TIMEOUT).await.unwrap();
    let third = client.send_goal(goal("bowl"), TIMEOUT).await.unwrap();
    second.cancel(TIMEOUT).await.unwrap();
    let (status, result) = second.result(TIMEOUT).await.unwrap();
    assert_eq!(status, GoalStatus::Canceled);
    assert!(
        result.reason.starts_with("hang cancelled before step"),
        "{}",
        result.reason
    );
    let (status, result) = third.result(TIMEOUT).await.unwrap();
    assert_eq!((status, result.capture_id.as_str()), (GoalStatus::Succeeded, "bowl"));
    // The first still runs, and none of the others' feedback came to it.
    let running = first.result(Duration::from_millis(50)).await;
    assert!(matches!(running, Err(Error::TimedOut { .. })), "{running:?}");
    for _ in 0..3 {
        assert_eq!(within("feedback", first.feedback()).await.unwrap().capture_id, "hang");
    }
    first.cancel(TIMEOUT).await.unwrap();
    assert_eq!(first.result(TIMEOUT).await.unwrap().0, GoalStatus::Canceled);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_goal_that_has_ended_cannot_be_cancelled() {
    let domain = Domain::claim();
    let _probe = probe(&domain, "1");
    let (_node, client) = client_of_probe(&domain).await;
    let handle = client.send_goal(goal("cup"), TIMEOUT).await.unwrap();
    handle.result(TIMEOUT).await.unwrap();
    let error = handle.cancel(TIMEOUT).await.unwrap_err();
    assert!(
        matches!(
            &error,
            Error::NotCancelled {
                reason: "it has ended",
                ..
            }
        ),
        "{error:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn aborted_and_dropped_goals_end_as_aborted() {
    let domain = Domain::claim();
    let probe = probe(&domain, "5");
    let (_node, client) = client_of_probe(&domain).await;
    let aborted = client.send_goal(goal("abort"), TIMEOUT).await.unwrap();
    let (status, result) = aborted.result(TIMEOUT).await.unwrap();
    assert_eq!(
        (status, result.reason.as_str()),
        (GoalStatus::Aborted, "asked to abort")
    );
    let dropped = client.send_goal(goal("drop"), TIMEOUT).await.unwrap();
    let (status, result) = dropped.result(TIMEOUT).await.unwrap();
    assert_eq!(
        (status, result.as_ref()),
        (GoalStatus::Aborted, &PickCycleResult::default())
    );
    assert!(
        probe.stderr().contains("a goal was dropped without a result"),
        "{}",
        probe.stderr()
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_killed_in_mid_goal_times_out() {
    let domain = Domain::claim();
    let mut probe = probe(&domain, "20");
    let (_node, client) = client_of_probe(&domain).await;
    let mut handle = client.send_goal(goal("hang"), TIMEOUT).await.unwrap();
    within("feedback", handle.feedback()).await.unwrap();
    probe.kill();
    let error = within("the time-out", handle.result(Duration::from_secs(1)))
        .await
        .unwrap_err();
    assert!(matches!(&error, Error::TimedOut { .. }), "{error:?}");
    let error = within("the time-out", handle.cancel(Duration::from_secs(1)))
        .await
        .unwrap_err();
    assert!(
        matches!(&error, Error::TimedOut { .. } | Error::NotFound { .. }),
        "{error:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_restarted_in_mid_goal_does_not_know_the_goal() {
    let domain = Domain::claim();
    let mut killed = probe(&domain, "20");
    let (_node, client) = client_of_probe(&domain).await;
    let handle = client.send_goal(goal("hang"), TIMEOUT).await.unwrap();
    killed.kill();
    let _restarted = probe(&domain, "20");
    let error = handle.result(TIMEOUT).await.unwrap_err();
    assert!(matches!(&error, Error::GoalForgotten { .. }), "{error:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_that_leaves_in_mid_goal_is_told_at_once() {
    let domain = Domain::claim();
    let mut probe = probe(&domain, "20");
    let (_node, client) = client_of_probe(&domain).await;
    let mut handle = client.send_goal(goal("hang"), TIMEOUT).await.unwrap();
    within("feedback", handle.feedback()).await.unwrap();
    assert!(probe.finish().success());
    // Either its last word (the goal was dropped, so aborted) or that it has gone; never a time-out.
    match handle.result(Duration::from_secs(5)).await {
        Ok((status, _)) => assert_eq!(status, GoalStatus::Aborted),
        Err(error) => assert!(matches!(&error, Error::ServerGone { .. }), "{error:?}"),
    }
    while within("the end of the feedback", handle.feedback()).await.is_some() {}
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_action_that_nobody_serves_is_not_found() {
    let domain = Domain::claim();
    let node = domain.node("client").await;
    let client = node.action_client::<PickCycle>("pick_cycle").unwrap();
    let error = client
        .send_goal(goal("cup"), Duration::from_millis(300))
        .await
        .err()
        .unwrap();
    assert!(
        matches!(&error, Error::NotFound { name, .. } if name == "/cell/pick_cycle"),
        "{error:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dropped_offer_is_rejected() {
    let domain = Domain::claim();
    let (serving, asking) = (domain.node("server").await, domain.node("client").await);
    let mut server = serving.action_server::<PickCycle>("pick_cycle").unwrap();
    let client = asking.action_client::<PickCycle>("pick_cycle").unwrap();
    let declining = async { drop(server.next().await.expect("an offer")) };
    let (outcome, ()) = within("the answer", async {
        tokio::join!(client.send_goal(goal("cup"), TIMEOUT), declining)
    })
    .await;
    assert!(matches!(outcome.err(), Some(Error::GoalRejected { .. })));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_goal_accepted_after_its_client_gave_up_is_cancelled() {
    let logs = Logs::collect();
    let domain = Domain::claim();
    let (serving, asking) = (domain.node("server").await, domain.node("impatient").await);
    let mut server = serving.action_server::<PickCycle>("late_cycle").unwrap();
    let client = asking.action_client::<PickCycle>("late_cycle").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    let outcome = client.send_goal(goal("cup"), Duration::from_millis(500)).await;
    assert!(matches!(outcome.err(), Some(Error::TimedOut { .. })));
    let goal = within("the offer", server.next())
        .await
        .unwrap()
        .accept()
        .await
        .unwrap();
    within("the cancel", goal.cancel_requested()).await;
    logs.wait_for(&["accepted too late", "/cell/late_cycle"]).await;
    goal.canceled(PickCycleResult::default()).unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_goal_nobody_cancelled_cannot_end_as_canceled() {
    let domain = Domain::claim();
    let (serving, asking) = (domain.node("server").await, domain.node("client").await);
    let mut server = serving.action_server::<PickCycle>("pick_cycle").unwrap();
    let client = asking.action_client::<PickCycle>("pick_cycle").unwrap();
    let executing = async {
        let active = server.next().await.expect("an offer").accept().await.unwrap();
        active.canceled(PickCycleResult {
            reason: "on a whim".into(),
            ..PickCycleResult::default()
        })
    };
    let (handle, ended) = within("the goal", async {
        tokio::join!(client.send_goal(goal("cup"), TIMEOUT), executing)
    })
    .await;
    let error = ended.unwrap_err();
    assert!(
        matches!(
            &error,
            Error::GoalState {
                state: GoalStatus::Executing,
                ..
            }
        ),
        "{error:?}"
    );
    let (status, result) = handle.unwrap().result(TIMEOUT).await.unwrap();
    assert_eq!((status, result.reason.as_str()), (GoalStatus::Aborted, "on a whim"));
}
