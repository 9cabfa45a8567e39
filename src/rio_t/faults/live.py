"""The cases that only exist live: a roscore, the node, rosbag play, and something that goes wrong.

Each case is a function that makes it go wrong and checks what must happen; the first line of its text says what that is.
They use the same tools as the rostests (live_tester.py).
"""
import contextlib
import dataclasses
import os
import re
import signal
import subprocess
import time
from typing import Callable

import numpy

from . import campaign, injection, judge, stream

RATE = 4.0                  # times real time of the played bags
VELOCITY = 0.5              # [m/s] error of the odometry where it has recovered
PLAYED = ["--duration=40"]  # [s] of the bag: the faults are there from 20 s on


@dataclasses.dataclass
class Case:
    name: str
    play: Callable  # (Live) -> None

    @property
    def must(self):
        return self.play.__doc__.strip().splitlines()[0]


class Live:
    """A node that listens, what it says, and the truth. Collects what happened and what is wrong."""

    def __init__(self, tester, bag, folder):
        self.tester, self.bag, self.folder = tester, bag, folder
        self.happened, self.wrong = [], []
        self.truth = judge.read_truth(bag.truth)
        self.messages = campaign.messages_of(bag)
        self.begin = 1e-9 * next(m for m in self.messages if m.kind == "imu").stamp
        self.log = folder / "node.log"
        self.logs = open(self.log, "w")

    def node(self, *parameters):
        return self.tester.node("config:=" + self.bag.config, *parameters, stdout=self.logs, stderr=subprocess.STDOUT)

    def player(self, *more, bag=None, rate=RATE):
        return self.tester.play(bag or self.bag.path, (self.tester.IMU, self.tester.RADAR), rate, *more)

    def faulty_bag(self, fault, begin, end):
        site = injection.Site(self.messages[0].record, begin, end, numpy.random.RandomState(1))
        path = self.folder / "faulty.bag"
        stream.write(path, fault(self.messages, site))
        return path

    def expect(self, holds, what):
        if not holds:
            self.wrong.append(what)

    def wait(self, listener, what, condition):
        """True once `condition()` holds; else wrong."""
        try:
            listener.wait_for(what, condition)
            return True
        except AssertionError:
            self.wrong.append(f"never: {what}")
            return False

    def seconds(self, message):
        return message.header.stamp.to_sec() - self.begin

    def check_odometry(self, messages, since, until, shift=0.0, bound=VELOCITY):
        """Velocity of the odometry in its own frame against the truth; every number finite."""
        part = [m for m in messages if since + shift <= self.seconds(m) < until + shift]
        self.expect(part, f"no odometry from {since:.1f} to {until:.1f} s")
        if not part:
            return
        times = numpy.array([m.header.stamp.to_sec() - shift for m in part])
        true = judge.at(self.truth, times)
        said = numpy.array([injection.vector(m.twist.twist.linear) for m in part])
        worst = numpy.linalg.norm(said - true.body_velocity, axis=1).max()
        self.happened.append(f"{worst:.2f} m/s from {since:.0f} s on")
        self.expect(worst < bound, f"velocity error {worst:.2f} m/s from {since:.0f} s on, at most {bound} allowed")
        for m in part:
            if not numpy.isfinite([*m.pose.covariance, *m.twist.covariance, m.pose.pose.position.x,
                                   m.pose.pose.orientation.w]).all():
                self.wrong.append("an odometry that is not finite")
                break

    def said(self, pattern, at_most=None):
        """Counts the lines of the node's log with `pattern`: at least one, and not one for each message."""
        self.logs.flush()
        count = len(re.findall(pattern, self.log.read_text()))
        self.expect(count > 0, f"the node does not say \"{pattern}\"")
        if at_most is not None:
            self.expect(count <= at_most, f"the node says \"{pattern}\" {count} times")


def wait_for_time(live, listener, seconds):
    return live.wait(listener, f"odometry at {seconds} s",
                     lambda: listener.messages["odom"] and live.seconds(listener.messages["odom"][-1]) >= seconds)


def node_killed(live):
    """killed in motion and started again: odometry again within 12 s, starting in motion, error < 0.5 m/s"""
    with live.tester.Listener() as listener, live.node() as first, live.player("--duration=50", rate=2.0) as player:
        listener.wait_until_heard()
        wait_for_time(live, listener, 20.0)
        first.kill()
        killed_at = live.seconds(listener.messages["odom"][-1])
        with live.node():
            before = len(listener.messages["odom"])
            live.wait(listener, "odometry after the start", lambda: len(listener.messages["odom"]) > before + 10)
            player.wait()
            again = listener.messages["odom"][before:]
            if again:
                back = live.seconds(again[0])
                live.happened.append(f"back after {back - killed_at:.1f} s")
                live.expect(back - killed_at < 12.0, f"back only after {back - killed_at:.1f} s")
                live.check_odometry(again, back + 2.0, 49.0)


def bag_loops(live):
    """stamps jump back: one reset, said and counted, odometry again"""
    with live.tester.Listener() as listener, live.node(), live.player("--duration=25", "--loop") as player:
        listener.wait_until_heard()
        wait_for_time(live, listener, 24.0)
        live.wait(listener, "a reset in diagnostics", lambda: listener.value("odometry", "resets") == "1")
        before = len(listener.messages["odom"])
        live.wait(listener, "the second time round",
                  lambda: len(listener.messages["odom"]) > before + 10 and live.seconds(listener.messages["odom"][-1]) > 15)
        player.stop()
        live.happened.append("because: " + str(listener.value("odometry", "last_reset_because")))
        live.check_odometry(listener.messages["odom"][before + 1:], 10.0, 15.0)
        live.said("reset: ", at_most=2)


