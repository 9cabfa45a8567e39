"""Starts the live node or nodelet, plays bags to it and collects what it says. Waits on conditions, with deadlines."""
import os
import subprocess
import threading

import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage

from . import programs
from .msg import ImuBias, TimeOffset
from .ros_processes import DEADLINE, SLOWNESS, Process, program, wait_for

# A library that programs of others need first, before they can load ours: the runtime of a sanitizer.
PRELOAD = os.environ.get("RIO_T_TEST_PRELOAD", "")
IMU, RADAR = "/sensor_platform/imu", "/sensor_platform/radar/scan"
# The messages that rosbag play keeps for a late subscriber. The default is 100, which is an eighth of a second of IMU.
QUEUE = "--queue=20000"
TOPICS = {"odom": Odometry, "odom_optimized": Odometry, "time_offset": TimeOffset, "imu_bias": ImuBias, "path": Path,
          "ego_velocity": TwistWithCovarianceStamped, "inliers": PointCloud2, "points": PointCloud2}


def preloaded():
    """Words that start another's program which will load our nodelet."""
    return ["env", "LD_PRELOAD=" + PRELOAD] if PRELOAD else []


def run(*words):
    """The completed process; its stdout holds stderr too."""
    return programs.run(*words, stderr=subprocess.STDOUT, timeout=DEADLINE)


class Listener:
    """Keeps every message of the node called rio_t. `topics`: names and kinds, TOPICS are those of one radar."""

    def __init__(self, topics=None):
        self._changed = threading.Condition()
        topics = topics or TOPICS
        self.messages = {name: [] for name in topics}
        self.tf, self.diagnostics = [], {}
        self._subscribers = [rospy.Subscriber("/rio_t/" + name, kind, self._keep, name, buff_size=2**24,
                                              tcp_nodelay=True) for name, kind in topics.items()]
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
        names = ["/rio_t/" + name for name in self.messages]
        wait_for("subscribers of all of " + " ".join(names),  # rospy tells no one of new connections
                 lambda: all(s.get_num_connections() > 0 for s in self._subscribers if s.resolved_name in names))


def check(outcome):
    """Raises what a program said if it failed."""
    if outcome.returncode != 0:
        raise AssertionError(f"{outcome.args}: {outcome.stdout}")


def call(service, kind=Trigger):
    """The answer of a service, once it is there."""
    rospy.wait_for_service(service, DEADLINE)
    return rospy.ServiceProxy(service, kind)()


def node(*parameters):
    """rio_t_node with private parameters given as "key:=value"."""
    return Process(program("rio_t", "rio_t_node"), "__name:=rio_t", *("_" + each for each in parameters))


def play(bag, topics=(IMU, RADAR), rate=2.0, *more):
    """rosbag play, which starts when each of the topics has its subscriber."""
    return Process(program("rosbag", "play"), "--clock", "--hz=1000", "--quiet", QUEUE, "--wait-for-subscribers",
                   f"--rate={rate / SLOWNESS}", *more, bag, "--topics", *topics, stdin=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL)
