"""Picks as rclpy users see them: the whole simulated cell as `rakelight up` brings it up, from light to bin."""

import itertools
import json
import os
import pathlib
import signal
import sys
import time

import pytest
import yaml
from action_msgs.msg import GoalStatus
from rakelight_msgs.action import PickCycle
from rakelight_msgs.msg import ArmState, CellState
from rclpy.action import ActionClient
from std_srvs.srv import Trigger

from harness import TIMEOUT, latched

REPOSITORY = pathlib.Path(__file__).parents[2]
EXAMPLES = pathlib.Path(__file__).parent / "examples"
CYCLE = 180.0
"""Seconds that a cycle may take on a machine that runs other tests."""


class Cell:
    """The running cell, its states, and somebody who asks."""

    def __init__(self, program, peer):
        self.program, self.peer = program, peer
        self.states = peer.collect(CellState, "/cell/state", qos=latched())
        self.arm = peer.collect(ArmState, "/cell/arm/state", 100)
        self.picker = ActionClient(peer.node, PickCycle, "/cell/pick_cycle")

    def events(self, kind):
        lines = self.program.stdout().split("\n")[:-1]
        return [event for event in map(json.loads, lines) if event["event"] == kind]

    def wait(self, condition, what, timeout=TIMEOUT):
        """The newest state, once it is as wanted."""
        is_so = lambda: self.states and condition(self.states[-1])
        self.peer.spin_until(is_so, what, timeout)
        return self.states[-1]

    def ready(self):
        return self.wait(lambda state: state.stage == CellState.IDLE and not state.waiting_for, "the cell to be ready", CYCLE)

    def call(self, name):
        return self.peer.call(Trigger, f"/cell/{name}", Trigger.Request(), timeout=CYCLE)

    def send(self, feedback=None, **options):
        self.peer.spin_until(self.picker.server_is_ready, "pick_cycle")
        call = self.picker.send_goal_async(PickCycle.Goal(**options), feedback_callback=feedback)
        return self.peer.result(call, "the goal")

    def result(self, goal):
        outcome = self.peer.result(goal.get_result_async(), "the result", CYCLE)
        return outcome.status, outcome.result

    def assert_safe(self):
        """The arm comes to rest, and the pump is off or holds something."""
        seen = len(self.arm)
        moves, pumps = (ArmState.MOVING, ArmState.STOPPING), ArmState.VACUUM_ON
        is_safe = lambda state: state.mode not in moves and state.vacuum != pumps
        self.peer.spin_until(lambda: len(self.arm) > seen and is_safe(self.arm[-1]), "the arm to rest without a pump in vain")


CELLS = itertools.count(1)
"""A cell that was just killed may still hold its addresses."""

OCTAGON = {"shape": {"kind": "octagon2", "width": 0.09, "height": 0.029}, "pose": {"x": 0.395, "y": -0.018, "yaw": -0.3}}
BLOCK = {"shape": {"kind": "box", "size": [0.045, 0.035, 0.025]}, "pose": {"x": 0.487, "y": 0.05, "yaw": 0.5}, "albedo": 0.75}
TWO = [OCTAGON, BLOCK]
"""One may be in the cup already when the cycle ends; then the next pick needs the other."""


def places(world, config, number):
    """The default world and config at addresses that no other test has; changes both."""
    cell = next(CELLS)
    addresses = {name: f"127.{100 + number}.{cell}.{host}" for host, name in enumerate(("c1", "c2", "arm"), 1)}
    for camera in ("c1", "c2"):
        world["cameras"][camera]["address"] = config["camera_capture"]["ros__parameters"][camera]["guid"] = addresses[camera]
    world["arm"]["address"] = config["trajectory_executor"]["ros__parameters"]["host"] = addresses["arm"]


@pytest.fixture
def bring_up(domain, start, make_peer, tmp_path):
    """`bring_up()` is the cell of launch_configs/sim.yaml, ready; `objects` replaces what is on the table."""

    def bring_up(objects=None):
        folder = REPOSITORY / "launch_configs"
        world = yaml.safe_load((folder / "worlds" / "table.yaml").read_text())
        text = (folder / "sim.yaml").read_text().replace("$(dirname)/calibration", str(folder / "calibration"))
        config = yaml.safe_load(text)
        places(world, config, domain.number)
        world["lights"]["port"] = config["light_sequencer"]["ros__parameters"]["port"] = str(tmp_path / "lights")
        if objects is not None:
            world["objects"] = objects
        # Punctual enough for machines that run tests.
        config["trajectory_executor"]["ros__parameters"] |= {"watchdog": 0.4, "state_timeout": 0.8}
        config["cell_coordinator"]["ros__parameters"] |= {"node_timeout": 8.0, "arm_state_timeout": 3.0}
        config["bag_recorder"]["ros__parameters"]["folder"] = str(tmp_path / "recordings")
        config["cell"]["simulator"] = str(tmp_path / "world.yaml")
        (tmp_path / "world.yaml").write_text(yaml.safe_dump(world))
        (tmp_path / "cell.yaml").write_text(yaml.safe_dump(config))
        program = start("rakelight", "up", "--config", tmp_path / "cell.yaml", "--json")
        deadline = time.monotonic() + CYCLE
        lines = lambda: program.stdout().split("\n")[:-1]
        while not any(json.loads(line)["event"] == "ready" for line in lines()):
            if "was not built" in program.stderr():
                pytest.skip("SKIPPED: no simulated light controller (cargo xtask setup)")
            program.check_alive()
            assert time.monotonic() < deadline, "the cell does not become ready"
            time.sleep(0.05)
        cell = Cell(program, make_peer())
        cell.ready()
        return cell

    return bring_up