def clock_jumps(live):
    """all clocks jump by 30 s in motion: said and counted, odometry again within 10 s, error < 0.5 m/s"""
    bag = live.faulty_bag(injection.clock_jump(30.0), 20.0, 20.0)
    with live.tester.Listener() as listener, live.node(), live.player(bag=bag) as player:
        listener.wait_until_heard()
        wait_for_time(live, listener, 30.0 + 45.0)
        player.stop()
        after = [m for m in listener.messages["odom"] if live.seconds(m) > 50.0]
        if after:
            live.happened.append(f"back after {live.seconds(after[0]) - 50.0:.1f} s")
            live.expect(live.seconds(after[0]) < 60.0, "not back within 10 s")
        live.check_odometry(listener.messages["odom"], 32.0, 44.0, shift=30.0)
        counted = (int(listener.value("odometry", "resets") or 0), listener.value("input", "fault_imu_clock_restart"))
        live.expect(counted[0] > 0 or counted[1] is not None, "not counted in diagnostics")


def scan_stamps_zero(live):
    """every third scan without a stamp: counted, said at most once in 5 s, error < 0.5 m/s"""
    bag = live.faulty_bag(injection.stamp_zero("radar", every=3), 20.0, 30.0)
    with live.tester.Listener() as listener, live.node(), live.player(*PLAYED, bag=bag):
        listener.wait_until_heard()
        wait_for_time(live, listener, 39.0)
        live.wait(listener, "scans counted", lambda: listener.value("input", "dropped_stamp_zero") not in (None, "0"))
        live.happened.append(f"counted {listener.value('input', 'dropped_stamp_zero')}")
        live.check_odometry(listener.messages["odom"], 10.0, 38.0)
        live.said("stamp in the header is zero", at_most=4)


def radar_blackout(live):
    """no scan for 10 s: diagnostics say so, sigma grows, error < 0.5 m/s 5 s later"""
    bag = live.faulty_bag(injection.radar_blackout, 20.0, 30.0)
    # The node diagnoses once a second of the wall's clock, and says so at the third time within the blackout.
    with live.tester.Listener() as listener, live.node(), live.player(*PLAYED, bag=bag, rate=2.0):
        listener.wait_until_heard()
        live.wait(listener, "a diagnosis that the radar is silent",
                  lambda: "radar" in getattr(listener.diagnostics.get("input"), "message", "")
                  and listener.diagnostics["input"].level > 0 and listener.messages["odom"]
                  and live.seconds(listener.messages["odom"][-1]) > 20.0)
        wait_for_time(live, listener, 39.0)
        live.check_odometry(listener.messages["odom"], 35.0, 38.0)
        sigma = {round(live.seconds(m), 1): m.twist.covariance[0] ** 0.5 for m in listener.messages["odom"]}
        grown = sigma[29.9] / sigma[19.5]
        live.happened.append(f"sigma times {grown:.1f}")
        live.expect(grown > 2.0, f"sigma grew {grown:.1f} times only")


def solver_is_slow(live):
    """a solver that cannot keep up: odometry at every IMU sample all the same, dropped scans counted and said"""
    parameters = ("window:=60.0", "solver:=ceres", "max_iterations:=1000", "max_queued_scans:=3")
    with live.tester.Listener() as listener, live.node(*parameters), live.player(*PLAYED, rate=10.0):
        listener.wait_until_heard()
        wait_for_time(live, listener, 39.0)
        live.wait(listener, "scans dropped", lambda: listener.value("input", "dropped_queue_full") not in (None, "0"))
        live.happened.append(f"dropped {listener.value('input', 'dropped_queue_full')}")
        stamps = [m.header.stamp.to_nsec() for m in listener.messages["odom"]]
        sent = [m.stamp for m in live.messages if m.kind == "imu"]
        missed = sent.index(stamps[-1]) - sent.index(stamps[0]) + 1 - len(stamps)
        live.happened.append(f"{missed} of {len(stamps)} odometry messages missing")
        live.expect(missed == 0, f"{missed} odometry messages missing")
        live.check_odometry(listener.messages["odom"], 10.0, 38.0, bound=1.0)
        live.said("scans waited too long for the IMU or the solver")


def frozen_for_3s(live):
    """the whole process stands still for 3 s of data: goes on, error < 0.5 m/s 5 s later"""
    with live.tester.Listener() as listener, live.node() as node, live.player(*PLAYED):
        listener.wait_until_heard()
        wait_for_time(live, listener, 20.0)
        os.kill(node.process.pid, signal.SIGSTOP)
        time.sleep(3.0 / RATE)
        os.kill(node.process.pid, signal.SIGCONT)
        wait_for_time(live, listener, 39.0)
        live.check_odometry(listener.messages["odom"], 28.0, 38.0)


CASES = [Case("live_" + play.__name__, play)
         for play in (node_killed, bag_loops, clock_jumps, scan_stamps_zero, radar_blackout, solver_is_slow,
                      frozen_for_3s)]


@contextlib.contextmanager
def session():
    """A roscore of its own, with us as a node of it. Gives the tools of the rostests."""
    # Late: the cases can be listed without a sourced workspace.
    import rospy
    from .. import live_tester, ros_processes
    with ros_processes.start_master():
        rospy.init_node("faults", disable_signals=True)
        rospy.set_param("/use_sim_time", True)  # for the nodes; this one keeps to the wall clock
        yield live_tester


def run(case, tester, bag, folder):
    """(what happened, [what is wrong])"""
    folder = folder / case.name
    folder.mkdir(parents=True, exist_ok=True)
    try:
        live = Live(tester, bag, folder)
        case.play(live)
        return ", ".join(live.happened) or "as it must", live.wrong
    except Exception as error:  # a case that cannot be judged has failed; the others go on
        return f"{type(error).__name__}: {error}", ["the case itself failed"]
