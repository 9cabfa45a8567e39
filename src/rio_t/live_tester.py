"""Starts the live node or nodelet, plays bags to it and collects its messages. Waits on conditions, with deadlines."""
import os
import shutil
import subprocess
import tempfile
import threading
import unittest

import rosbag
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from . import programs
from .msg import ImuBias, TimeOffset
from .paced_player import PacedPlayer
from .ros_processes import DEADLINE, SLOWNESS, Process, program, wait_for

# The runtime of a sanitizer. Programs of others must load it before our library.
PRELOAD = os.environ.get("RIO_T_TEST_PRELOAD", "")
IMU, RADAR = "/sensor_platform/imu", "/sensor_platform/radar/scan"
# The messages that rosbag play keeps for a late subscriber. The default is 100, which is an eighth of a second of IMU.
QUEUE = "--queue=20000"
ANSWERS = {RADAR: "points"}  # the topic that repeats each scan, once the solver has taken or rejected it
TOPICS = {"odom": Odometry, "odom_optimized": Odometry, "time_offset": TimeOffset, "imu_bias": ImuBias, "path": Path,
          "ego_velocity": TwistWithCovarianceStamped, "innovation": TwistWithCovarianceStamped,
          "inliers": PointCloud2, "points": PointCloud2}


def preloaded():
    """Words before a program of others that loads our nodelet."""
    return ["env", "LD_PRELOAD=" + PRELOAD] if PRELOAD else []


def run(*words):
    """The completed process; its stdout holds stderr too."""
    return programs.run(*words, stderr=subprocess.STDOUT, timeout=DEADLINE)


class LiveTestCase(unittest.TestCase):
    """Has a folder of its own, and each test begins without what others left on the parameter server."""
    namespaces = ("/rio_t",)  # of the parameters of its nodes

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="rio_t_live_")

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    def setUp(self):
        for name in self.namespaces:
            if rospy.has_param(name):
                rospy.delete_param(name)


class Listener:
    """Keeps every message of a node. `topics`: names and kinds, TOPICS are those of one radar."""

    def __init__(self, topics=None, node="/rio_t"):
        self._changed = threading.Condition()
        topics = topics or TOPICS
        self.messages = {name: [] for name in topics}
        self.tf, self.tf_static, self.diagnostics = [], [], {}
        self.node = node
        self._subscribers = [rospy.Subscriber(f"{node}/{name}", kind, self._keep, name, buff_size=2**24,
                                              tcp_nodelay=True) for name, kind in topics.items()]
        self._subscribers.append(rospy.Subscriber("/tf", TFMessage, self._keep_tf, self.tf, buff_size=2**24))
        self._subscribers.append(rospy.Subscriber("/tf_static", TFMessage, self._keep_tf, self.tf_static))
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

    def _keep_tf(self, message, kept):
        with self._changed:
            kept.extend(message.transforms)
            self._changed.notify_all()

    def _keep_diagnostics(self, message):
        with self._changed:
            for status in message.status:
                self.diagnostics[status.name.split(": ")[-1]] = status
            self._changed.notify_all()

    def wake(self):
        """Lets all who wait check their conditions again."""
        with self._changed:
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
        """Waits until all publishers of the node are connected, so that no message is missed."""
        names = [f"{self.node}/{name}" for name in self.messages]
        wait_for("subscribers of all of " + " ".join(names),  # rospy tells no one of new connections
                 lambda: all(s.get_num_connections() > 0 for s in self._subscribers if s.resolved_name in names))


def check(outcome):
    """Raises AssertionError with the output of a program if it failed."""
    if outcome.returncode != 0:
        raise AssertionError(f"{outcome.args}: {outcome.stdout}")


def call(service, kind=Trigger):
    """The answer of a service, once it is there."""
    rospy.wait_for_service(service, DEADLINE)
    return rospy.ServiceProxy(service, kind)()


def node(*parameters, remap=(), **options):
    """rio_t_node with private parameters given as "key:=value". `remap`: more words, as "__ns:=/robot". It must end well."""
    return Process(program("rio_t", "rio_t_node"), "__name:=rio_t", *("_" + each for each in parameters), *remap, clean=True,
                   **options)


def simulate(out, *words, static_start=4, duration=12):
    """A short wild run at `out`, which is returned; at rest at both ends, so that it starts and ends sharply."""
    check(run(program("rio_t", "simulate"), "--motion", "medium", "--seed", 3, "--duration", duration, "--static-start",
              static_start, "--static-end", 1, "--time-offset", 0.03, *words, "--out", out))
    return out


def run_bag(bag, config, out, *settings):
    """The folder with the files of the bag runner; `settings` are "key=value"."""
    check(run(program("rio_t", "rio_t_bag"), "--bag", bag, "--config", config, "--output-dir", out,
              *(word for each in settings for word in ("--set", each))))
    return out


def stamps(bag, topic):
    """Header stamps [ns] of the messages of a topic."""
    with rosbag.Bag(bag) as messages:
        return [m.header.stamp.to_nsec() for _, m, _ in messages.read_messages([topic])]


def edited(bag, out, edit, first=()):
    """A copy of a bag at `out`. `edit(topic, message)` changes each message; `first`: (topic, message) before all."""
    with rosbag.Bag(bag) as source, rosbag.Bag(out, "w") as copy:
        for topic, message, time in source.read_messages():
            for each_topic, each in first:
                copy.write(each_topic, each, time)
            first = ()
            edit(topic, message)
            copy.write(topic, message, time)
    return out


def feed(listener, bag, topics=(IMU, RADAR), rate=2.0, answers=ANSWERS, **part):
    """A PacedPlayer of `topics`: names, or {name in the bag: name to publish on}. No scan is lost on a slow machine."""
    names = topics if isinstance(topics, dict) else {topic: topic for topic in topics}
    return PacedPlayer(listener, bag, names, {k: v for k, v in answers.items() if k in names}, rate, **part)


def play(bag, topics=(IMU, RADAR), rate=2.0, *more):
    """rosbag play, which starts when each of the topics has its subscriber. On a slow machine the node may drop scans."""
    clock = ("--clock", "--hz=1000") if rospy.get_param("/use_sim_time", False) else ()
    return Process(program("rosbag", "play"), *clock, "--quiet", QUEUE, "--wait-for-subscribers",
                   f"--rate={rate / SLOWNESS}", *more, bag, "--topics", *topics, stdin=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL)