def test_two_objects_go_into_the_bin_and_then_the_table_is_empty(bring_up, start):
    cell = bring_up(objects=TWO)
    answer = cell.call("pick")
    assert answer.success, answer.message
    feedback = []
    goal = cell.send(lambda message: feedback.append(message.feedback))
    status, result = cell.result(goal)
    assert status == GoalStatus.STATUS_SUCCEEDED, result.reason
    assert [timing.stage for timing in result.timings] == [2, 3, 4, 5, 2, 3, 4]
    assert {told.stage for told in feedback} >= {CellState.CAPTURE, CellState.SOLVE, CellState.PLAN, CellState.EXECUTE}
    state = cell.wait(lambda state: state.cycles_succeeded == 2, "the count")
    assert state.stage == CellState.IDLE and state.cycles_failed == 0
    cell.assert_safe()
    empty = cell.call("pick")
    assert not empty.success and "nothing to pick" in empty.message, empty.message
    command = start("rakelight", "pick", "--count", "2", "--json")
    command.expected_to_end = True
    assert command.wait(CYCLE) == 1, command.stderr()
    pick, summary = map(json.loads, command.stdout().splitlines())
    assert not pick["success"] and pick["failed_stage"] == "plan"
    assert summary["summary"]["not_tried"] == 1
    cell.assert_safe()


def test_a_cancel_in_each_stage_leaves_the_cell_at_rest_and_the_next_pick_works(bring_up, start):
    cell = bring_up(objects=TWO)
    for stage in ("capture", "solve", "plan", "execute"):
        example = start(sys.executable, EXAMPLES / "pick.py", "--cancel-at", stage)
        example.expected_to_end = True
        assert example.wait(CYCLE) == 1, example.stderr()
        assert "cancelled" in example.stdout(), example.stdout()
        cell.ready()
        cell.assert_safe()
    command = start("rakelight", "pick")
    command.expected_to_end = True
    assert command.wait(CYCLE) == 0, command.stdout() + command.stderr()
    assert command.stdout().startswith("pick 1: done after"), command.stdout()


def test_ctrl_c_cancels_the_cycle(bring_up, start):
    cell = bring_up()
    command = start("rakelight", "pick", "--count", "3")
    cell.wait(lambda state: state.stage == CellState.EXECUTE, "the arm's turn", CYCLE)
    assert command.interrupt(CYCLE) == 1
    assert "cancelled" in command.stdout(), command.stdout()
    cell.ready()
    cell.assert_safe()


def test_a_stop_in_mid_motion_needs_recover(bring_up):
    cell = bring_up(objects=TWO)
    goal = cell.send()
    cell.wait(lambda state: state.stage == CellState.EXECUTE, "the arm's turn", CYCLE)
    cell.peer.spin_until(lambda: cell.arm and cell.arm[-1].mode == ArmState.MOVING, "the arm to move")
    assert cell.call("stop").success
    status, result = cell.result(goal)
    assert status == GoalStatus.STATUS_ABORTED and "stopped" in result.reason, result.reason
    cell.wait(lambda state: state.stage == CellState.STOPPED, "the stop")
    refused = cell.call("pick")
    assert not refused.success and "recover" in refused.message, refused.message
    assert cell.call("recover").success
    cell.ready()
    answer = cell.call("pick")
    assert answer.success, answer.message


def test_vision_that_is_killed_is_missed_and_comes_back(bring_up):
    cell = bring_up()
    goal = cell.send()
    cell.wait(lambda state: state.stage == CellState.SOLVE, "the solver's turn", CYCLE)
    (pid,) = {event["pid"] for event in cell.events("started") if event["process"] == "vision"}
    os.kill(pid, signal.SIGKILL)
    status, result = cell.result(goal)
    assert status == GoalStatus.STATUS_ABORTED and result.failed_stage == CellState.SOLVE
    assert "normal_solver" in result.reason, result.reason
    cell.assert_safe()
    cell.peer.spin_until(lambda: len(cell.events("ready")) == 2, "the cell again", CYCLE)
    cell.ready()
    answer = cell.call("pick")
    assert answer.success, answer.message


def test_an_empty_table_is_not_touched(bring_up):
    cell = bring_up(objects=[])
    seen = len(cell.arm)
    answer = cell.call("pick")
    assert not answer.success and "nothing to pick" in answer.message, answer.message
    assert all(state.mode == ArmState.READY for state in cell.arm[seen:])


def test_a_dry_run_moves_nothing(bring_up, start):
    cell = bring_up()
    seen = len(cell.arm)
    example = start(sys.executable, EXAMPLES / "pick.py", "--dry-run")
    example.expected_to_end = True
    assert example.wait(CYCLE) == 0, example.stdout() + example.stderr()
    cell.peer.spin_until(lambda: len(cell.arm) > seen, "the arm's states")
    assert all(state.mode == ArmState.READY for state in cell.arm[seen:])
