//! Serving an action.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use interfaces::action_msgs::msg::GoalStatusArray;
use interfaces::action_msgs::srv::CancelGoal;
use interfaces::builtin_interfaces::msg::Time;
use interfaces::{Action, Service};
use parking_lot::Mutex;
use tokio::runtime::Handle;
use tokio::time::{MissedTickBehavior, interval};
use tokio_util::sync::{CancellationToken, DropGuard};
use tokio_util::task::TaskTracker;

use super::Names;
use super::book::{Answer, GoalBook};
use super::goal::{GoalEvent, GoalId, GoalStatus};
use super::wire::{FeedbackMessage, GetResult, GetResultResponse, SendGoal, SendGoalResponse};
use crate::clock::Clock;
use crate::error::Error;
use crate::node::Node;
use crate::publisher::Publisher;
use crate::qos::Qos;
use crate::service::{ServiceCall, ServiceServer};

/// How often old results are looked for.
const EXPIRY_CHECK: Duration = Duration::from_secs(5);

/// Takes goals of one action.
///
/// Dropping it stops the offers; goals under way go on, and results are served until the last of them has ended.
pub struct ActionServer<A: Action> {
    offers: ServiceServer<SendGoal<A>>,
    desk: Desk<A>,
}

/// A goal that waits for its answer. Dropping it rejects the goal.
pub struct GoalOffer<A: Action> {
    id: GoalId,
    call: Option<ServiceCall<SendGoal<A>>>,
    desk: Desk<A>,
}

/// A goal under way. Dropping it without a result aborts the goal with a default result, so that no client waits for
/// ever.
pub struct ActiveGoal<A: Action> {
    id: GoalId,
    goal: A::Goal,
    accepted_at: Time,
    cancel: CancellationToken,
    ended: bool,
    desk: Desk<A>,
}

type Book<A> = GoalBook<<A as Action>::Result, ServiceCall<GetResult<A>>>;

/// What the server and its goals share. The task that attends to cancels and results ends with the last of them.
struct Desk<A: Action> {
    core: Arc<Core<A>>,
    attended: Arc<DropGuard>,
}

impl<A: Action> Clone for Desk<A> {
    fn clone(&self) -> Self {
        Self {
            core: Arc::clone(&self.core),
            attended: Arc::clone(&self.attended),
        }
    }
}

struct Core<A: Action> {
    name: String,
    book: Mutex<Book<A>>,
    feedback: Publisher<FeedbackMessage<A::Feedback>>,
    /// Locked from looking into the book until the message is out, so that the latched status is the newest.
    status: Mutex<Publisher<GoalStatusArray>>,
    /// The node's: answers under way are sent before it has shut down.
    tasks: TaskTracker,
    runtime: Handle,
    clock: Clock,
}

impl<A: Action> ActionServer<A> {
    pub(crate) fn new(node: &Node, name: &str) -> Result<Self, Error> {
        let names = Names::of(name);
        let core = Arc::new(Core {
            name: name.to_owned(),
            book: Mutex::new(GoalBook::new()),
            feedback: node.publisher(&names.feedback, Qos::STREAM)?,
            status: Mutex::new(node.publisher(&names.status, Qos::LATCHED)?),
            tasks: node.tasks().clone(),
            runtime: Handle::current(),
            clock: node.clock().clone(),
        });
        let cancels = node.service_server::<CancelGoal>(&names.cancel_goal)?;
        let results = node.service_server::<GetResult<A>>(&names.get_result)?;
        let offers = node.service_server::<SendGoal<A>>(&names.send_goal)?;
        let stop = node.stop_token();
        core.tasks
            .spawn(attend(Arc::clone(&core), cancels, results, stop.clone()));
        core.publish_status();
        Ok(Self {
            offers,
            desk: Desk {
                core,
                attended: Arc::new(stop.drop_guard()),
            },
        })
    }

