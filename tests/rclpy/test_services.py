"""Services of a Rust node, called from rclpy."""

from std_srvs.srv import SetBool, Trigger


def test_a_call_is_answered(probe, peer):
    probe("--mute")
    response = peer.call(Trigger, "/cell/probe/status", Trigger.Request())
    assert (response.success, response.message) == (True, "0 published")


def test_requests_carry_their_values(probe, peer):
    probe("--mute")
    for value, expected in [(True, "was false and is true"), (False, "was true and is false")]:
        assert expected in peer.call(SetBool, "/cell/probe/publish", SetBool.Request(data=value)).message


def test_no_reply_is_lost_or_swapped(probe, peer):
    probe("--mute")
    client = peer.node.create_client(SetBool, "/cell/probe/publish")
    peer.spin_until(client.service_is_ready, "the service")
    # Eight at a time stay within the depth of 10 that rclpy itself keeps for replies.
    for _ in range(5):
        values = [index % 3 == 0 for index in range(8)]
        futures = [client.call_async(SetBool.Request(data=value)) for value in values]
        peer.spin_until(lambda: all(future.done() for future in futures), "eight replies")
        for value, future in zip(values, futures):
            assert future.result().message.endswith(f"is {str(value).lower()}")


def test_a_slow_service_does_not_hold_up_another(probe, peer):
    child = probe("--mute")
    slow = peer.node.create_client(Trigger, "/cell/probe/slow")
    peer.spin_until(slow.service_is_ready, "the slow service")
    waiting = slow.call_async(Trigger.Request())
    peer.spin_until(lambda: "slow call" in child.stdout(), "the call's arrival")
    assert peer.call(Trigger, "/cell/probe/status", Trigger.Request()).success
    assert not waiting.done()
