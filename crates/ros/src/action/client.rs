//! Asking for an action.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

use interfaces::Action;
use interfaces::action_msgs::msg::GoalInfo;
use interfaces::action_msgs::srv::{CancelGoal, CancelGoalRequest, CancelGoalResponse};
use interfaces::builtin_interfaces::msg::Time;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{broadcast, oneshot, watch};
use tokio::time::{Instant, sleep, timeout, timeout_at};
use tokio_util::sync::{CancellationToken, DropGuard};

use super::Names;
use super::feedback::{FeedbackRoutes, Route, route_feedback};
use super::goal::{GoalId, GoalStatus};
use super::wire::{GetResult, GetResultRequest, SendGoal, SendGoalRequest, SendGoalResponse};
use crate::error::Error;
use crate::graph::Graph;
use crate::node::Node;
use crate::qos::Qos;
use crate::service::ServiceClient;

/// How long one request for the result waits before it is sent again: an answer may have been lost, and a server that
/// was restarted does not know the goal.
const RESULT_PATIENCE: Duration = Duration::from_secs(5);
/// How long to wait before a request that could not be sent is sent again.
const RETRY_AFTER: Duration = Duration::from_millis(50);
/// How long the last feedback may come behind the result; they travel by different topics.
const FEEDBACK_GRACE: Duration = Duration::from_millis(50);
/// How long a late acceptance of a goal that was given up is waited for, in order to cancel the goal.
const LATE_ANSWER: Duration = Duration::from_mins(1);
/// How long that cancel may take.
const LATE_CANCEL: Duration = Duration::from_secs(2);

/// Sends goals of one action. Clones share one set of endpoints; any number of goals may be under way.
pub struct ActionClient<A: Action> {
    inner: Arc<Inner<A>>,
}

impl<A: Action> Clone for ActionClient<A> {
    fn clone(&self) -> Self {
        Self {
            inner: Arc::clone(&self.inner),
        }
    }
}

struct Inner<A: Action> {
    name: String,
    node: String,
    graph: Arc<Graph>,
    send_goal: ServiceClient<SendGoal<A>>,
    cancel_goal: ServiceClient<CancelGoal>,
    get_result: ServiceClient<GetResult<A>>,
    feedback: Arc<FeedbackRoutes<A>>,
    stop: CancellationToken,
}

/// A goal that was accepted. Dropping the handle leaves the goal alone; [`Self::cancel`] stops it.
pub struct GoalHandle<A: Action> {
    id: GoalId,
    accepted_at: Time,
    feedback: broadcast::Receiver<Arc<A::Feedback>>,
    outcome: watch::Receiver<Option<Outcome<A::Result>>>,
    client: Arc<Inner<A>>,
    /// Ends the task that asks for the result.
    _followed: DropGuard,
}

type Outcome<R> = Result<(GoalStatus, Arc<R>), Loss>;

/// Why a goal's result will never come.
#[derive(Debug, Clone, Copy)]
enum Loss {
    ServerGone,
    Forgotten,
}

impl<A: Action> ActionClient<A> {
    pub(crate) fn new(node: &Node, name: &str) -> Result<Self, Error> {
        let names = Names::of(name);
        let stop = node.stop_token();
        let routes = Arc::new(FeedbackRoutes::new());
        let inner = Inner {
            name: name.to_owned(),
            node: node.fully_qualified_name(),
            graph: Arc::clone(node.graph()),
            send_goal: node.service_client(&names.send_goal)?,
            cancel_goal: node.service_client(&names.cancel_goal)?,
            get_result: node.service_client(&names.get_result)?,
            feedback: Arc::clone(&routes),
            stop: stop.clone(),
        };
        let feedback = node.subscription(&names.feedback, Qos::STREAM)?;
        node.tasks()
            .spawn(route_feedback(feedback, routes, Arc::clone(&inner.graph), stop));
        Ok(Self { inner: Arc::new(inner) })
    }

