"""What the rclpy tests share: a domain of their own, Rust programs that end with the test, and bounded waits.

Nothing here sleeps for a fixed time: a wait is for a condition, ends as soon as it holds, and fails with what it
waited for. A wait also ends at once when a program under test has died.
"""

import ctypes
import fcntl
import os
import pathlib
import signal
import subprocess
import tempfile
import time

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile

FIRST_DOMAIN, LAST_DOMAIN = 1, 100
"""Their ports (7400 + 250 x domain) stay below the range that the kernel hands out by itself."""

TIMEOUT = 30.0
"""Seconds that a wait may take: long enough for a loaded machine, never the normal case."""

PR_SET_PDEATHSIG = 1
LIBC = ctypes.CDLL(None)


class HarnessError(AssertionError):
    """A wait that ran out, or a program that died: the test has failed."""


class Domain:
    """A ROS domain that no other test on this machine uses, held by a lock on `rakelight_domains/NN.lock`.

    The Rust tests take theirs from the same folder. The kernel gives the lock back when the holder dies. The next test
    takes another one: children of a killed program may speak in this one for a moment longer.
    """

    _claimed = 0

    def __init__(self):
        Domain._claimed += 1
        folder = pathlib.Path(os.environ.get("TMPDIR", "/tmp")) / "rakelight_domains"
        folder.mkdir(parents=True, exist_ok=True)
        count = LAST_DOMAIN - FIRST_DOMAIN + 1
        for offset in range(count):
            # Neighbouring processes begin at different places, so that they rarely ask for the same one.
            number = FIRST_DOMAIN + (os.getpid() * 7 + Domain._claimed + offset) % count
            file = open(folder / f"{number:02}.lock", "a")
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                file.close()
                continue
            self.number, self._file = number, file
            return
        raise HarnessError(f"all of the ROS domains {FIRST_DOMAIN} to {LAST_DOMAIN} are in use: see {folder}")

    def environment(self):
        """Variables that put a process into this domain and keep it on this host."""
        return {"ROS_DOMAIN_ID": str(self.number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}

    def close(self):
        self._file.close()


def program_path(name):
    """A program of the workspace, from the folder that `RAKELIGHT_BIN_DIR` names."""
    folder = os.environ.get("RAKELIGHT_BIN_DIR")
    if folder is None:
        raise HarnessError("RAKELIGHT_BIN_DIR is not set: run `cargo xtask test`, or set it to target/debug")
    path = pathlib.Path(folder) / name
    if not path.is_file():
        raise HarnessError(f"there is no program {path}: run `cargo build -p rakelight -p scenarios --bins`")
    return path


def _die_with_parent():
    """Also when pytest is killed and no teardown runs."""
    LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


class Program:
    """A child process whose output is kept in files, so that a full pipe never blocks it."""

    def __init__(self, command, environment):
        self.name = pathlib.Path(command[0]).name
        self.expected_to_end = False
        self._stdout, self._stderr = tempfile.TemporaryFile(), tempfile.TemporaryFile()
        self.process = subprocess.Popen(
            [str(word) for word in command],
            stdin=subprocess.DEVNULL,
            stdout=self._stdout,
            stderr=self._stderr,
            env=os.environ | environment,
            preexec_fn=_die_with_parent,
        )

    @staticmethod
    def _text(file):
        return os.pread(file.fileno(), os.fstat(file.fileno()).st_size, 0).decode(errors="replace")

    def stdout(self):
        """All that it printed so far."""
        return self._text(self._stdout)

    def stderr(self):
        return self._text(self._stderr)

    def check_alive(self):
        code = self.process.poll()
        if code is not None and not self.expected_to_end:
            raise HarnessError(f"{self.name} ended with code {code} while the test needed it:\n{self.stderr()}")

    def wait(self, timeout=TIMEOUT):
        """Its exit code, once it ends by itself."""
        try:
            return self.process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise HarnessError(f"{self.name} did not end within {timeout} s") from None

    def interrupt(self, timeout=TIMEOUT):
        """Ctrl-C, and its exit code."""
        return self._end(signal.SIGINT, timeout)

    def terminate(self, timeout=TIMEOUT):
        """A request to end, and its exit code."""
        return self._end(signal.SIGTERM, timeout)

    def _end(self, number, timeout):
        self.expected_to_end = True
        self.process.send_signal(number)
        return self.wait(timeout)

    def kill(self):
        """No chance to say goodbye."""
        self.expected_to_end = True
        self.process.kill()
        self.process.wait()

    def closed(self):
        """Whether its output is gone already."""
        return self._stderr.closed

    def close(self):
        if self.process.poll() is None:
            self.kill()
        self._stdout.close()
        self._stderr.close()


class Peer:
    """An rclpy node in a context of its own, spun only while a test waits."""

    def __init__(self, domain, programs, name="rclpy_peer", namespace="/"):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain.number)
        self.node = rclpy.create_node(name, namespace=namespace, context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._programs = programs

    def spin_until(self, condition, what, timeout=TIMEOUT):
        """Handles callbacks until `condition()` is truthy and returns that; fails after `timeout` seconds."""
        deadline = time.monotonic() + timeout
        while not (outcome := condition()):
            for program in self._programs:
                program.check_alive()
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                raise HarnessError(f"waited {timeout} s for {what}")
            self._executor.spin_once(timeout_sec=min(0.05, remaining))
        return outcome

    def result(self, future, what, timeout=TIMEOUT):
        """The result of a call that was sent."""
        self.spin_until(future.done, what, timeout)
        return future.result()

    def collect(self, kind, topic, qos=10):
        """A list that grows by every message received from now on."""
        received = []
        self.node.create_subscription(kind, topic, received.append, qos)
        return received

    def messages(self, kind, topic, count=1, qos=10, timeout=TIMEOUT):
        """The next `count` messages of a topic."""
        received = self.collect(kind, topic, qos)
        what = f"{count} x {kind.__name__} on {topic}"
        self.spin_until(lambda: len(received) >= count, what, timeout)
        return received

    def publisher(self, kind, topic, qos=10, readers=1):
        """A publisher that is matched by `readers` subscriptions already."""
        publisher = self.node.create_publisher(kind, topic, qos)
        self.spin_until(lambda: publisher.get_subscription_count() >= readers, f"{readers} readers of {topic}")
        return publisher

    def act_until(self, action, condition, what, timeout=TIMEOUT):
        """Acts again and again until it has had an effect: one side of a match knows of it before the other does."""
        acted = None

        def act_and_ask():
            nonlocal acted
            if acted is None or time.monotonic() - acted > 2.0:
                action()
                acted = time.monotonic()
            return condition()

        return self.spin_until(act_and_ask, what, timeout)

    def publish_until(self, publisher, message, condition, what, timeout=TIMEOUT):
        """Publishes until it has had an effect."""
        return self.act_until(lambda: publisher.publish(message), condition, what, timeout)

    def call(self, kind, name, request, timeout=TIMEOUT):
        """The response of a service that must appear within the time too."""
        client = self.node.create_client(kind, name)
        self.spin_until(client.service_is_ready, f"service {name}", timeout)
        response = self.result(client.call_async(request), f"the response of {name}", timeout)
        self.node.destroy_client(client)
        return response

    def close(self):
        """Leaves the graph; may be called again."""
        if not self.context.ok():
            return
        self._executor.shutdown(timeout_sec=5)
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def latched(depth=1):
    """The QoS of state that late subscribers must get: reliable and transient local."""
    return QoSProfile(depth=depth, durability=rclpy.qos.DurabilityPolicy.TRANSIENT_LOCAL)
