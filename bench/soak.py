#!/usr/bin/env python3
"""Plays simulated data to the live node for long, at high speed: called by scripts/soak.sh, which builds first."""
import argparse
import contextlib
import os
import sys
import tempfile
import time

# Limits. What is bounded may still fill after the first minute: ~path in 200 s, the poses kept for ~save_trajectory in
# an hour, some 4 MB together (docs/architecture.md, "Bounds").
MEMORY_GROWTH_MB = 5.0  # from the first minute of data to the end
MEMORY_SLOPE_MB = 0.1   # a minute of data, over the second half and not before ...
SLOPE_AFTER = 300.0     # [s] of data
LATENCY_DRIFT = 1.5     # mean of the last quarter over that of the second quarter
LATENCY_NOISE_MS = 0.5  # differences below say nothing


def arguments_of(words):
    parser = argparse.ArgumentParser(prog="soak.sh", description="memory and latency of the live node over a long time")
    parser.add_argument("minutes", nargs="?", type=float, default=60.0, help="of data [60]")
    parser.add_argument("--rate", type=float, default=10.0, help="times real time [10]")
    parser.add_argument("--output-dir", default="results/soak", metavar="DIR")
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args(words)
    if not 3.0 <= arguments.minutes <= 600.0:
        parser.error("MINUTES_OF_DATA: expected 3 to 600")
    if not 0.1 <= arguments.rate <= 100.0:
        parser.error("--rate: expected 0.1 to 100")
    return arguments


ARGUMENTS = arguments_of(sys.argv[1:])  # before what takes seconds to import
if ARGUMENTS.check:
    sys.exit()

import numpy  # noqa: E402
import rosbag  # noqa: E402
import rospy  # noqa: E402
from rio_t import programs  # noqa: E402
from rio_t.plots import pyplot  # noqa: E402
from rio_t.ros_processes import Diagnostics, program, quiet, start_master, wait_for  # noqa: E402


