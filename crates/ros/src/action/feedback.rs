//! Feedback on the client's side: one taker, which hands it to the goal that it is for.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use interfaces::Action;
use parking_lot::Mutex;
use tokio::sync::broadcast;
use tokio::time::sleep;
use tokio_util::sync::CancellationToken;

use super::goal::GoalId;
use super::wire::FeedbackMessage;
use crate::graph::Graph;
use crate::subscription::Subscription;

/// Feedback kept for a goal whose handle is slow; beyond it the oldest is lost.
const FEEDBACK_DEPTH: usize = 64;
/// How often the feedback's publisher is looked for until it is there.
const RECHECK: Duration = Duration::from_millis(50);

/// Where the feedback of each goal goes.
pub(super) struct FeedbackRoutes<A: Action> {
    goals: Mutex<BTreeMap<GoalId, broadcast::Sender<Arc<A::Feedback>>>>,
    /// Whether the server's feedback reaches us.
    connected: AtomicBool,
}

impl<A: Action> FeedbackRoutes<A> {
    pub(super) fn new() -> Self {
        Self {
            goals: Mutex::default(),
            connected: AtomicBool::new(false),
        }
    }

    pub(super) fn is_connected(&self) -> bool {
        self.connected.load(Ordering::Relaxed)
    }
}

/// The way of one goal's feedback, closed when dropped.
pub(super) struct Route<A: Action> {
    pub(super) id: GoalId,
    routes: Arc<FeedbackRoutes<A>>,
}

impl<A: Action> Route<A> {
    pub(super) fn open(routes: &Arc<FeedbackRoutes<A>>, id: GoalId) -> (Self, broadcast::Receiver<Arc<A::Feedback>>) {
        let (sender, receiver) = broadcast::channel(FEEDBACK_DEPTH);
        routes.goals.lock().insert(id, sender);
        let routes = Arc::clone(routes);
        (Self { id, routes }, receiver)
    }
}

impl<A: Action> Drop for Route<A> {
    fn drop(&mut self) {
        self.routes.goals.lock().remove(&self.id);
    }
}

/// The one taker of feedback: gives it to the goal that it is for; that of other clients' goals passes by.
pub(super) async fn route_feedback<A: Action>(
    mut subscription: Subscription<FeedbackMessage<A::Feedback>>,
    routes: Arc<FeedbackRoutes<A>>,
    graph: Arc<Graph>,
    stop: CancellationToken,
) {
    let mut changes = graph.changes();
    loop {
        let connected = subscription.publisher_count() > 0;
        routes.connected.store(connected, Ordering::Relaxed);
        let received = tokio::select! {
            () = stop.cancelled() => return,
            received = subscription.next() => received,
            _ = changes.changed() => continue,
            // A server in this process appears without an event.
            () = sleep(RECHECK), if !connected => continue,
        };
        let Some(received) = received else { return };
        let goal = routes
            .goals
            .lock()
            .get(&GoalId::from(&received.message.goal_id))
            .cloned();
        // Fails when the handle is gone: then nobody wants it.
        goal.map(|goal| goal.send(Arc::clone(&received.message.feedback)));
    }
}