    /// The next goal that a client wants; `None` once the node is shut down. Cancel safe.
    ///
    /// A goal without an id, with an id that is in use, or beyond the 64 that may be under way is rejected with a
    /// warning and not offered.
    pub async fn next(&mut self) -> Option<GoalOffer<A>> {
        loop {
            let call = self.offers.next().await?;
            let id = GoalId::from(&call.request().goal_id);
            let offer = GoalOffer {
                id,
                call: Some(call),
                desk: self.desk.clone(),
            };
            let checked = self.desk.core.book.lock().check(id);
            match checked {
                Ok(()) => return Some(offer),
                Err(reason) => {
                    tracing::warn!(action = self.name(), goal = %id, %reason, "a goal is rejected");
                    drop(offer);
                }
            }
        }
    }

    /// Fully qualified name.
    pub fn name(&self) -> &str {
        &self.desk.core.name
    }
}

impl<A: Action> GoalOffer<A> {
    /// What the client wants.
    pub fn goal(&self) -> &A::Goal {
        // The call is taken only by functions that consume the offer.
        match &self.call {
            Some(call) => &call.request().goal,
            None => unreachable!("an offer has its call until it is consumed"),
        }
    }

    /// The goal's identity.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// Takes the goal and begins it. When the client cannot be told, the goal is given up and the error returned.
    pub async fn accept(mut self) -> Result<ActiveGoal<A>, Error> {
        let goal = self.goal().clone();
        let core = &self.desk.core;
        let accepted_at = core.clock.now();
        let begun = core.book.lock().begin(self.id, accepted_at);
        let cancel = begun.map_err(|reason| Error::GoalRefused {
            action: core.name.clone(),
            reason: reason.to_string(),
        })?;
        if let Some(call) = self.call.take()
            && let Err(error) = call.respond(answer(true, accepted_at)).await
        {
            core.book.lock().withdraw(self.id);
            return Err(error);
        }
        core.publish_status();
        Ok(ActiveGoal {
            id: self.id,
            goal,
            accepted_at,
            cancel,
            ended: false,
            desk: self.desk.clone(),
        })
    }

    /// Declines the goal.
    pub async fn reject(mut self) -> Result<(), Error> {
        match self.call.take() {
            Some(call) => call.respond(answer(false, Time::default())).await,
            None => Ok(()),
        }
    }
}

impl<A: Action> Drop for GoalOffer<A> {
    fn drop(&mut self) {
        if let Some(call) = self.call.take() {
            self.desk.core.answer(call, answer(false, Time::default()));
        }
    }
}

fn answer<G>(accepted: bool, stamp: Time) -> SendGoalResponse<G> {
    SendGoalResponse {
        accepted,
        stamp,
        action: PhantomData,
    }
}

impl<A: Action> ActiveGoal<A> {
    /// What the client wants.
    pub fn goal(&self) -> &A::Goal {
        &self.goal
    }

    /// The goal's identity.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// When the goal was accepted, by the node's clock.
    pub fn accepted_at(&self) -> Time {
        self.accepted_at
    }

    /// Tells the clients how far this goal is.
    pub fn feedback(&self, feedback: impl Into<Arc<A::Feedback>>) -> Result<(), Error> {
        self.desk.core.feedback.publish(FeedbackMessage {
            goal_id: self.id.message(),
            feedback: feedback.into(),
        })
    }

