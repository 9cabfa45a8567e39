#!/usr/bin/env python3
"""The live node against the bag runner: plays a bag to it with roslaunch, records what goes in and what comes out, and
checks that nothing is lost, that the result is as good, and how long it took.

usage: bench/live_against_bag.py BAG CONFIG [--rate R] [--nodelet] [--no-clock] [--set key=value]...
in a sourced workspace, e.g. after `source build/devel/setup.bash`

Exit status 1 where a check fails. Latencies are judged at rate 1 only: other rates are not what a robot has.
"""
import argparse
import os
import re
import struct
import subprocess
import sys
import tempfile
import time

import numpy
import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rio_t.msg import TimeOffset

from live_tools import DEADLINE, is_running, program, start, start_master, stop, wait_for

ATE_BOUND = 0.10  # of the bag runner's


class Listener:
    """Keeps when each message came and what it said. Raw, so that it keeps up, and without a limit to its queue:
    `rosbag record` drops messages where the machine is busy."""

    def __init__(self, topics):
        self.raw = {topic: [] for topic in topics}
        self.diagnostics = {}  # the last: {task: {key: value}}
        for topic in topics:
            rospy.Subscriber(topic, rospy.AnyMsg, self._keep, self.raw[topic], buff_size=2**24, tcp_nodelay=True)
        rospy.Subscriber("/diagnostics", DiagnosticArray, self._keep_diagnostics)

    @staticmethod
    def _keep(message, messages):
        messages.append((time.monotonic(), message._buff))

    def _keep_diagnostics(self, message):
        for status in message.status:
            self.diagnostics[status.name.split(": ")[-1]] = {value.key: value.value for value in status.values}

    def receipts(self, topic):
        """{stamp of the header [ns]: time of receipt [s]}"""
        stamps = ((struct.unpack_from("<II", raw, 4), received) for received, raw in self.raw[topic])
        return {seconds * 10**9 + nanoseconds: received for (seconds, nanoseconds), received in stamps}

    def messages(self, topic, kind):
        """{stamp of the header [ns]: message}"""
        parsed = (kind().deserialize(raw) for _, raw in self.raw[topic])
        return {message.header.stamp.to_nsec(): message for message in parsed}


def play(bag, config, rate, nodelet, clock, topics):
    """Plays the bag to the live node; what was heard meanwhile."""
    processes = [start_master()]
    try:
        # Before use_sim_time is set: the listener keeps to the clock of the wall.
        rospy.init_node("listener", disable_signals=True)
        listener = Listener(topics)
        launch = ["roslaunch", "rio_t", "rio_t.launch", f"config:={config}", f"nodelet:={str(nodelet).lower()}"]
        if clock:
            launch += [f"bag:={bag}", f"bag_rate:={rate}"]
        processes.append(start(*launch))
        wait_for("the node's diagnostics", lambda: "input" in listener.diagnostics)
        if not clock:
            processes.append(start(program("rosbag", "play"), "--quiet", "--delay=3", f"--rate={rate}",
                                   "__name:=bag_player", bag))
            wait_for("rosbag play", lambda: is_running("/bag_player"))
        with rosbag.Bag(bag) as data:
            length = data.get_end_time() - data.get_start_time()
        wait_for("the end of the bag", lambda: not is_running("/bag_player"), length / rate + DEADLINE)
        time.sleep(2.0)  # the last scans, and diagnostics once more
        return listener
    finally:
        for process in reversed(processes):
            stop(process)


def write_tum(path, odometry):
    with open(path, "w") as file:
        for stamp in sorted(odometry):
            p, q = odometry[stamp].pose.pose.position, odometry[stamp].pose.pose.orientation
            file.write(f"{stamp // 10**9}.{stamp % 10**9:09d} {p.x:.9f} {p.y:.9f} {p.z:.9f} "
                       f"{q.x:.9f} {q.y:.9f} {q.z:.9f} {q.w:.9f}\n")


def read_tum(path):
    poses = {}
    with open(path) as lines:
        for line in lines:
            stamp, *numbers = line.split()
            whole, _, part = stamp.partition(".")
            poses[int(whole) * 10**9 + int(part.ljust(9, "0"))] = numpy.array([float(x) for x in numbers])
    return poses


def write_truth(bag, topic, path):
    with rosbag.Bag(bag) as data, open(path, "w") as file:
        count = 0
        for _, message, _ in data.read_messages([topic]):
            stamp, p, q = message.header.stamp.to_nsec(), message.pose.position, message.pose.orientation
            file.write(f"{stamp // 10**9}.{stamp % 10**9:09d} {p.x!r} {p.y!r} {p.z!r} {q.x!r} {q.y!r} {q.z!r} {q.w!r}\n")
            count += 1
    return count > 0


