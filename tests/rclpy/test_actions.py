"""The pick_cycle action of a Rust node, driven from rclpy: feedback, results, refusal, cancelling."""

import pytest
from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from rakelight_msgs.action import PickCycle
from rclpy.action import ActionClient


class Client:
    """An action client of the probe that keeps the feedback of every goal by its target."""

    def __init__(self, peer):
        self.peer = peer
        self.feedback = {}
        self._client = ActionClient(peer.node, PickCycle, "/cell/pick_cycle")
        peer.spin_until(self._client.server_is_ready, "the action server")

    def send(self, target):
        steps = self.feedback.setdefault(target, [])
        sent = self._client.send_goal_async(
            PickCycle.Goal(target=target), feedback_callback=lambda message: steps.append(message.feedback)
        )
        return self.peer.result(sent, f"the answer to goal {target}")

    def outcome(self, goal):
        return self.peer.result(goal.get_result_async(), "the result")

    def close(self):
        self._client.destroy()


@pytest.fixture
def client(peer, probe):
    # Slow enough for a cancel to meet a running goal, fast enough for a test.
    probe("--mute", "--steps", "5", "--step-millis", "50")
    client = Client(peer)
    yield client
    client.close()


def test_a_goal_gives_feedback_and_a_result(client):
    goal = client.send("cube")
    assert goal.accepted
    outcome = client.outcome(goal)
    assert outcome.status == GoalStatus.STATUS_SUCCEEDED
    assert (outcome.result.success, outcome.result.capture_id) == (True, "cube")
    feedback = client.feedback["cube"]
    client.peer.spin_until(lambda: len(feedback) == 5, "five feedback messages")
    assert [step.progress for step in feedback] == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_a_goal_can_be_refused(client):
    assert not client.send("reject").accepted


def test_a_goal_can_fail_with_a_reason(client):
    outcome = client.outcome(client.send("abort"))
    assert outcome.status == GoalStatus.STATUS_ABORTED
    assert (outcome.result.success, outcome.result.reason) == (False, "asked to abort")


def test_a_running_goal_can_be_cancelled(client):
    goal = client.send("hang")
    client.peer.spin_until(lambda: client.feedback["hang"], "the goal's first step")
    answer = client.peer.result(goal.cancel_goal_async(), "the answer to the cancel request")
    assert answer.return_code == CancelGoal.Response.ERROR_NONE
    assert [bytes(info.goal_id.uuid) for info in answer.goals_canceling] == [bytes(goal.goal_id.uuid)]
    outcome = client.outcome(goal)
    assert outcome.status == GoalStatus.STATUS_CANCELED
    assert outcome.result.reason.startswith("hang cancelled before step")


def test_cancelling_one_of_three_goals_leaves_the_others(client):
    first, hanging, third = [client.send(target) for target in ["first", "hang", "third"]]
    client.peer.result(hanging.cancel_goal_async(), "the answer to the cancel request")
    outcomes = [client.outcome(goal) for goal in (first, hanging, third)]
    expected = [GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED, GoalStatus.STATUS_SUCCEEDED]
    assert [outcome.status for outcome in outcomes] == expected
    assert [outcomes[index].result.capture_id for index in (0, 2)] == ["first", "third"]


def test_a_goal_dropped_by_the_server_still_ends(client):
    outcome = client.outcome(client.send("drop"))
    assert outcome.status == GoalStatus.STATUS_ABORTED


def test_cancelling_a_finished_goal_is_refused(client):
    goal = client.send("cube")
    client.outcome(goal)
    answer = client.peer.result(goal.cancel_goal_async(), "the answer to the cancel request")
    assert answer.return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED
    assert answer.goals_canceling == []
