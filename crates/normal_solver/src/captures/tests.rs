use super::*;

const PATIENCE: Duration = Duration::from_secs(10);

const DONE: Done = Done {
    valid_fraction: 0.25,
    started_at: Time { sec: 5, nanosec: 0 },
    took: Duration::from_millis(300),
    note: String::new(),
};

fn cameras() -> Vec<String> {
    vec!["c1".into(), "c2".into()]
}

fn ask(id: &str, cameras: &[&str]) -> Ask {
    Ask {
        capture_id: id.into(),
        cameras: cameras.iter().map(|camera| (*camera).to_owned()).collect(),
    }
}

async fn outcome(captures: &Captures, ask: &Ask) -> Outcome {
    captures.wait(ask, &cameras(), PATIENCE).await.expect("known")
}

async fn refusal(captures: &Captures, id: &str) -> String {
    let waited = captures.wait(&ask(id, &[]), &cameras(), PATIENCE).await;
    waited.expect_err("nothing to wait for").to_string()
}

fn solve(captures: &Captures, id: &str, camera: &str) {
    captures.begin(id, camera);
    captures.solving(id, camera);
    captures.solved(id, camera, DONE);
}

#[tokio::test(start_paused = true)]
async fn an_answer_comes_when_the_last_camera_is_done() {
    let captures = Captures::default();
    solve(&captures, "a", "c1");
    captures.begin("a", "c2");
    let waiting = tokio::spawn({
        let captures = captures.clone();
        async move { outcome(&captures, &ask("", &[])).await }
    });
    tokio::task::yield_now().await;
    captures.solving("a", "c2");
    tokio::task::yield_now().await;
    assert!(!waiting.is_finished());
    captures.solved("a", "c2", DONE);
    let found = waiting.await.expect("no panic");
    assert_eq!((found.id.as_str(), found.problems.len()), ("a", 0));
    assert_eq!(found.solved, [("c1".to_owned(), DONE), ("c2".to_owned(), DONE)]);
}

#[tokio::test(start_paused = true)]
async fn what_is_solved_is_answered_at_once() {
    let captures = Captures::default();
    solve(&captures, "a", "c1");
    solve(&captures, "a", "c2");
    let asked = Instant::now();
    let found = outcome(&captures, &ask("a", &["c2"])).await;
    assert_eq!((found.solved.len(), found.problems.len()), (1, 0));
    assert_eq!(asked.elapsed(), Duration::ZERO);
}

#[tokio::test(start_paused = true)]
async fn a_capture_may_be_asked_for_before_its_images_come() {
    let captures = Captures::default();
    let waiting = tokio::spawn({
        let captures = captures.clone();
        async move { outcome(&captures, &ask("a", &[])).await }
    });
    tokio::time::sleep(BEGINNING / 2).await;
    solve(&captures, "a", "c1");
    tokio::time::sleep(BEGINNING / 2).await;
    assert!(!waiting.is_finished(), "c2 may still begin");
    solve(&captures, "a", "c2");
    assert_eq!(waiting.await.expect("no panic").solved.len(), 2);
}

#[tokio::test(start_paused = true)]
async fn a_camera_that_takes_no_part_is_named_only_when_it_was_asked_for() {
    let captures = Captures::default();
    solve(&captures, "a", "c1");
    let asked = Instant::now();
    let found = outcome(&captures, &ask("a", &["c1", "c2"])).await;
    assert_eq!(found.problems, ["c2 took no part in it"]);
    assert_eq!(asked.elapsed(), BEGINNING);
    let found = outcome(&captures, &ask("a", &[])).await;
    assert_eq!((found.solved.len(), found.problems.len()), (1, 0));
}

#[tokio::test(start_paused = true)]
async fn a_camera_at_work_on_the_capture_before_is_waited_for() {
    let captures = Captures::default();
    for camera in ["c1", "c2"] {
        captures.begin("a", camera);
    }
    let waiting = tokio::spawn({
        let captures = captures.clone();
        async move { outcome(&captures, &ask("b", &[])).await }
    });
    tokio::time::sleep(BEGINNING * 2).await;
    assert!(!waiting.is_finished());
    for camera in ["c1", "c2"] {
        captures.solved("a", camera, DONE);
        solve(&captures, "b", camera);
    }
    assert_eq!(waiting.await.expect("no panic").id, "b");
}

#[tokio::test(start_paused = true)]
async fn why_a_camera_has_no_normals_is_told() {
    let captures = Captures::default();
    captures.begin("a", "c1");
    captures.begin("a", "c2");
    captures.failed("a", "c2", "light channels [3] are missing".into());
    let found = outcome(&captures, &ask("a", &[])).await;
    assert_eq!(
        found.problems,
        [
            "c1: not all of its images came within 10.0 s",
            "c2: light channels [3] are missing"
        ]
    );
    captures.solving("a", "c1");
    let found = outcome(&captures, &ask("a", &["c1"])).await;
    assert_eq!(found.problems, ["c1 was still being solved after 10.0 s"]);
}

#[tokio::test(start_paused = true)]
async fn unknown_captures_are_refused_with_those_that_are_known() {
    let captures = Captures::default();
    let asked = Instant::now();
    assert_eq!(
        refusal(&captures, "").await,
        "no capture has come since the start, waited 1.0 s"
    );
    assert!(refusal(&captures, "x").await.ends_with("known: none"));
    assert_eq!(asked.elapsed(), 2 * BEGINNING);
    for count in 0..=REMEMBERED {
        solve(&captures, &count.to_string(), "c1");
    }
    let text = refusal(&captures, "0").await;
    assert!(
        text.contains("capture \"0\" is not known") && text.contains("known: 1, 2,"),
        "{text}"
    );
}

#[tokio::test(start_paused = true)]
async fn what_begins_anew_is_the_last_and_void_until_it_is_solved() {
    let captures = Captures::default();
    for id in ["a", "b"] {
        solve(&captures, id, "c1");
    }
    captures.begin("a", "c1");
    let found = outcome(&captures, &ask("", &["c1"])).await;
    assert_eq!((found.id.as_str(), found.solved.len()), ("a", 0));
    captures.solved("a", "c1", DONE);
    let found = outcome(&captures, &ask("", &["c1"])).await;
    assert_eq!((found.id.as_str(), found.solved.len()), ("a", 1));
}
