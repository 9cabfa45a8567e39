#!/usr/bin/env python3
"""Latency of the live node on this machine: plays a bag at its own rate, records what goes in and what comes out.

usage: bench/live_latency.py BAG [CONFIG]     (CONFIG: irs, or a file with stamp_source: header; sourced workspace)
"""
import os
import signal
import subprocess
import sys
import tempfile
import time

import numpy
import rosbag
import rospy
from roslib.packages import find_node

IN_OUT = [("IMU message to odometry", "/sensor_platform/imu", "/rio_t/odom"),
          ("scan to optimised state", "/sensor_platform/radar/scan", "/rio_t/time_offset")]


def start(*words):
    return subprocess.Popen(words, start_new_session=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)


def stop(process):
    os.killpg(process.pid, signal.SIGINT)
    process.wait()


def main(bag, config="irs"):
    folder = tempfile.mkdtemp(prefix="rio_t_latency_")
    recorded = os.path.join(folder, "recorded.bag")
    topics = [topic for _, *pair in IN_OUT for topic in pair]
    core = start("roscore", "-p", os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1].strip("/"))
    processes = [core]
    try:
        while True:
            try:
                rospy.get_master().getPid()
                break
            except OSError:
                time.sleep(0.1)
        node = start(find_node("rio_t", "rio_t_node")[0], "__name:=rio_t", "_config:=" + config)
        recorder = start(find_node("rosbag", "record")[0], "--tcpnodelay", "-O", recorded, *topics)
        processes += [node, recorder]
        # Three seconds for the recorder to find every topic.
        player = start(find_node("rosbag", "play")[0], "--quiet", "--delay=3", bag, "--topics", *topics[::2])
        processes.append(player)
        player.wait()
        processes.remove(player)
    finally:
        for process in reversed(processes):
            stop(process)
    arrival = {topic: {} for topic in topics}
    with rosbag.Bag(recorded) as recording:
        for topic, message, received in recording.read_messages(topics):
            arrival[topic][message.header.stamp.to_nsec()] = received.to_sec()
    for name, source, result in IN_OUT:
        common = sorted(arrival[source].keys() & arrival[result].keys())
        ms = [1e3 * (arrival[result][stamp] - arrival[source][stamp]) for stamp in common]
        median, most = numpy.percentile(ms, [50, 99])
        print(f"{name}: {len(ms)} messages, median {median:.2f} ms, 99 % below {most:.2f} ms, worst {max(ms):.2f} ms")
    print(f"recording: {recorded}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(*sys.argv[1:])
