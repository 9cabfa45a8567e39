#!/usr/bin/env python3
"""The live node against the bag runner: plays a bag to it with roslaunch, records what goes in and what comes out, and
checks that nothing is lost, that the result is as good, and how long it took.

usage: bench/live_against_bag.py BAG CONFIG [--rate R] [--nodelet] [--set key=value]...    (in a sourced workspace)

Exit status 1 where a check fails. Latencies are judged at rate 1 only: other rates are not what a robot has.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
import time

import numpy
import rosbag

from live_tools import DEADLINE, is_running, program, start, start_master, stop, wait_for

ATE_BOUND = 0.10  # of the bag runner's


def play(bag, config, rate, nodelet, topics, recorded):
    """Plays the bag to the live node and records the topics, by the wall clock of this machine."""
    processes = [start_master()]
    try:
        # Before roslaunch sets use_sim_time: so the recorder keeps to the wall clock.
        processes.append(start(program("rosbag", "record"), "--tcpnodelay", "--buffsize=0", "-O", recorded,
                               "__name:=recorder", *topics))
        wait_for("rosbag record", lambda: is_running("/recorder"))
        processes.append(start("roslaunch", "rio_t", "rio_t.launch", f"bag:={bag}", f"config:={config}", f"bag_rate:={rate}",
                               f"nodelet:={str(nodelet).lower()}"))
        wait_for("rosbag play", lambda: is_running("/bag_player"))
        with rosbag.Bag(bag) as data:
            length = data.get_end_time() - data.get_start_time()
        wait_for("the end of the bag", lambda: not is_running("/bag_player"), length / rate + DEADLINE)
        time.sleep(2.0)  # the last scans, and diagnostics once more
    finally:
        for process in reversed(processes):
            stop(process)


def read(recorded, names):
    """{topic: {stamp [ns]: (time of receipt [s], message)}} and the last diagnostics, {task: {key: value}}."""
    messages, diagnostics = {name: {} for name in names}, {}
    with rosbag.Bag(recorded) as recording:
        for topic, message, received in recording.read_messages(list(names) + ["/diagnostics"]):
            if topic == "/diagnostics":
                for status in message.status:
                    diagnostics[status.name.split(": ")[-1]] = {value.key: value.value for value in status.values}
            else:
                messages[topic][message.header.stamp.to_nsec()] = (received.to_sec(), message)
    return messages, diagnostics


def write_tum(path, odometry):
    with open(path, "w") as file:
        for stamp in sorted(odometry):
            p, q = odometry[stamp][1].pose.pose.position, odometry[stamp][1].pose.pose.orientation
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
    parser.add_argument("--set", action="append", default=[], metavar="key=value")
    arguments = parser.parse_args()
    bag = os.path.abspath(arguments.bag)
    folder = tempfile.mkdtemp(prefix="rio_t_live_")

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
    recorded = os.path.join(folder, "recorded.bag")
    play(bag, config, arguments.rate, arguments.nodelet, (imu_topic, radar_topic, odom, offset, "/diagnostics"), recorded)
    messages, diagnostics = read(recorded, (imu_topic, radar_topic, odom, offset))
    if not messages[odom] or not messages[offset]:
        sys.exit(f"live_against_bag.py: nothing came on {odom} or {offset}; recording: {recorded}")

    table = Table()
    print(f"{bag}, {arguments.config} {' '.join(arguments.set)}, rate {arguments.rate:g}")
    with rosbag.Bag(bag) as data:
        imu = sorted(message.header.stamp.to_nsec() for _, message, _ in data.read_messages([imu_topic]))
    live = messages[odom]
    by_runner = read_tum(os.path.join(runner, "trajectory.txt"))
    expected = [stamp for stamp in imu if stamp >= min(live)]
    missing = [stamp for stamp in expected if stamp not in live]
    table.row("IMU stamps in ~odom", f"{len(expected) - len(missing)} of {len(expected)} from the first on, "
              f"{len(missing)} missing", not missing)
    later = 1e-9 * (min(live) - min(by_runner))
    table.row("first ~odom", f"{1e3 * later:+.1f} ms after the bag runner's", abs(later) < 0.5)
    with open(os.path.join(runner, "time_offset.csv")) as lines:
        updates = len(lines.readlines()) - 1
    table.row("optimised states", f"{len(messages[offset])}, bag runner {updates}", abs(len(messages[offset]) - updates) <= 2)
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
    newest = messages[offset][max(messages[offset])][1]
    table.row("time offset at the end", f"{1e3 * newest.offset:.2f} ms live (sigma {1e3 * newest.sigma:.2f}), "
              f"{1e3 * final:.2f} ms bag runner", abs(newest.offset - final) < max(1e-3, newest.sigma))

    limits = {"IMU message to ~odom": (imu_topic, odom, 1.0, 5.0), "scan to optimised state": (radar_topic, offset, None, 20.0)}
    for name, (source, result, median_limit, most_limit) in limits.items():
        pairs = sorted(messages[source].keys() & messages[result].keys())
        if not pairs:
            table.row(name, "not known: the scans carry no stamp that the results repeat (stamp_source)")
            continue
        ms = [1e3 * (messages[result][stamp][0] - messages[source][stamp][0]) for stamp in pairs]
        median, most = numpy.percentile(ms, [50, 99])
        good = (median_limit is None or median < median_limit) and most < most_limit
        table.row(name, f"{len(ms)} messages, median {median:.2f} ms, 99 % below {most:.2f} ms, worst {max(ms):.2f} ms",
                  good if arguments.rate == 1.0 else None)
    print(f"  files in                       {folder}")
    sys.exit(1 if table.failed else 0)


if __name__ == "__main__":
    main()
