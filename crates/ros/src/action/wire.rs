//! What an action sends: three services and a feedback message around the goal, result and feedback of its file.
//!
//! `rosidl` derives these from the action; here they are generic. Their ROS names are put together at compile time from
//! the name of the part that they carry.

use std::marker::PhantomData;
use std::sync::Arc;

use interfaces::builtin_interfaces::msg::Time;
use interfaces::unique_identifier_msgs::msg::UUID;
use interfaces::{Action, Message, Service};
use serde::{Deserialize, Serialize};

/// Asks for a goal.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct SendGoalRequest<G> {
    pub(super) goal_id: UUID,
    pub(super) goal: G,
}

/// Whether the goal was accepted, and when.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct SendGoalResponse<G> {
    pub(super) accepted: bool,
    pub(super) stamp: Time,
    /// Only the name on the wire depends on the action.
    #[serde(skip)]
    pub(super) action: PhantomData<G>,
}

/// Asks for a goal's result; answered when the goal has ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct GetResultRequest<R> {
    pub(super) goal_id: UUID,
    /// Only the name on the wire depends on the action.
    #[serde(skip)]
    pub(super) action: PhantomData<R>,
}

/// How the goal ended, and what came of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound(serialize = "R: Serialize", deserialize = "R: Deserialize<'de>"))]
pub(super) struct GetResultResponse<R> {
    pub(super) status: i8,
    pub(super) result: Arc<R>,
}

/// How far a goal is.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound(serialize = "F: Serialize", deserialize = "F: Deserialize<'de>"))]
pub(super) struct FeedbackMessage<F> {
    pub(super) goal_id: UUID,
    pub(super) feedback: Arc<F>,
}

macro_rules! named_after_its_part {
    ($message:ident, $part:literal, $name:literal) => {
        impl<P: Message> $message<P> {
            const NAME: &'static Name = &Name::renamed(P::TYPE_NAME, $part, $name);
        }

        impl<P: Message> Message for $message<P> {
            const TYPE_NAME: &'static str = Self::NAME.as_str();
            // These are on hidden topics, which bags leave out.
            const DEFINITION: &'static str = "";
        }
    };
}

named_after_its_part!(SendGoalRequest, "_Goal", "_SendGoal_Request");
named_after_its_part!(SendGoalResponse, "_Goal", "_SendGoal_Response");
named_after_its_part!(GetResultRequest, "_Result", "_GetResult_Request");
named_after_its_part!(GetResultResponse, "_Result", "_GetResult_Response");
named_after_its_part!(FeedbackMessage, "_Feedback", "_FeedbackMessage");

/// `<action>/_action/send_goal`.
pub(super) struct SendGoal<A>(PhantomData<A>);

impl<A: Action> SendGoal<A> {
    const NAME: &'static Name = &Name::renamed(A::TYPE_NAME, "", "_SendGoal");
}

impl<A: Action> Service for SendGoal<A> {
    type Request = SendGoalRequest<A::Goal>;
    type Response = SendGoalResponse<A::Goal>;
    const TYPE_NAME: &'static str = Self::NAME.as_str();
}

/// `<action>/_action/get_result`.
pub(super) struct GetResult<A>(PhantomData<A>);

impl<A: Action> GetResult<A> {
    const NAME: &'static Name = &Name::renamed(A::TYPE_NAME, "", "_GetResult");
}

impl<A: Action> Service for GetResult<A> {
    type Request = GetResultRequest<A::Result>;
    type Response = GetResultResponse<A::Result>;
    const TYPE_NAME: &'static str = Self::NAME.as_str();
}

/// A ROS type name made at compile time.
struct Name {
    bytes: [u8; Self::MAX_BYTES],
    length: usize,
}

impl Name {
    const MAX_BYTES: usize = 255;

