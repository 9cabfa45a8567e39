"""Starts the live node or nodelet, plays bags to it and collects what it says. Waits on conditions, with deadlines."""
import os
import signal
import subprocess
import threading
import time

import numpy
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from roslib.packages import find_node
from sensor_msgs.msg import PointCloud2
from tf2_msgs.msg import TFMessage

from rio_t.msg import ImuBias, TimeOffset

SLOWNESS = float(os.environ.get("RIO_T_TEST_SLOWNESS", "1"))  # of the programs as built: sanitizers take time
DEADLINE = 40.0 * SLOWNESS  # [s] for anything; far more than needed, so that only a fault reaches it
# A library that programs of others need first, before they can load ours: the runtime of a sanitizer.
PRELOAD = os.environ.get("RIO_T_TEST_PRELOAD", "")
IMU, RADAR = "/sensor_platform/imu", "/sensor_platform/radar/scan"
TOPICS = {"odom": Odometry, "odom_optimized": Odometry, "time_offset": TimeOffset, "imu_bias": ImuBias, "path": Path,
          "ego_velocity": TwistWithCovarianceStamped, "inliers": PointCloud2, "points": PointCloud2}


def program(package, name):
    return find_node(package, name)[0]


def preloaded():
    """Words that start another's program which will load our nodelet."""
    return ["env", "LD_PRELOAD=" + PRELOAD] if PRELOAD else []


def run(*words):
    return subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=DEADLINE, check=False)


def read_tum(path):
    """{stamp in ns: [x y z qx qy qz qw]}, the stamps exact."""
    poses = {}
    with open(path) as lines:
        for line in lines:
            if line.strip() and not line.startswith("#"):
                seconds, *numbers = line.split()
                whole, _, part = seconds.partition(".")
                poses[int(whole) * 10**9 + int(part.ljust(9, "0")[:9])] = numpy.array([float(x) for x in numbers])
    return poses


class Process:
    """A process that ends with the `with` block, and is asked to before it is made to."""

    def __init__(self, *words, **options):
        self.process = subprocess.Popen([str(word) for word in words], start_new_session=True, **options)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def wait(self):
        return self.process.wait(DEADLINE)

    def stop(self):
        """Exit status after an interrupt; raises where it does not end."""
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGINT)
        try:
            return self.process.wait(DEADLINE)
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGKILL)
            raise


class Listener:
    """Keeps every message of the node called rio_t."""

    def __init__(self):
        self._changed = threading.Condition()
        self.messages = {name: [] for name in TOPICS}
        self.tf, self.diagnostics = [], {}
        self._subscribers = [rospy.Subscriber("/rio_t/" + name, kind, self._keep, name, buff_size=2**24,
                                              tcp_nodelay=True) for name, kind in TOPICS.items()]
        self._subscribers.append(rospy.Subscriber("/tf", TFMessage, self._keep_tf, buff_size=2**24))
        self._subscribers.append(rospy.Subscriber("/diagnostics", DiagnosticArray, self._keep_diagnostics))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for subscriber in self._subscribers:
            subscriber.unregister()

    def _keep(self, message, name):
        with self._changed:
            self.messages[name].append(message)
            self._changed.notify_all()

    def _keep_tf(self, message):
        with self._changed:
            self.tf.extend(message.transforms)

    def _keep_diagnostics(self, message):
        with self._changed:
            for status in message.status:
                self.diagnostics[status.name.split(": ")[-1]] = status
            self._changed.notify_all()

    def wait_for(self, what, condition):
        """Waits until `condition()` holds; fails, naming `what`, at the deadline."""
        with self._changed:
            if not self._changed.wait_for(condition, DEADLINE):
                told = {name: (status.message, {v.key: v.value for v in status.values})
                        for name, status in self.diagnostics.items()}
                raise AssertionError(f"in {DEADLINE} s not seen: {what}; diagnostics: {told}")

    def wait_for_stamp(self, topic, stamp_ns):
        self.wait_for(f"{topic} of stamp {stamp_ns}",
                      lambda: self.messages[topic] and self.messages[topic][-1].header.stamp.to_nsec() >= stamp_ns)

    def wait_for_diagnosis(self, name, text, level=None):
        def seen():
            status = self.diagnostics.get(name)
            return status is not None and text in status.message and level in (None, status.level)
        self.wait_for(f"diagnosis {name!r} with {text!r}", seen)

    def value(self, name, key):
        status = self.diagnostics.get(name)
        return next((v.value for v in status.values if v.key == key), None) if status else None

    def wait_until_heard(self):
        """All publishers of the node are connected to us: nothing will be missed."""
        names = ["/rio_t/" + name for name in TOPICS]
        deadline = time.monotonic() + DEADLINE
        while not all(s.get_num_connections() > 0 for s in self._subscribers if s.resolved_name in names):
            if time.monotonic() > deadline:
                raise AssertionError("the node did not advertise all of " + " ".join(names))
            time.sleep(0.01)  # rospy tells no one of new connections


def node(*parameters):
    """rio_t_node with private parameters given as "key:=value"."""
    return Process(program("rio_t", "rio_t_node"), "__name:=rio_t", *("_" + each for each in parameters))


def play(bag, topics=(IMU, RADAR), rate=2.0, *more):
    """rosbag play, which starts when each of the topics has its subscriber."""
    return Process(program("rosbag", "play"), "--clock", "--hz=1000", "--quiet", "--wait-for-subscribers",
                   f"--rate={rate / SLOWNESS}", *more, bag, "--topics", *topics, stdin=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL)