    /// Asks for a goal and waits until it is accepted. `timeout` covers finding the server and its answer.
    ///
    /// A goal that the server declines is [`Error::GoalRejected`]. A goal that is accepted after the time-out is
    /// cancelled: nothing runs of which nobody holds a handle.
    pub async fn send_goal(&self, goal: impl Into<A::Goal>, timeout: Duration) -> Result<GoalHandle<A>, Error> {
        let deadline = Instant::now() + timeout;
        self.wait_for_server(timeout).await?;
        let id = GoalId::random();
        let (route, feedback) = Route::open(&self.inner.feedback, id);
        let (told, answer) = oneshot::channel();
        tokio::spawn(Arc::clone(&self.inner).ask(id, goal.into(), told));
        let late = |_| self.inner.timed_out(timeout);
        let answer = timeout_at(deadline, answer).await.map_err(late)?;
        let answer = answer.map_err(|_| self.inner.shut_down())??;
        if !answer.accepted {
            return Err(Error::GoalRejected {
                action: self.inner.name.clone(),
            });
        }
        let (told, outcome) = watch::channel(None);
        let stop = self.inner.stop.child_token();
        tokio::spawn(follow(Arc::clone(&self.inner), route, told, stop.clone()));
        Ok(GoalHandle {
            id,
            accepted_at: answer.stamp,
            feedback,
            outcome,
            client: Arc::clone(&self.inner),
            _followed: stop.drop_guard(),
        })
    }

    /// Whether a server is matched with every service and its feedback.
    pub fn server_is_ready(&self) -> bool {
        self.inner.server_is_ready() && self.inner.feedback.is_connected()
    }

    /// Waits until [`Self::server_is_ready`].
    pub async fn wait_for_server(&self, timeout: Duration) -> Result<(), Error> {
        let found = self.inner.graph.wait_until(timeout, || self.server_is_ready()).await;
        found.map_err(|waited| Error::NotFound {
            what: "server of action",
            name: self.inner.name.clone(),
            waited,
        })
    }

    /// Fully qualified name.
    pub fn name(&self) -> &str {
        &self.inner.name
    }
}

type Acceptance<A> = Result<Arc<SendGoalResponse<<A as Action>::Goal>>, Error>;

impl<A: Action> Inner<A> {
    fn server_is_ready(&self) -> bool {
        self.send_goal.server_is_ready() && self.cancel_goal.server_is_ready() && self.get_result.server_is_ready()
    }

    /// Asks for a goal and tells the answer. If nobody waits for it any more, an accepted goal is cancelled.
    async fn ask(self: Arc<Self>, id: GoalId, goal: A::Goal, told: oneshot::Sender<Acceptance<A>>) {
        let request = SendGoalRequest {
            goal_id: id.message(),
            goal,
        };
        let answer = self.send_goal.call(request, LATE_ANSWER).await;
        let Err(Ok(late)) = told.send(answer) else { return };
        if late.accepted {
            tracing::warn!(action = self.name, goal = %id, "a goal was accepted too late and is cancelled");
            if let Err(error) = self.cancel(id, LATE_CANCEL).await {
                tracing::warn!(action = self.name, goal = %id, %error, "the late goal is not cancelled");
            }
        }
    }

    async fn cancel(&self, id: GoalId, timeout: Duration) -> Result<(), Error> {
        let goal_info = GoalInfo {
            goal_id: id.message(),
            stamp: Time::default(),
        };
        let answer = self.cancel_goal.call(CancelGoalRequest { goal_info }, timeout).await?;
        let reason = match answer.return_code {
            CancelGoalResponse::ERROR_NONE => return Ok(()),
            CancelGoalResponse::ERROR_REJECTED => "the server declines",
            CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID => "the server does not know it",
            CancelGoalResponse::ERROR_GOAL_TERMINATED => "it has ended",
            _ => "the server gives a reason that ROS 2 does not define",
        };
        let action = self.name.clone();
        Err(Error::NotCancelled { action, reason })
    }

    /// What `answer` of the result's service means; `None` = ask again.
    async fn ask_for_result(&self, id: GoalId) -> Option<Outcome<A::Result>> {
        let request = GetResultRequest {
            goal_id: id.message(),
            action: PhantomData,
        };
        match self.get_result.call(request, RESULT_PATIENCE).await {
            Ok(answer) => Some(match GoalStatus::from_code(answer.status) {
                GoalStatus::Unknown => Err(Loss::Forgotten),
                status => Ok((status, Arc::clone(&answer.result))),
            }),
            Err(Error::NotFound { .. }) => Some(Err(Loss::ServerGone)),
            Err(Error::TimedOut { .. }) => None,
            Err(error) => {
                tracing::warn!(action = self.name, goal = %id, %error, "cannot ask for the result; trying again");
                sleep(RETRY_AFTER).await;
                None
            }
        }
    }

