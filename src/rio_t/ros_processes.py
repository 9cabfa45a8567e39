"""Starts and stops ROS programs, with a master of their own."""
import os
import signal
import socket
import subprocess
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from roslib.packages import find_node

from .errors import RioTError

SLOWNESS = float(os.environ.get("RIO_T_TEST_SLOWNESS", "1"))  # of the programs as built: sanitizers take time
DEADLINE = 60.0 * SLOWNESS  # [s] for anything; far more than needed, so that only a fault reaches it


def program(package, name):
    return find_node(package, name)[0]


class Process:
    """A process that ends with the `with` block: by an interrupt, or killed if it does not end. Then raises RioTError if it
    crashed, or failed before the interrupt; with `clean`, after any status but 0."""

    def __init__(self, *words, clean=False, **options):
        self.process = subprocess.Popen([str(word) for word in words], start_new_session=True, **options)
        self._clean, self._interrupted, self._killed = clean, False, False

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        status = self.stop()
        asked_to = self._interrupted and not self._clean and (status > 0 or status == -signal.SIGINT)
        if kind is None and status != 0 and not asked_to and not self._killed:
            raise RioTError(f"{self.process.args[0]} ended with status {status}")

    def wait(self):
        return self.process.wait(DEADLINE)

    def kill(self):
        """Ends it as a crash would. This is no fault."""
        self._killed = True
        os.killpg(self.process.pid, signal.SIGKILL)
        self.wait()

    def stop(self):
        """Exit status after an interrupt; raises if it does not end."""
        if self.process.poll() is None:
            self._interrupted = True
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            return self.process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise


def quiet(*words):
    """A Process without input and output, except for errors."""
    return Process(*words, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


def wait_for(what, condition, seconds=DEADLINE):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError(f"in {seconds:.0f} s not seen: {what}")
        time.sleep(0.01)


class Diagnostics:
    """The newest values of the node, {task: {key: value}}."""

    def __init__(self):
        self.newest = {}
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._keep)

    def _keep(self, message):
        for status in message.status:
            self.newest[status.name.split(": ")[-1]] = {value.key: value.value for value in status.values}

    def number(self, task, key):
        return float(self.newest.get(task, {}).get(key, 0.0))


def start_master():
    """roscore on a free port, which all programs started from here on use."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    os.environ.setdefault("ROS_IP", "127.0.0.1")
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{port}"
    core = quiet("roscore", "-p", port)
    try:
        wait_for("roscore", rosgraph.is_master_online)
    except BaseException:
        core.stop()
        raise
    return core
