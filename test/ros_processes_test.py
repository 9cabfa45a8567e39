"""Processes of the live tests: one that fails is not overlooked."""
import subprocess
import sys

import pytest

from rio_t.errors import RioTError
from rio_t.ros_processes import Process

# Begins a program that says when it is ready, and goes on when it is asked to end.
WHEN_ASKED = """import os, signal
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
print("ready", flush=True)
signal.sigwait({signal.SIGINT})
"""
CRASH = "import os; os.kill(os.getpid(), 11)"
INTERRUPTED = """import os, signal
signal.signal(signal.SIGINT, signal.SIG_DFL)
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
os.kill(os.getpid(), signal.SIGINT)
"""


def play(program, **options):
    """The block ends when the program is ready, or has ended by itself."""
    with Process(sys.executable, "-c", program, stdout=subprocess.PIPE, text=True, **options) as process:
        if process.process.stdout.readline() != "ready\n":
            process.wait()


@pytest.mark.parametrize("program, options", [
    ("", {"clean": True}), (WHEN_ASKED, {"clean": True}), (WHEN_ASKED + INTERRUPTED, {}), (WHEN_ASKED + "os._exit(1)", {})])
def test_a_process_that_ends_as_asked_is_no_fault(program, options):
    play(program, **options)


@pytest.mark.parametrize("program, options, status", [
    ("raise SystemExit(3)", {}, 3), (CRASH, {}, -11), (INTERRUPTED, {}, -2), (WHEN_ASKED + CRASH, {}, -11),
    (WHEN_ASKED + INTERRUPTED, {"clean": True}, -2), (WHEN_ASKED + "os._exit(1)", {"clean": True}, 1)])
def test_a_process_that_fails_is_told(program, options, status):
    with pytest.raises(RioTError, match=f"ended with status {status}$"):
        play(program, **options)


def test_what_went_wrong_before_is_told_first():
    with pytest.raises(KeyError), Process("false") as process:
        process.wait()
        raise KeyError


def test_a_process_that_the_test_kills_is_no_fault():
    with Process("sleep", "600", clean=True) as process:
        process.kill()