    async fn server_is_gone(&self) {
        while self
            .graph
            .wait_until(RESULT_PATIENCE, || !self.get_result.server_is_ready())
            .await
            .is_err()
        {}
    }

    fn timed_out(&self, waited: Duration) -> Error {
        Error::TimedOut {
            what: "action",
            name: self.name.clone(),
            waited,
        }
    }

    fn shut_down(&self) -> Error {
        Error::ShutDown {
            node: self.node.clone(),
        }
    }

    fn lost(&self, loss: Loss) -> Error {
        let action = self.name.clone();
        match loss {
            Loss::ServerGone => Error::ServerGone { action },
            Loss::Forgotten => Error::GoalForgotten { action },
        }
    }
}

impl<A: Action> Drop for Inner<A> {
    fn drop(&mut self) {
        self.stop.cancel();
    }
}

impl<A: Action> GoalHandle<A> {
    /// The goal's identity.
    pub fn id(&self) -> GoalId {
        self.id
    }

    /// When the server accepted the goal, by its clock.
    pub fn accepted_at(&self) -> Time {
        self.accepted_at
    }

    /// The next feedback of this goal; `None` once the goal has ended (or its server has gone) and all that came is
    /// taken. Cancel safe.
    ///
    /// Of more than 64 that nobody takes the oldest are lost, with a warning.
    pub async fn feedback(&mut self) -> Option<Arc<A::Feedback>> {
        loop {
            let ended = async {
                let _ = self.outcome.wait_for(Option::is_some).await;
                sleep(FEEDBACK_GRACE).await;
            };
            let received = tokio::select! {
                biased;
                received = self.feedback.recv() => received,
                () = ended => return None,
            };
            match received {
                Ok(feedback) => return Some(feedback),
                Err(RecvError::Lagged(lost)) => {
                    tracing::warn!(action = self.client.name, goal = %self.id, lost, "feedback was not taken in time");
                }
                Err(RecvError::Closed) => return None,
            }
        }
    }

    /// Asks the server to stop this goal. The goal has stopped when [`Self::result`] says so.
    ///
    /// A goal that has ended or is not known gives [`Error::NotCancelled`].
    pub async fn cancel(&self, timeout: Duration) -> Result<(), Error> {
        self.client.cancel(self.id, timeout).await
    }

    /// Waits for the goal's end: how it ended, and its result.
    ///
    /// When the server leaves the graph meanwhile, this is [`Error::ServerGone`]; when it was restarted and has
    /// forgotten the goal, [`Error::GoalForgotten`]. A server that was killed is missed by the graph only when its
    /// lease has run out (under a minute), so [`Error::TimedOut`] may come first. May be called again after it.
    pub async fn result(&self, timeout: Duration) -> Result<(GoalStatus, Arc<A::Result>), Error> {
        let mut outcome = self.outcome.clone();
        let ended = tokio::time::timeout(timeout, outcome.wait_for(Option::is_some)).await;
        match ended.map_err(|_| self.client.timed_out(timeout))? {
            Err(_) => Err(self.client.shut_down()),
            Ok(outcome) => match &*outcome {
                Some(Ok((status, result))) => Ok((*status, Arc::clone(result))),
                Some(Err(loss)) => Err(self.client.lost(*loss)),
                None => Err(self.client.shut_down()),
            },
        }
    }
}

/// Asks for a goal's result until it is there, its server is gone, or nobody wants it.
async fn follow<A: Action>(
    client: Arc<Inner<A>>,
    route: Route<A>,
    outcome: watch::Sender<Option<Outcome<A::Result>>>,
    stop: CancellationToken,
) {
    loop {
        let end = tokio::select! {
            () = stop.cancelled() => return,
            () = client.server_is_gone() => Some(Err(Loss::ServerGone)),
            end = client.ask_for_result(route.id) => end,
        };
        if end.is_some() {
            outcome.send_replace(end);
            // The route stays open for feedback that comes behind the result.
            let _ = timeout(FEEDBACK_GRACE, stop.cancelled()).await;
            return;
        }
    }
}
