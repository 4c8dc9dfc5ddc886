//! The server's book of goals: their states, their results, and who waits for them. No wires, no clock.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::{Duration, Instant};

use interfaces::action_msgs::msg::{GoalInfo, GoalStatus as StatusMessage, GoalStatusArray};
use interfaces::action_msgs::srv::CancelGoalResponse;
use interfaces::builtin_interfaces::msg::Time;
use tokio_util::sync::CancellationToken;

use super::goal::{GoalEvent, GoalId, GoalStatus};

/// Goals that may be under way at once; what comes beyond is rejected.
pub(super) const MAX_ACTIVE: usize = 64;
/// Ended goals whose results are kept; beyond it the oldest is forgotten.
const MAX_ENDED: usize = 64;
/// How long a result is kept for a client that asks late.
const RESULT_KEPT_FOR: Duration = Duration::from_mins(2);
/// Callers that may wait for one goal's result; beyond it the oldest gives way (it has asked again, or has gone).
const MAX_WAITING: usize = 16;

/// Goals with results `R` and waiting callers `W`.
pub(super) struct GoalBook<R, W> {
    goals: BTreeMap<GoalId, Record<R, W>>,
}

struct Record<R, W> {
    accepted_at: Time,
    status: GoalStatus,
    cancel: CancellationToken,
    waiting: VecDeque<W>,
    ended: Option<Ended<R>>,
}

struct Ended<R> {
    result: Arc<R>,
    at: Instant,
}

/// Why a goal cannot be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refusal {
    #[error("its id is zero, which stands for every goal")]
    ZeroId,
    #[error("its id is already in use")]
    KnownId,
    #[error("{MAX_ACTIVE} goals are under way, the most that are allowed")]
    Full,
}

/// What to do with a caller who asks for a result.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Answer<R, W> {
    Now {
        caller: W,
        status: GoalStatus,
        result: Arc<R>,
    },
    WhenEnded {
        gave_way: Option<W>,
    },
    Unknown {
        caller: W,
    },
}

/// How a goal ended and who waited for it.
#[derive(Debug)]
pub(super) struct Outcome<W> {
    /// The state it ended in.
    pub(super) status: GoalStatus,
    /// The state that did not allow the event, in which case the goal is aborted.
    pub(super) refused_in: Option<GoalStatus>,
    pub(super) waiting: VecDeque<W>,
}

impl<R, W> GoalBook<R, W> {
    pub(super) fn new() -> Self {
        Self { goals: BTreeMap::new() }
    }

    /// Whether a goal of this id could be accepted.
    pub(super) fn check(&self, id: GoalId) -> Result<(), Refusal> {
        if id == GoalId::ZERO {
            Err(Refusal::ZeroId)
        } else if self.goals.contains_key(&id) {
            Err(Refusal::KnownId)
        } else if self.goals.values().filter(|goal| !goal.status.is_ended()).count() >= MAX_ACTIVE {
            Err(Refusal::Full)
        } else {
            Ok(())
        }
    }

    /// Takes a goal in and begins it. The token is cancelled when a client asks to stop.
    pub(super) fn begin(&mut self, id: GoalId, accepted_at: Time) -> Result<CancellationToken, Refusal> {
        self.check(id)?;
        let cancel = CancellationToken::new();
        let mut record = Record {
            accepted_at,
            status: GoalStatus::Accepted,
            cancel: cancel.clone(),
            waiting: VecDeque::new(),
            ended: None,
        };
        record.apply(GoalEvent::Execute);
        self.goals.insert(id, record);
        Ok(cancel)
    }

    /// Forgets a goal whose acceptance could not be sent.
    pub(super) fn withdraw(&mut self, id: GoalId) {
        self.goals.remove(&id);
    }

    /// Ends a goal. An event that its state does not allow aborts it, with the result that was given.
    pub(super) fn end(&mut self, id: GoalId, event: GoalEvent, result: Arc<R>, now: Instant) -> Option<Outcome<W>> {
        let goal = self.goals.get_mut(&id).filter(|goal| !goal.status.is_ended())?;
        let before = goal.status;
        let refused_in = if goal.apply(event) { None } else { Some(before) };
        if refused_in.is_some() {
            goal.status = GoalStatus::Aborted;
        }
        goal.ended = Some(Ended { result, at: now });
        let outcome = Outcome {
            status: goal.status,
            refused_in,
            waiting: std::mem::take(&mut goal.waiting),
        };
        self.forget_beyond(MAX_ENDED);
        Some(outcome)
    }

    /// Answers a caller who asks for a result, or keeps it until the goal has ended.
    pub(super) fn ask(&mut self, id: GoalId, caller: W) -> Answer<R, W> {
        let Some(goal) = self.goals.get_mut(&id) else {
            return Answer::Unknown { caller };
        };
        if let Some(ended) = &goal.ended {
            return Answer::Now {
                caller,
                status: goal.status,
                result: Arc::clone(&ended.result),
            };
        }
        goal.waiting.push_back(caller);
        let gave_way = if goal.waiting.len() > MAX_WAITING {
            goal.waiting.pop_front()
        } else {
            None
        };
        Answer::WhenEnded { gave_way }
    }