    /// `base` with `new` in place of the `old` at its end. Fails to compile when `base` does not end so.
    const fn renamed(base: &str, old: &str, new: &str) -> Self {
        let (base, old, new) = (base.as_bytes(), old.as_bytes(), new.as_bytes());
        let kept = base.len() - old.len();
        let length = kept + new.len();
        assert!(length <= Self::MAX_BYTES, "a type name is too long");
        let mut bytes = [0; Self::MAX_BYTES];
        let mut i = 0;
        while i < base.len() {
            if i < kept {
                bytes[i] = base[i];
            } else {
                assert!(base[i] == old[i - kept], "a part of an action has an unusual type name");
            }
            i += 1;
        }
        i = 0;
        while i < new.len() {
            bytes[kept + i] = new[i];
            i += 1;
        }
        Self { bytes, length }
    }

    const fn as_str(&self) -> &str {
        match str::from_utf8(self.bytes.split_at(self.length).0) {
            Ok(name) => name,
            Err(_) => panic!("a type name is not text"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use interfaces::cdr;
    use interfaces::rakelight_msgs::action::{PickCycle, PickCycleFeedback, PickCycleGoal, PickCycleResult};

    #[test]
    fn type_names_are_those_of_ros_2() {
        let names = [
            <SendGoal<PickCycle> as Service>::TYPE_NAME,
            <GetResult<PickCycle> as Service>::TYPE_NAME,
            SendGoalRequest::<PickCycleGoal>::TYPE_NAME,
            SendGoalResponse::<PickCycleGoal>::TYPE_NAME,
            GetResultRequest::<PickCycleResult>::TYPE_NAME,
            GetResultResponse::<PickCycleResult>::TYPE_NAME,
            FeedbackMessage::<PickCycleFeedback>::TYPE_NAME,
        ];
        let expected = [
            "SendGoal",
            "GetResult",
            "SendGoal_Request",
            "SendGoal_Response",
            "GetResult_Request",
            "GetResult_Response",
            "FeedbackMessage",
        ];
        assert_eq!(
            names.to_vec(),
            expected
                .map(|name| format!("rakelight_msgs/action/PickCycle_{name}"))
                .to_vec()
        );
    }

    #[test]
    fn messages_are_laid_out_as_ros_2_does() {
        let goal_id = UUID {
            uuid: std::array::from_fn(|i| i as u8),
        };
        let response = SendGoalResponse::<PickCycleGoal> {
            accepted: true,
            stamp: Time { sec: 5, nanosec: 6 },
            action: PhantomData,
        };
        assert_eq!(
            cdr::to_vec(&response).unwrap(),
            [0, 1, 0, 0, 1, 0, 0, 0, 5, 0, 0, 0, 6, 0, 0, 0]
        );
        let request = GetResultRequest::<PickCycleResult> {
            goal_id,
            action: PhantomData,
        };
        assert_eq!(cdr::to_vec(&request).unwrap()[4..], goal_id.uuid);
        let feedback = PickCycleFeedback {
            progress: 0.25,
            ..PickCycleFeedback::default()
        };
        let message = FeedbackMessage {
            goal_id,
            feedback: Arc::new(feedback),
        };
        let bytes = cdr::to_vec(&message).unwrap();
        assert_eq!(bytes[20..], cdr::to_vec(message.feedback.as_ref()).unwrap()[4..]);
        assert_eq!(
            cdr::from_slice::<FeedbackMessage<PickCycleFeedback>>(&bytes).unwrap(),
            message
        );
    }

    #[test]
    fn a_result_comes_back_with_its_status() {
        let result = PickCycleResult {
            reason: "nothing to pick".into(),
            ..PickCycleResult::default()
        };
        let response = GetResultResponse {
            status: 6,
            result: Arc::new(result),
        };
        let bytes = cdr::to_vec(&response).unwrap();
        assert_eq!(
            cdr::from_slice::<GetResultResponse<PickCycleResult>>(&bytes).unwrap(),
            response
        );
    }
}
