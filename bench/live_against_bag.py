#!/usr/bin/env python3
"""The live node against the bag runner: plays a bag to it with roslaunch, records what goes in and what comes out, and
checks that nothing is lost, that the result is as good, and how long it took.

usage: bench/live_against_bag.py BAG CONFIG [--rate R] [--nodelet] [--no-clock] [--set key=value]...
in a sourced workspace, e.g. after `source devel/setup.bash`

Exit status 1 where a check fails. Latencies are judged at rate 1 only: other rates are not what a robot has.
"""
import argparse
import contextlib
import os
import pathlib
import struct
import sys
import tempfile
import time

import numpy
import rosbag
import rosgraph
import rospy
import yaml
from nav_msgs.msg import Odometry
from rio_t import programs, run_folder, tum
from rio_t.errors import RioTError
from rio_t.msg import TimeOffset
from rio_t.ros_processes import DEADLINE, Diagnostics, program, quiet, start_master, wait_for

WAIT = 110.0  # [ms] of IMU that a scan waits for after its measurement, kImuMargin of odometry/estimator.cpp
ATE_BOUND = 0.10  # of the bag runner's


class Listener:
    """Keeps when each message came and what it said. Raw, so that it keeps up, and without a limit to its queue:
    `rosbag record` drops messages where the machine is busy."""

    def __init__(self, topics):
        self.raw = {topic: [] for topic in topics}
        self.diagnostics = Diagnostics().newest
        for topic in topics:
            rospy.Subscriber(topic, rospy.AnyMsg, self._keep, self.raw[topic], buff_size=2**24, tcp_nodelay=True)

    @staticmethod
    def _keep(message, messages):
        messages.append((time.monotonic(), message._buff))

    def receipts(self, topic):
        """{stamp of the header [ns]: time of receipt [s]}"""
        stamps = ((struct.unpack_from("<II", raw, 4), received) for received, raw in self.raw[topic])
        return {seconds * 10**9 + nanoseconds: received for (seconds, nanoseconds), received in stamps}

    def messages(self, topic, kind):
        """{stamp of the header [ns]: message}"""
        parsed = (kind().deserialize(raw) for _, raw in self.raw[topic])
        return {message.header.stamp.to_nsec(): message for message in parsed}


def is_running(node):
    try:
        rosgraph.Master("/benchmark").lookupNode(node)
        return True
    except rosgraph.MasterError:
        return False


def play(bag, config, rate, nodelet, clock, topics):
    """Plays the bag to the live node; what was heard meanwhile."""
    with contextlib.ExitStack() as running:
        running.enter_context(start_master())
        # Before use_sim_time is set: the listener keeps to the clock of the wall.
        rospy.init_node("listener", disable_signals=True)
        listener = Listener(topics)
        launch = ["roslaunch", "rio_t", "rio_t.launch", f"config:={config}", f"nodelet:={str(nodelet).lower()}"]
        if clock:
            launch += [f"bag:={bag}", f"bag_rate:={rate}"]
        running.enter_context(quiet(*launch))
        wait_for("the node's diagnostics", lambda: "input" in listener.diagnostics)
        if not clock:
            running.enter_context(quiet(program("rosbag", "play"), "--quiet", "--delay=3", f"--rate={rate}",
                                        "__name:=bag_player", bag))
            wait_for("rosbag play", lambda: is_running("/bag_player"))
        with rosbag.Bag(bag) as data:
            length = data.get_end_time() - data.get_start_time()
        wait_for("the end of the bag", lambda: not is_running("/bag_player"), length / rate + DEADLINE)
        time.sleep(2.0)  # the last scans, and diagnostics once more
        return listener


def trajectory_of(poses):
    """Of poses by stamp [ns]."""
    stamps = sorted(poses)
    positions, rotations = [poses[s].position for s in stamps], [poses[s].orientation for s in stamps]
    return tum.Trajectory(numpy.array(stamps), numpy.array([[p.x, p.y, p.z] for p in positions]),
                          numpy.array([[q.x, q.y, q.z, q.w] for q in rotations]))


def write_truth(bag, topic, path):
    """Whether there is one."""
    with rosbag.Bag(bag) as data:
        poses = {message.header.stamp.to_nsec(): message.pose for _, message, _ in data.read_messages([topic])}
    if poses:
        tum.write(path, trajectory_of(poses))
    return bool(poses)


class Table:
    def __init__(self):
        self.failed = False

    def row(self, name, text, passed=None):
        self.failed |= passed is False
        print(f"  {name:30s} {text}" + ({True: "   ok", False: "   FAILED", None: ""}[passed]), flush=True)


def main():
    parser = argparse.ArgumentParser(prog="live_against_bag.py", description=__doc__.split("\n\n")[0])
    parser.add_argument("bag")
    parser.add_argument("config")
    parser.add_argument("--rate", type=float, default=1.0)
    parser.add_argument("--nodelet", action="store_true")
    parser.add_argument("--no-clock", action="store_true", help="as sensors do: no /clock, the node lives in wall time")
    parser.add_argument("--set", action="append", default=[], metavar="key=value")
    arguments = parser.parse_args()
    try:
        passed = compare(arguments)
    except (RioTError, OSError) as error:
        sys.exit(f"live_against_bag.py: {error}")
    sys.exit(0 if passed else 1)