def memory_mb(process):
    with open(f"/proc/{process.pid}/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def sample(node, diagnostics, seconds):
    """One line of the record; the sums behind the means, so that the mean of any stretch can be had."""
    imu, updates = diagnostics.number("input", "imu_messages"), diagnostics.number("solver", "updates")
    return (seconds, memory_mb(node), imu, imu * diagnostics.number("solver", "imu_to_odometry_mean_ms"), updates,
            updates * diagnostics.number("solver", "scan_to_optimised_mean_ms"))


def make_bag(path, minutes):
    words = (program("rio_t", "simulate"), "--motion", "medium", "--seed", "11", "--time-offset", "0.02", "--duration",
             f"{60.0 * minutes:g}", "--out", path)
    print(f"Simulating {minutes:g} minutes ...", flush=True)
    if programs.run(*words).returncode != 0:
        sys.exit("soak.py: the simulation failed")


def run(bag, minutes, rate):
    """The record, the last diagnostics and the length of the bag [s]."""
    with rosbag.Bag(bag) as data:  # takes its time: before the player runs
        first_stamp, length = data.get_start_time(), data.get_end_time() - data.get_start_time()
    record = []
    with contextlib.ExitStack() as running:
        def start(*words):
            return running.enter_context(quiet(*words)).process

        running.enter_context(start_master())
        rospy.init_node("soak", disable_signals=True)
        diagnostics = Diagnostics()
        rospy.set_param("/use_sim_time", True)
        node = start(program("rio_t", "rio_t_node"), "__name:=rio_t", "_config:=irs")
        wait_for("diagnostics of the node", lambda: "input" in diagnostics.newest)
        # A robot's subscribers: without any, publishing would cost nothing.
        start("rostopic", "hz", "/rio_t/odom", "/rio_t/path")
        player = start(program("rosbag", "play"), "--clock", "--hz=1000", "--quiet", "--wait-for-subscribers",
                       f"--rate={rate}", "__name:=bag_player", bag, "--topics", "/sensor_platform/imu",
                       "/sensor_platform/radar/scan")
        progress = sys.stderr.isatty()
        clock = Clock()
        while player.poll() is None:
            time.sleep(0.5)
            if node.poll() is not None:
                sys.exit(f"soak.py: the node ended, exit status {node.returncode}")
            seconds = clock.seconds - first_stamp
            if clock.seconds == 0.0:
                continue
            record.append(sample(node, diagnostics, seconds))
            if progress:
                print(f"\r{seconds / 60.0:6.1f} of {minutes:g} minutes, {record[-1][1]:.1f} MB", end="", file=sys.stderr)
        if progress:
            print(file=sys.stderr)
        if player.returncode != 0 or not record:
            sys.exit(f"soak.py: the player of the bag ended, exit status {player.returncode}")
        time.sleep(2.0)  # the last diagnostics
        record.append(sample(node, diagnostics, max(record[-1][0] + 1e-3, clock.seconds - first_stamp)))
        return numpy.array(record), diagnostics.newest, length


class Clock:
    """The time that the bag is at."""

    def __init__(self):
        from rosgraph_msgs.msg import Clock as Message
        self.seconds = 0.0
        rospy.Subscriber("/clock", Message, self._keep)

    def _keep(self, message):
        self.seconds = message.clock.to_sec()


def mean_latency(record, begin, end, count, total):
    """[ms] over the part of the record between two shares of the time."""
    last = record[-1, 0]
    inside = record[(record[:, 0] >= begin * last) & (record[:, 0] <= end * last)]
    number = inside[-1, count] - inside[0, count]
    return (inside[-1, total] - inside[0, total]) / number if number > 0 else float("nan")


def draw(record, path):
    minutes = record[:, 0] / 60.0
    figure, (memory, latency) = pyplot.subplots(2, 1, sharex=True, figsize=(9, 6))
    memory.plot(minutes, record[:, 1])
    memory.set_ylabel("resident memory [MB]")
    memory.set_ylim(bottom=0)
    step = max(1, len(record) // 120)
    coarse = record[::step]
    for name, count, total in (("IMU to ~odom", 2, 3), ("scan to optimised state", 4, 5)):
        number = numpy.maximum(1.0, numpy.diff(coarse[:, count]))
        latency.plot(coarse[1:, 0] / 60.0, numpy.diff(coarse[:, total]) / number, label=name)
    latency.set_ylabel("mean latency [ms]")
    latency.set_ylim(bottom=0)
    latency.set_xlabel("time in the data [min]")
    latency.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def judge(record, newest, length, rate):
    """Prints the numbers; true where all hold."""
    passed = True

    def row(name, text, good):
        nonlocal passed
        passed &= good
        print(f"  {name:26s} {text}   " + ("ok" if good else "FAILED"))

    # The player may take the last times with it when it ends: less than a second on the clock of the wall.
    row("played", f"{record[-1, 0] / 60.0:.1f} of {length / 60.0:.1f} minutes", bool(record[-1, 0] >= length - rate))
    after = record[record[:, 0] >= 60.0]
    if len(after) == 0:
        return False
    growth = after[-1, 1] - after[0, 1]
    row("memory", f"{after[0, 1]:.1f} MB after a minute, {after[-1, 1]:.1f} MB at the end, {after[:, 1].max():.1f} MB at most",
        growth <= MEMORY_GROWTH_MB)
    half = record[record[:, 0] >= max(0.5 * record[-1, 0], SLOPE_AFTER)]
    if len(half) > 10:
        slope = 60.0 * numpy.polyfit(half[:, 0], half[:, 1], 1)[0]
        row("its slope, second half", f"{1024.0 * slope:.1f} kB a minute", slope <= MEMORY_SLOPE_MB)
    for name, count, total in (("IMU to ~odom", 2, 3), ("scan to optimised state", 4, 5)):
        early, late = (mean_latency(record, *part, count, total) for part in ((0.25, 0.5), (0.75, 1.0)))
        good = late <= max(LATENCY_DRIFT * early, early + LATENCY_NOISE_MS)
        row(name, f"mean {early:.3f} ms in the second quarter, {late:.3f} ms in the last", bool(good))
    inputs = newest["input"]
    faults = ", ".join(f"{value} {key}" for key, value in sorted(inputs.items()) if key.startswith(("dropped_", "fault_")))
    updates = int(float(newest["solver"]["updates"]))
    row("scans", f"{inputs['scans']} came, {inputs['scans_used']} used, {updates} solves; {faults or 'nothing dropped'}",
        updates > 0.9 * float(inputs["scans"]))
    row("resets", newest["odometry"]["resets"], newest["odometry"]["resets"] == "0")
    return passed


def main():
    os.makedirs(ARGUMENTS.output_dir, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="rio_t_soak_") as folder:
        bag = os.path.join(folder, "soak.bag")
        make_bag(bag, ARGUMENTS.minutes)
        print(f"Playing it at rate {ARGUMENTS.rate:g} ...", flush=True)
        record, newest, length = run(bag, ARGUMENTS.minutes, ARGUMENTS.rate)
    table, figure = (os.path.join(ARGUMENTS.output_dir, name) for name in ("soak.csv", "soak.png"))
    numpy.savetxt(table, record, fmt="%.4f", delimiter=",",
                  header="data_seconds,memory_mb,imu,imu_latency_sum_ms,updates,scan_latency_sum_ms")
    draw(record, figure)
    print(f"{ARGUMENTS.minutes:g} minutes of data at rate {ARGUMENTS.rate:g}")
    passed = judge(record, newest, length, ARGUMENTS.rate)
    print(f"  {table}, {figure}")
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
