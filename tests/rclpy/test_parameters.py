"""Parameters of a Rust node through rclpy's own parameter client."""

import pytest
from rcl_interfaces.msg import ParameterEvent, ParameterType
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient


@pytest.fixture
def client(peer, probe):
    probe("--mute")
    client = AsyncParameterClient(peer.node, "/cell/probe")
    peer.spin_until(client.services_are_ready, "the parameter services")
    return client


def test_every_parameter_is_listed(peer, client):
    names = peer.result(client.list_parameters([], 0), "the list").result.names
    expected = {"enabled", "exposures", "binning", "gain", "mode", "serial_number", "mask", "panels", "channels"}
    assert expected | {"offsets", "cameras"} <= set(names)


def test_values_have_their_types(peer, client):
    names = ["enabled", "exposures", "gain", "mode", "mask", "panels", "channels", "offsets", "cameras"]
    values = peer.result(client.get_parameters(names), "the values").values
    read = [Parameter.from_parameter_msg(_named(name, value)).value for name, value in zip(names, values)]
    assert read[:4] == [True, 8, 0.5, "solid"]
    assert [list(value) for value in read[4:]] == [[b"\x00", b"\xff"], [True, False, True], [1, 2, 3], [0.1, -0.1], ["c1"]]


def _named(name, value):
    from rcl_interfaces.msg import Parameter as Message

    return Message(name=name, value=value)


def test_a_description_has_range_unit_and_access(peer, client):
    names = ["gain", "exposures", "binning", "serial_number"]
    gain, exposures, binning, serial = peer.result(client.describe_parameters(names), "descriptions").descriptors
    assert (gain.type, gain.description) == (ParameterType.PARAMETER_DOUBLE, "Gain of the camera")
    assert "dB" in gain.additional_constraints
    assert (gain.floating_point_range[0].from_value, gain.floating_point_range[0].to_value) == (0.0, 24.0)
    assert (exposures.integer_range[0].from_value, exposures.integer_range[0].to_value) == (1, 64)
    assert binning.integer_range[0].step == 2
    assert serial.read_only and not gain.read_only


def test_setting_a_parameter_changes_it_and_is_announced(peer, client):
    events = peer.collect(ParameterEvent, "/parameter_events", qos=100)
    asked = []

    def set_gain():
        wanted = 3.5 + len(asked)
        asked.append(wanted)
        (outcome,) = peer.result(client.set_parameters([Parameter("gain", value=wanted)]), "the outcome").results
        assert outcome.successful, outcome.reason
        (value,) = peer.result(client.get_parameters(["gain"]), "the value").values
        assert value.double_value == wanted

    changed = lambda: [p for event in events if event.node == "/cell/probe" for p in event.changed_parameters]
    # The node may not know yet that somebody listens when it is asked for the first time.
    parameters = peer.act_until(set_gain, changed, "the event")
    assert {p.name for p in parameters} == {"gain"}
    assert {p.value.double_value for p in parameters} <= set(asked)


@pytest.mark.parametrize(
    ("parameter", "reason"),
    [
        (Parameter("gain", value=25.0), ["gain", "25", "24"]),
        (Parameter("gain", value="loud"), ["gain", "loud"]),
        (Parameter("mode", value="soft"), ["mode", "soft", "solid"]),
        (Parameter("binning", value=3), ["binning", "3"]),
        (Parameter("serial_number", value="X"), ["serial_number", "read"]),
        (Parameter("gian", value=1.0), ["gian"]),
    ],
    ids=["range", "type", "choice", "step", "read-only", "unknown"],
)
def test_a_refusal_says_what_is_wrong(peer, client, parameter, reason):
    (outcome,) = peer.result(client.set_parameters([parameter]), "the outcome").results
    assert not outcome.successful
    assert all(word in outcome.reason for word in reason), outcome.reason


def test_an_atomic_set_is_all_or_nothing(peer, client):
    parameters = [Parameter("exposures", value=4), Parameter("gain", value=99.0)]
    outcome = peer.result(client.set_parameters_atomically(parameters), "the outcome").result
    assert not outcome.successful and "gain" in outcome.reason
    (value,) = peer.result(client.get_parameters(["exposures"]), "the value").values
    assert value.integer_value == 8