def compare(arguments):
    """Prints the table; true if all checks hold."""
    bag = os.path.abspath(arguments.bag)
    folder = pathlib.Path(tempfile.mkdtemp(prefix="rio_t_live_against_bag_"))

    # One file with every parameter, so that both sides have the same.
    bag_program, config, runner = program("rio_t", "rio_t_bag"), folder / "config.yaml", folder / "bag_runner"
    settings = [word for setting in arguments.set for word in ("--set", setting)]
    config.write_text(programs.output_of(bag_program, "--config", arguments.config, *settings, "--print-config"))
    programs.output_of(bag_program, "--bag", bag, "--config", config, "--output-dir", runner)

    values = run_folder.read_yaml(config)
    imu_topic, radar_topic, truth_topic = (
        "/" + values[f"{key}_topic"].lstrip("/") for key in ("imu", "radar", "ground_truth"))
    odom, offset = "/rio_t/odom", "/rio_t/time_offset"
    listener = play(bag, config, arguments.rate, arguments.nodelet, not arguments.no_clock,
                    (imu_topic, radar_topic, odom, offset))
    live, offsets = listener.messages(odom, Odometry), listener.messages(offset, TimeOffset)
    diagnostics = listener.diagnostics
    if not live or not offsets:
        raise RioTError(f"nothing came on {odom} or {offset}; diagnostics: {diagnostics}")

    table = Table()
    print(f"{os.path.basename(bag)}, {' '.join([arguments.config, *arguments.set])}, rate {arguments.rate:g}"
          + (", no clock" if arguments.no_clock else ""))
    with rosbag.Bag(bag) as data:
        imu = sorted(message.header.stamp.to_nsec() for _, message, _ in data.read_messages([imu_topic]))
    came = int(diagnostics["input"]["imu_messages"])
    table.row("IMU messages that came", f"{came} of {len(imu)}", came == len(imu))
    by_runner = tum.read(runner / "trajectory.txt").positions()
    expected = [stamp for stamp in imu if stamp >= min(live)]
    missing = [stamp for stamp in expected if stamp not in live]
    table.row("IMU stamps in ~odom", f"{len(expected) - len(missing)} of {len(expected)} from the first on, "
              f"{len(missing)} missing", not missing)
    later = 1e-9 * (min(live) - min(by_runner))
    table.row("first ~odom", f"{1e3 * later:+.1f} ms after the bag runner's", abs(later) < 0.5)
    updates = len(run_folder.read(runner, "time_offset.csv")["stamp"])
    table.row("optimised states", f"{len(offsets)}, bag runner {updates}", abs(len(offsets) - updates) <= 2)
    drops = {key: int(value) for key, value in diagnostics.get("input", {}).items()
             if key in ("dropped_queue_full", "fault_imu_gap", "fault_imu_out_of_order", "dropped_imu_not_usable")}
    table.row("lost or out of order", ", ".join(f"{v} {k}" for k, v in drops.items()) or "none",
              drops.get("dropped_queue_full", 0) == 0)

    estimate, truth = folder / "live.txt", folder / "truth.txt"
    trajectory = trajectory_of({stamp: message.pose.pose for stamp, message in live.items()})
    tum.write(estimate, trajectory)
    live_positions = trajectory.positions()
    common = sorted(live_positions.keys() & by_runner.keys())
    apart = [numpy.linalg.norm(live_positions[stamp] - by_runner[stamp]) for stamp in common]
    table.row("live to bag runner", f"{1e3 * numpy.sqrt(numpy.mean(numpy.square(apart))):.1f} mm rms, "
              f"{1e3 * max(apart):.1f} mm worst, of {len(common)} poses")
    if write_truth(bag, truth_topic, truth):
        told = yaml.safe_load(programs.output_of(program("rio_t", "evaluate"), "--yaml", truth, estimate,
                                                 runner / "trajectory.txt"))
        ates = [each["ape_origin_m"]["rmse"] for each in told["estimates"]]
        ratio = ates[0] / ates[1]
        table.row("ATE", f"{ates[0]:.4f} m live, {ates[1]:.4f} m bag runner, {100.0 * (ratio - 1.0):+.1f} %",
                  abs(ratio - 1.0) <= ATE_BOUND)
    final = run_folder.read_yaml(runner / "summary.yaml")["final_offset_s"]
    newest = offsets[max(offsets)]
    table.row("time offset at the end", f"{1e3 * newest.offset:.2f} ms live (sigma {1e3 * newest.sigma:.2f}), "
              f"{1e3 * final:.2f} ms bag runner", abs(newest.offset - final) < max(1e-3, newest.sigma))

    limits = {"IMU message to ~odom": (imu_topic, odom, 1.0, 5.0), "scan to optimised state": (radar_topic, offset, None, WAIT + 20.0)}
    for name, (source, result, median_limit, most_limit) in limits.items():
        begin, end = listener.receipts(source), listener.receipts(result)
        pairs = sorted(begin.keys() & end.keys())
        if not pairs:
            table.row(name, "not known: the scans carry no stamp that the results repeat (stamp_source)")
            continue
        ms = [1e3 * (end[stamp] - begin[stamp]) for stamp in pairs]
        median, most = numpy.percentile(ms, [50, 99])
        good = (median_limit is None or median < median_limit) and most < most_limit
        table.row(name, f"{len(ms)} messages, median {median:.2f} ms, 99 % below {most:.2f} ms, worst {max(ms):.2f} ms",
                  good if arguments.rate == 1.0 else None)
    print(f"  files in                       {folder}")
    return not table.failed


if __name__ == "__main__":
    main()
