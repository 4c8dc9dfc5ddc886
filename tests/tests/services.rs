//! Services between processes.

use std::time::Duration;

use interfaces::std_srvs::srv::{SetBool, SetBoolRequest, Trigger, TriggerRequest, TriggerResponse};
use ros::Error;
use scenarios::{Domain, Program, TIMEOUT, eventually, within};

const PROBE: &str = env!("CARGO_BIN_EXE_probe_node");

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_service_of_another_process_answers() {
    let domain = Domain::claim();
    let _probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    let node = domain.node("caller").await;
    let publish = node.service_client::<SetBool>("probe/publish").unwrap();
    let off = publish.call(SetBoolRequest { data: false }, TIMEOUT).await.unwrap();
    assert_eq!(
        (off.success, off.message.as_str()),
        (true, "publishing was true and is false")
    );
    let on = publish.call(SetBoolRequest { data: true }, TIMEOUT).await.unwrap();
    assert_eq!(on.message, "publishing was false and is true");
    let status = node.service_client::<Trigger>("probe/status").unwrap();
    let status = status.call(TriggerRequest::default(), TIMEOUT).await.unwrap();
    assert!(status.message.ends_with(" published"), "{}", status.message);
}

/// The server answers in the reverse order, so that only routing by request can be right.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn twenty_callers_at_once_each_get_their_own_reply() {
    let domain = Domain::claim();
    let serving = domain.node("server").await;
    let mut server = serving.service_server::<SetBool>("parity").unwrap();
    let served = tokio::spawn(async move {
        let mut calls = Vec::new();
        while calls.len() < 20 {
            calls.push(server.next().await.expect("the node runs"));
        }
        for call in calls.into_iter().rev() {
            let data = call.request().data;
            let message = if data { "true" } else { "false" }.to_owned();
            call.respond(interfaces::std_srvs::srv::SetBoolResponse { success: data, message })
                .await
                .unwrap();
        }
        server
    });
    let calling = domain.node("caller").await;
    let shared = calling.service_client::<SetBool>("parity").unwrap();
    let other = calling.service_client::<SetBool>("parity").unwrap();
    let calls = (0..20).map(|n| {
        let client = if n % 4 == 0 { other.clone() } else { shared.clone() };
        let data = n % 3 == 0;
        tokio::spawn(async move { (data, client.call(SetBoolRequest { data }, TIMEOUT).await) })
    });
    for call in calls.collect::<Vec<_>>() {
        let (asked, answer) = within("a reply", call).await.unwrap();
        let answer = answer.unwrap();
        assert_eq!((answer.success, answer.message == "true"), (asked, asked));
    }
    within("the server", served).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_service_that_nobody_serves_is_not_found() {
    let domain = Domain::claim();
    let node = domain.node("caller").await;
    let client = node.service_client::<Trigger>("absent").unwrap();
    let error = client
        .call(TriggerRequest::default(), Duration::from_millis(300))
        .await
        .unwrap_err();
    assert!(matches!(&error, Error::NotFound { .. }), "{error:?}");
    assert!(error.to_string().contains("/cell/absent"), "{error}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_server_killed_in_mid_call_times_out() {
    let domain = Domain::claim();
    let mut probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    let node = domain.node("caller").await;
    let client = node.service_client::<Trigger>("probe/slow").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    let call = tokio::spawn(async move { client.call(TriggerRequest::default(), Duration::from_secs(3)).await });
    probe.wait_for_line("slow call");
    probe.kill();
    let error = within("the time-out", call).await.unwrap().unwrap_err();
    assert!(matches!(&error, Error::TimedOut { .. }), "{error:?}");
    assert!(error.to_string().contains("/cell/probe/slow"), "{error}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_late_reply_is_not_given_to_the_next_call() {
    let domain = Domain::claim();
    let serving = domain.node("server").await;
    let mut server = serving.service_server::<Trigger>("ask").unwrap();
    let calling = domain.node("caller").await;
    let client = calling.service_client::<Trigger>("ask").unwrap();
    client.wait_for_server(TIMEOUT).await.unwrap();
    let impatient = client.call(TriggerRequest::default(), Duration::from_millis(500));
    let (outcome, held) = tokio::join!(impatient, server.next());
    assert!(matches!(outcome, Err(Error::TimedOut { .. })));
    let answers = async {
        let next = server.next().await.expect("the node runs");
        let say = |message: &str| TriggerResponse {
            success: true,
            message: message.into(),
        };
        held.expect("the first call came").respond(say("first")).await.unwrap();
        next.respond(say("second")).await.unwrap();
    };
    let (answer, ()) = within("the second call", async {
        tokio::join!(client.call(TriggerRequest::default(), TIMEOUT), answers)
    })
    .await;
    assert_eq!(answer.unwrap().message, "second");
}

/// A server that is busy when a node says "lights off" and leaves must still hear of it.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_last_words_of_a_node_are_heard_after_it_has_left() {
    let domain = Domain::claim();
    let serving = domain.node("server").await;
    let mut server = serving.service_server::<SetBool>("lit").unwrap();
    let calling = domain.node("caller").await;
    let client = calling.service_client::<SetBool>("lit").unwrap();
    for data in [true, false] {
        client.tell(SetBoolRequest { data }, TIMEOUT).await.unwrap();
    }
    drop(client);
    calling.shutdown().await;
    eventually("the leave", || serving.other_nodes().is_empty()).await;
    for data in [true, false] {
        let call = within("what was said", server.next()).await.expect("the node runs");
        assert_eq!(call.request().data, data);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_call_under_way_ends_with_its_node() {
    let domain = Domain::claim();
    let mut probe = Program::start(&domain, PROBE, &["--end-with-stdin"]);
    let node = domain.node("caller").await;
    let client = node.service_client::<Trigger>("probe/slow").unwrap();
    let call = tokio::spawn(async move { client.call(TriggerRequest::default(), TIMEOUT).await });
    probe.wait_for_line("slow call");
    node.shutdown().await;
    let error = within("the call", call).await.unwrap().unwrap_err();
    assert!(matches!(error, Error::ShutDown { .. }), "{error:?}");
}