    /// Asks goals to stop, by the rules of `action_msgs/srv/CancelGoal`:
    ///
    /// | id | stamp | goals |
    /// |---|---|---|
    /// | zero | zero | every goal |
    /// | zero | set | those accepted at or before the stamp |
    /// | set | zero | that goal |
    /// | set | set | that goal, and those accepted at or before the stamp |
    pub(super) fn request_cancel(&mut self, asked: &GoalInfo) -> CancelGoalResponse {
        let (id, stamp) = (GoalId::from(&asked.goal_id), asked.stamp.to_nanos());
        let everything = id == GoalId::ZERO && stamp == 0;
        let mut canceling = Vec::new();
        for (known, goal) in &mut self.goals {
            let in_time = stamp != 0 && goal.accepted_at.to_nanos() <= stamp;
            if (everything || *known == id || in_time) && goal.apply(GoalEvent::RequestCancel) {
                goal.cancel.cancel();
                canceling.push(goal.info(*known));
            }
        }
        let return_code = if !canceling.is_empty() {
            CancelGoalResponse::ERROR_NONE
        } else if id == GoalId::ZERO {
            CancelGoalResponse::ERROR_REJECTED
        } else if self.goals.contains_key(&id) {
            CancelGoalResponse::ERROR_GOAL_TERMINATED
        } else {
            CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID
        };
        CancelGoalResponse {
            return_code,
            goals_canceling: canceling,
        }
    }

    /// Forgets results that were kept long enough; whether there were any.
    pub(super) fn expire(&mut self, now: Instant) -> bool {
        let before = self.goals.len();
        let kept = |ended: &Ended<R>| now.saturating_duration_since(ended.at) < RESULT_KEPT_FOR;
        self.goals.retain(|_, goal| goal.ended.as_ref().is_none_or(kept));
        self.goals.len() < before
    }

    /// Every goal that is known, for the status topic.
    pub(super) fn statuses(&self) -> GoalStatusArray {
        let status = |(id, goal): (&GoalId, &Record<R, W>)| StatusMessage {
            goal_info: goal.info(*id),
            status: goal.status.code(),
        };
        GoalStatusArray {
            status_list: self.goals.iter().map(status).collect(),
        }
    }

    fn forget_beyond(&mut self, most: usize) {
        let ended = |(id, goal): (&GoalId, &Record<R, W>)| goal.ended.as_ref().map(|ended| (ended.at, *id));
        let mut ended: Vec<_> = self.goals.iter().filter_map(ended).collect();
        ended.sort();
        for (_, id) in ended.iter().rev().skip(most) {
            self.goals.remove(id);
        }
    }
}

impl<R, W> Record<R, W> {
    /// Whether the state allows the event, which is then done.
    fn apply(&mut self, event: GoalEvent) -> bool {
        let after = self.status.after(event);
        self.status = after.unwrap_or(self.status);
        after.is_some()
    }

