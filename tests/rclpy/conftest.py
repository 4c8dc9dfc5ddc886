"""Fixtures of the rclpy tests; see harness.py for what they hand out."""

import pytest
from harness import Domain, Peer, Program, program_path


@pytest.fixture
def domain(monkeypatch):
    """A ROS domain for this test alone, on this host alone."""
    domain = Domain()
    for name, value in domain.environment().items():
        monkeypatch.setenv(name, value)
    yield domain
    domain.close()


@pytest.fixture
def programs(request, domain):
    """The children of this test, ended with it; what they said is shown when it fails."""
    children = []
    request.node.children = children
    yield children
    for child in children:
        child.close()


@pytest.fixture
def start(domain, programs):
    """`start("probe_node", "arg")` runs a program of the workspace; a path runs any other."""

    def start(name, *arguments, environment=None):
        command = name if "/" in str(name) else program_path(name)
        child = Program([command, *arguments], domain.environment() | (environment or {}))
        programs.append(child)
        return child

    return start


@pytest.fixture
def probe(start, peer):
    """`probe("--map-size", "1536")` is the probe node, `/cell/probe`, once everything of it is there."""

    def probe(*arguments):
        child = start("probe_node", *arguments)
        peer.spin_until(lambda: "ready\n" in child.stdout(), "the probe")
        return child

    return probe


@pytest.fixture
def make_peer(domain, programs):
    """`make_peer(name="a")` is one more rclpy node, in a context of its own."""
    peers = []

    def make_peer(**options):
        peers.append(Peer(domain, programs, **options))
        return peers[-1]

    yield make_peer
    for peer in peers:
        peer.close()


@pytest.fixture
def peer(make_peer):
    """The rclpy node of a test that needs one."""
    return make_peer()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if report.failed:
        for child in getattr(item, "children", []):
            # After a failed setup or teardown the files may be closed already.
            if not child.closed():
                report.sections.append((f"stdout of {child.name}", child.stdout()))
                report.sections.append((f"stderr of {child.name}", child.stderr()))
    return report