def value_of(yaml, key):
    found = re.search(rf"^{key}: *(.*?) *(#.*)?$", yaml, re.MULTILINE)
    return found.group(1).strip("\"'") if found else ""


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
    bag = os.path.abspath(arguments.bag)
    folder = tempfile.mkdtemp(prefix="rio_t_live_against_bag_")

    # One file with every parameter, so that both sides have the same.
    words = [program("rio_t", "rio_t_bag"), "--config", arguments.config]
    for assignment in arguments.set:
        words += ["--set", assignment]
    yaml = subprocess.run([*words, "--print-config"], stdout=subprocess.PIPE, text=True, check=True).stdout
    config = os.path.join(folder, "config.yaml")
    with open(config, "w") as file:
        file.write(yaml)
    runner = os.path.join(folder, "bag_runner")
    subprocess.run([words[0], "--bag", bag, "--config", config, "--output-dir", runner], check=True,
                   stdout=subprocess.DEVNULL)

    imu_topic, radar_topic = value_of(yaml, "imu_topic"), value_of(yaml, "radar_topic")
    odom, offset = "/rio_t/odom", "/rio_t/time_offset"
    listener = play(bag, config, arguments.rate, arguments.nodelet, not arguments.no_clock,
                    (imu_topic, radar_topic, odom, offset))
    live, offsets = listener.messages(odom, Odometry), listener.messages(offset, TimeOffset)
    diagnostics = listener.diagnostics
    if not live or not offsets:
        sys.exit(f"live_against_bag.py: nothing came on {odom} or {offset}; diagnostics: {diagnostics}")

    table = Table()
    print(f"{os.path.basename(bag)}, {' '.join([arguments.config, *arguments.set])}, rate {arguments.rate:g}"
          + (", no clock" if arguments.no_clock else ""))
    with rosbag.Bag(bag) as data:
        imu = sorted(message.header.stamp.to_nsec() for _, message, _ in data.read_messages([imu_topic]))
    came = int(diagnostics["input"]["imu_messages"])
    table.row("IMU messages that came", f"{came} of {len(imu)}", came == len(imu))
    by_runner = read_tum(os.path.join(runner, "trajectory.txt"))
    expected = [stamp for stamp in imu if stamp >= min(live)]
    missing = [stamp for stamp in expected if stamp not in live]
    table.row("IMU stamps in ~odom", f"{len(expected) - len(missing)} of {len(expected)} from the first on, "
              f"{len(missing)} missing", not missing)
    later = 1e-9 * (min(live) - min(by_runner))
    table.row("first ~odom", f"{1e3 * later:+.1f} ms after the bag runner's", abs(later) < 0.5)
    with open(os.path.join(runner, "time_offset.csv")) as lines:
        updates = len(lines.readlines()) - 1
    table.row("optimised states", f"{len(offsets)}, bag runner {updates}", abs(len(offsets) - updates) <= 2)
    drops = {key: int(value) for key, value in diagnostics.get("input", {}).items()
             if key in ("dropped_queue_full", "fault_imu_gap", "fault_imu_out_of_order", "dropped_imu_not_usable")}
    table.row("lost or out of order", ", ".join(f"{v} {k}" for k, v in drops.items()) or "none",
              drops.get("dropped_queue_full", 0) == 0)

    estimate = os.path.join(folder, "live.txt")
    write_tum(estimate, live)
    truth = os.path.join(folder, "truth.txt")
    common = sorted(live.keys() & by_runner.keys())
    live_poses = read_tum(estimate)
    apart = [numpy.linalg.norm(live_poses[stamp][:3] - by_runner[stamp][:3]) for stamp in common]
    table.row("live to bag runner", f"{1e3 * numpy.sqrt(numpy.mean(numpy.square(apart))):.1f} mm rms, "
              f"{1e3 * max(apart):.1f} mm worst, of {len(common)} poses")
    if write_truth(bag, value_of(yaml, "ground_truth_topic"), truth):
        ates = []
        for each in (estimate, os.path.join(runner, "trajectory.txt")):
            report = subprocess.run([program("rio_t", "evaluate"), "--yaml", truth, each], stdout=subprocess.PIPE,
                                    text=True, check=True).stdout
            ates.append(float(re.search(r"ape_origin_m: {rmse: ([^,]+)", report).group(1)))
        ratio = ates[0] / ates[1]
        table.row("ATE", f"{ates[0]:.4f} m live, {ates[1]:.4f} m bag runner, {100.0 * (ratio - 1.0):+.1f} %",
                  abs(ratio - 1.0) <= ATE_BOUND)
    with open(os.path.join(runner, "summary.yaml")) as file:
        final = float(value_of(file.read(), "final_offset_s"))
    newest = offsets[max(offsets)]
    table.row("time offset at the end", f"{1e3 * newest.offset:.2f} ms live (sigma {1e3 * newest.sigma:.2f}), "
              f"{1e3 * final:.2f} ms bag runner", abs(newest.offset - final) < max(1e-3, newest.sigma))

    limits = {"IMU message to ~odom": (imu_topic, odom, 1.0, 5.0), "scan to optimised state": (radar_topic, offset, None, 20.0)}
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
    sys.exit(1 if table.failed else 0)


if __name__ == "__main__":
    main()
