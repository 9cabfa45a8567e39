"""Plays a bag to a live node as `rosbag play` does, but waits for the node's answers.

On a slow machine `rosbag play` goes on while the solver falls behind, so the node drops scans and a test that compares
trajectories fails. This player goes on slower instead.
"""
import collections
import struct
import threading
import time

import rosbag
import rospy
from rosgraph_msgs.msg import Clock

from .ros_processes import SLOWNESS, wait_for

PATIENCE = 0.2   # [s] of the bag: the player goes on so far beyond a scan before it waits for the answer
TOLERANCE = 0.1  # [s] between the stamp of a scan and that of its answer, which time offset and triggers correct


def raw_kind(datatype, md5, definition):
    """A message class that publishes the bytes of a bag as they are, with their header.seq."""
    return type("Raw", (rospy.AnyMsg,), {"_type": datatype, "_md5sum": md5, "_full_text": definition,
                                         "_has_header": False})


def header_stamp(data):
    """Header stamp [s] of a serialised message that begins with its header."""
    seconds, nanoseconds = struct.unpack_from("<II", data, 4)
    return seconds + 1e-9 * nanoseconds


class PacedPlayer:
    """Plays from a thread within a `with` block.

    listener: hears the node's answers.
    topics:   names in the bag -> names to publish on.
    answers:  topic of scans in the bag -> topic of the listener that repeats each scan. The player waits from the
              first answer on.
    rate:     at most so many times as fast as it was recorded.
    start, duration: part of the bag [s].
    """

    def __init__(self, listener, bag, topics, answers, rate, start=0.0, duration=float("inf")):
        self._listener, self._bag, self._topics, self._answers = listener, bag, topics, answers
        self._rate, self._start, self._duration = rate / SLOWNESS, start, duration
        self._stopping, self._error = threading.Event(), None
        self._unanswered = {topic: collections.deque() for topic in answers}  # (time in the bag, stamp) of scans
        self._answers_before = {topic: len(listener.messages[answer]) for topic, answer in answers.items()}
        # All without a queue: publishing returns when the sockets have taken the message. A late clock would give a trigger
        # and its scan times of receipt that do not fit.
        self._clock = None
        if rospy.get_param("/use_sim_time", False):
            self._clock = rospy.Publisher("/clock", Clock, queue_size=None)
        self._publishers = {}
        self._thread = threading.Thread(target=self._run)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, kind, *_):
        self.stop()
        if self._error and kind is None:
            raise self._error

    def wait(self):
        """Returns when all is played and answered. Raises what went wrong."""
        self._thread.join()
        if self._error:
            raise self._error

    def stop(self):
        self._stopping.set()
        self._listener.wake()
        self._thread.join()
        for publisher in (*self._publishers.values(), *([self._clock] if self._clock else [])):
            publisher.unregister()

    def _run(self):
        try:
            with rosbag.Bag(self._bag) as bag:
                self._advertise(bag)
                self._play(bag)
        except Exception as error:  # for the thread that waits
            self._error = error

    def _advertise(self, bag):
        for connection in bag._get_connections(list(self._topics)):
            name = self._topics[connection.topic]
            kind = raw_kind(connection.datatype, connection.md5sum, connection.msg_def)
            self._publishers[connection.topic] = rospy.Publisher(name, kind, queue_size=None)
        missing = set(self._topics) - set(self._publishers)
        if missing:
            raise ValueError(f"{self._bag} has no topic {', '.join(sorted(missing))}")
        wait_for("subscribers of " + ", ".join(self._topics.values()), lambda: self._stopping.is_set() or all(
            p.get_num_connections() > 0 for p in self._publishers.values()))

    def _play(self, bag):
        t = begin = bag.get_start_time() + self._start
        wall_begin = time.monotonic()
        for topic, (_, data, _, _, _), record in bag.read_messages(
                list(self._topics), start_time=rospy.Time.from_sec(begin), raw=True):
            t = record.to_sec()
            if t - begin > self._duration:
                break
            self._wait_for_answers(t - PATIENCE)
            self._stopping.wait(wall_begin + (t - begin) / self._rate - time.monotonic())
            if self._stopping.is_set():
                return
            if self._clock:
                self._clock.publish(Clock(record))
            message = self._publishers[topic].data_class()
            message._buff = data
            self._publishers[topic].publish(message)
            if topic in self._answers:
                self._unanswered[topic].append((t, header_stamp(data)))
        self._wait_for_answers(t - PATIENCE)

    def _wait_for_answers(self, until):
        """Returns when each scan that was played before `until` [s, time of the bag] has its answer, or after stop()."""
        for topic, scans in self._unanswered.items():
            answers = self._listener.messages[self._answers[topic]]
            if len(answers) == self._answers_before[topic]:
                continue  # the node may still wait for tf or triggers
            while scans and scans[0][0] < until:
                stamp = scans.popleft()[1]
                self._listener.wait_for(f"answer to the scan {stamp:.3f} of {topic}", lambda: (
                    self._stopping.is_set() or answers[-1].header.stamp.to_sec() > stamp - TOLERANCE))