    fn info(&self, id: GoalId) -> GoalInfo {
        GoalInfo {
            goal_id: id.message(),
            stamp: self.accepted_at,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interfaces::unique_identifier_msgs::msg::UUID;

    type Book = GoalBook<&'static str, u32>;

    fn id(n: u8) -> GoalId {
        GoalId::from(&UUID { uuid: [n; 16] })
    }

    fn at(seconds: i32) -> Time {
        Time {
            sec: seconds,
            nanosec: 0,
        }
    }

    /// Goals 1, 2 and 3, accepted at seconds 10, 20 and 30.
    fn three_goals() -> Book {
        let mut book = Book::new();
        for n in 1..=3_u8 {
            book.begin(id(n), at(i32::from(n) * 10)).unwrap();
        }
        book
    }

    fn cancel(book: &mut Book, n: u8, seconds: i32) -> (i8, Vec<GoalId>) {
        let response = book.request_cancel(&GoalInfo {
            goal_id: id(n).message(),
            stamp: at(seconds),
        });
        (
            response.return_code,
            response
                .goals_canceling
                .iter()
                .map(|info| GoalId::from(&info.goal_id))
                .collect(),
        )
    }

    fn succeed(book: &mut Book, n: u8) {
        book.end(id(n), GoalEvent::Succeed, Arc::new("done"), Instant::now())
            .unwrap();
    }

    #[test]
    fn a_cancel_reaches_the_goals_that_its_id_and_stamp_name() {
        let none = CancelGoalResponse::ERROR_NONE;
        assert_eq!(cancel(&mut three_goals(), 0, 0), (none, vec![id(1), id(2), id(3)]));
        assert_eq!(cancel(&mut three_goals(), 0, 20), (none, vec![id(1), id(2)]));
        assert_eq!(cancel(&mut three_goals(), 3, 0), (none, vec![id(3)]));
        assert_eq!(cancel(&mut three_goals(), 3, 10), (none, vec![id(1), id(3)]));
    }

    #[test]
    fn a_cancel_that_reaches_nothing_says_why() {
        let mut book = three_goals();
        assert_eq!(
            cancel(&mut book, 9, 0),
            (CancelGoalResponse::ERROR_UNKNOWN_GOAL_ID, vec![])
        );
        assert_eq!(cancel(&mut book, 0, 5), (CancelGoalResponse::ERROR_REJECTED, vec![]));
        succeed(&mut book, 2);
        assert_eq!(
            cancel(&mut book, 2, 0),
            (CancelGoalResponse::ERROR_GOAL_TERMINATED, vec![])
        );
        assert_eq!(
            cancel(&mut book, 0, 0),
            (CancelGoalResponse::ERROR_NONE, vec![id(1), id(3)])
        );
    }

    #[test]
    fn a_cancel_may_be_repeated_and_wakes_its_goal_only() {
        let mut book = Book::new();
        let (first, second) = (book.begin(id(1), at(1)).unwrap(), book.begin(id(2), at(2)).unwrap());
        for _ in 0..2 {
            assert_eq!(cancel(&mut book, 2, 0), (CancelGoalResponse::ERROR_NONE, vec![id(2)]));
        }
        assert!(second.is_cancelled() && !first.is_cancelled());
    }

    #[test]
    fn callers_wait_for_the_end_and_are_answered_at_once_after_it() {
        let mut book = three_goals();
        assert_eq!(book.ask(id(1), 7), Answer::WhenEnded { gave_way: None });
        assert_eq!(book.ask(id(9), 8), Answer::Unknown { caller: 8 });
        let outcome = book
            .end(id(1), GoalEvent::Abort, Arc::new("broken"), Instant::now())
            .unwrap();
        assert_eq!(
            (outcome.status, outcome.refused_in, outcome.waiting),
            (GoalStatus::Aborted, None, [7].into())
        );
        let now = Answer::Now {
            caller: 9,
            status: GoalStatus::Aborted,
            result: Arc::new("broken"),
        };
        assert_eq!(book.ask(id(1), 9), now);
        assert!(
            book.end(id(1), GoalEvent::Succeed, Arc::new("late"), Instant::now())
                .is_none()
        );
    }

    #[test]
    fn a_goal_that_nobody_cancelled_cannot_end_as_canceled() {
        let mut book = three_goals();
        let outcome = book
            .end(id(1), GoalEvent::Cancel, Arc::new("stopped"), Instant::now())
            .unwrap();
        assert_eq!(
            (outcome.status, outcome.refused_in),
            (GoalStatus::Aborted, Some(GoalStatus::Executing))
        );
        cancel(&mut book, 2, 0);
        let outcome = book
            .end(id(2), GoalEvent::Cancel, Arc::new("stopped"), Instant::now())
            .unwrap();
        assert_eq!((outcome.status, outcome.refused_in), (GoalStatus::Canceled, None));
    }

    #[test]
    fn bad_and_surplus_goals_are_refused() {
        let mut book = Book::new();
        assert_eq!(book.check(GoalId::ZERO), Err(Refusal::ZeroId));
        for n in 1..=MAX_ACTIVE as u8 {
            book.begin(id(n), at(1)).unwrap();
        }
        assert_eq!(book.check(id(1)), Err(Refusal::KnownId));
        assert_eq!(book.check(id(200)), Err(Refusal::Full));
        succeed(&mut book, 1);
        assert_eq!(book.check(id(200)), Ok(()));
    }

    #[test]
    fn results_are_kept_for_a_bounded_time_and_number() {
        let (mut book, start) = (Book::new(), Instant::now());
        for n in 0..MAX_ENDED as u8 + 3 {
            book.begin(id(n + 1), at(1)).unwrap();
            book.end(
                id(n + 1),
                GoalEvent::Succeed,
                Arc::new("done"),
                start + Duration::from_secs(n.into()),
            )
            .unwrap();
        }
        assert_eq!(book.statuses().status_list.len(), MAX_ENDED);
        assert_eq!(book.ask(id(3), 0), Answer::Unknown { caller: 0 });
        assert!(!book.expire(start));
        book.begin(id(250), at(1)).unwrap();
        assert!(book.expire(start + RESULT_KEPT_FOR + Duration::from_secs(1000)));
        assert_eq!(
            book.statuses().status_list.len(),
            1,
            "a goal under way is never forgotten"
        );
    }

    #[test]
    fn waiting_callers_are_bounded() {
        let mut book = three_goals();
        for caller in 0..MAX_WAITING as u32 {
            assert_eq!(book.ask(id(1), caller), Answer::WhenEnded { gave_way: None });
        }
        assert_eq!(book.ask(id(1), 99), Answer::WhenEnded { gave_way: Some(0) });
    }
}
