"""Starts ROS programs for the benchmarks of the live node, with a master of their own."""
import os
import signal
import socket
import subprocess
import sys
import time

import rosgraph
from roslib.packages import find_node

DEADLINE = 60.0  # [s] for anything that is not the bag itself


def program(package, name):
    return find_node(package, name)[0]


def start(*words):
    return subprocess.Popen([str(word) for word in words], start_new_session=True, stdin=subprocess.DEVNULL,
                            stdout=subprocess.DEVNULL)


def stop(process):
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGINT)
    return process.wait()


def wait_for(what, condition, seconds=DEADLINE):
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            sys.exit(f"in {seconds:.0f} s not seen: {what}")
        time.sleep(0.1)


def is_running(node):
    try:
        rosgraph.Master("/benchmark").lookupNode(node)
        return True
    except rosgraph.MasterError:
        return False


def start_master():
    """roscore on a free port, which all programs started from here on use."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    os.environ["ROS_MASTER_URI"] = f"http://127.0.0.1:{port}"
    core = start("roscore", "-p", str(port))
    wait_for("roscore", rosgraph.is_master_online)
    return core