    /// Whether a client has asked to stop.
    pub fn is_cancel_requested(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Waits until a client asks to stop. Cancel safe.
    pub async fn cancel_requested(&self) {
        self.cancel.cancelled().await;
    }

    /// Ends the goal: done.
    pub fn succeed(self, result: impl Into<Arc<A::Result>>) -> Result<(), Error> {
        self.end(GoalEvent::Succeed, &result.into())
    }

    /// Ends the goal: given up.
    pub fn abort(self, result: impl Into<Arc<A::Result>>) -> Result<(), Error> {
        self.end(GoalEvent::Abort, &result.into())
    }

    /// Ends the goal: stopped because a client asked. If none did, the goal is aborted with this result and
    /// [`Error::GoalState`] says so.
    pub fn canceled(self, result: impl Into<Arc<A::Result>>) -> Result<(), Error> {
        self.end(GoalEvent::Cancel, &result.into())
    }

    fn end(mut self, event: GoalEvent, result: &Arc<A::Result>) -> Result<(), Error> {
        self.ended = true;
        match self.desk.core.end(self.id, event, result) {
            None => Ok(()),
            Some(state) => Err(Error::GoalState {
                action: self.desk.core.name.clone(),
                event,
                state,
            }),
        }
    }
}

impl<A: Action> Drop for ActiveGoal<A> {
    fn drop(&mut self) {
        if !self.ended {
            let core = &self.desk.core;
            tracing::warn!(action = core.name, goal = %self.id, "a goal was dropped without a result and is aborted");
            core.end(self.id, GoalEvent::Abort, &Arc::default());
        }
    }
}

impl<A: Action> Core<A> {
    /// Ends a goal, answers who waits for it, and gives back the state if that did not allow the event.
    fn end(&self, id: GoalId, event: GoalEvent, result: &Arc<A::Result>) -> Option<GoalStatus> {
        let outcome = self.book.lock().end(id, event, Arc::clone(result), Instant::now())?;
        for caller in outcome.waiting {
            self.answer(caller, result_of(outcome.status, Arc::clone(result)));
        }
        self.publish_status();
        outcome.refused_in
    }

    /// Answers in a task of its own: a caller that is not matched yet must not hold up the others.
    fn answer<S: Service>(&self, call: ServiceCall<S>, response: S::Response) {
        let answering = async move {
            if let Err(error) = call.respond(response).await {
                tracing::warn!(%error, "a caller of an action did not get its answer");
            }
        };
        self.tasks.spawn_on(answering, &self.runtime);
    }

    fn publish_status(&self) {
        let status = self.status.lock();
        let statuses = self.book.lock().statuses();
        if let Err(error) = status.publish(statuses) {
            tracing::warn!(%error, "cannot tell the states of the goals");
        }
    }

    fn on_cancel(&self, call: ServiceCall<CancelGoal>) {
        let response = self.book.lock().request_cancel(&call.request().goal_info);
        let changed = !response.goals_canceling.is_empty();
        self.answer(call, response);
        if changed {
            self.publish_status();
        }
    }

    fn on_result_request(&self, call: ServiceCall<GetResult<A>>) {
        let id = GoalId::from(&call.request().goal_id);
        let asked = self.book.lock().ask(id, call);
        match asked {
            Answer::Now { caller, status, result } => self.answer(caller, result_of(status, result)),
            Answer::Unknown { caller } => self.answer(caller, result_of(GoalStatus::Unknown, Arc::default())),
            Answer::WhenEnded { gave_way: Some(_) } => {
                tracing::debug!(action = self.name, goal = %id, "too many wait for the result; the oldest gives way");
            }
            Answer::WhenEnded { gave_way: None } => {}
        }
    }
}

fn result_of<R>(status: GoalStatus, result: Arc<R>) -> GetResultResponse<R> {
    GetResultResponse {
        status: status.code(),
        result,
    }
}

/// The one taker of cancels and requests for results.
async fn attend<A: Action>(
    core: Arc<Core<A>>,
    mut cancels: ServiceServer<CancelGoal>,
    mut results: ServiceServer<GetResult<A>>,
    stop: CancellationToken,
) {
    let mut expiry = interval(EXPIRY_CHECK);
    expiry.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            () = stop.cancelled() => return,
            Some(call) = cancels.next() => core.on_cancel(call),
            Some(call) = results.next() => core.on_result_request(call),
            _ = expiry.tick() => {
                let expired = core.book.lock().expire(Instant::now());
                if expired {
                    core.publish_status();
                }
            }
        }
    }
}
