#!/usr/bin/env python3
"""The frames of the live node and of the bag runner: base_link, IMU and radar are three bodies, and tf knows them."""
import os
import pathlib
import shutil
import xml.etree.ElementTree

import numpy
import rospy
from geometry_msgs.msg import TransformStamped
from scipy.spatial.transform import Rotation
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rio_t import live_tester as tester
from rio_t import tum

OK, WARN, ERROR = 0, 1, 2
PACKAGE = pathlib.Path(__file__).resolve().parent.parent
CONFIG, EXAMPLES = PACKAGE / "config", PACKAGE / "launch" / "examples"
SAME_M = 1e-3       # from tf or by hand: the same trajectory
LIVE_BOUND_M = 0.05  # as in live_rostest.py
OFFSET_S = 0.03      # of the simulated radar
TOPICS = (tester.IMU, tester.RADAR)


def joints():
    """Pose (translation, Rotation) of each link of the example in base_link."""
    poses = {}
    for joint in xml.etree.ElementTree.parse(EXAMPLES / "robot.urdf").getroot().findall("joint"):
        origin = joint.find("origin")
        numbers = [numpy.array(origin.get(name).split(), dtype=float) for name in ("xyz", "rpy")]
        poses[joint.find("child").get("link")] = numbers[0], Rotation.from_euler("xyz", numbers[1])
    return poses


def transform(parent, child, pose):
    message = TransformStamped()
    message.header.frame_id, message.child_frame_id = parent, child
    for name, value in zip("xyz", pose[0]):
        setattr(message.transform.translation, name, value)
    for name, value in zip("xyzw", pose[1].as_quat()):
        setattr(message.transform.rotation, name, value)
    return message


def listed(message):
    return numpy.array([getattr(message, name) for name in message.__slots__])


def pose_of(message):
    """Position and Rotation of an odometry."""
    return listed(message.pose.pose.position), Rotation.from_quat(listed(message.pose.pose.orientation))


def as_links(topic, message):
    links = {tester.IMU: "imu_link", tester.RADAR: "radar_link"}
    if topic in links:
        message.header.frame_id = links[topic]


class FramesTest(tester.LiveTestCase):
    namespaces = ("/rio_t", "/robot", "/robot_description")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        simulated = tester.simulate(cls.path("simulated.bag"))
        (cls.p_BI, cls.q_BI), (p_BR, q_BR) = joints()["imu_link"], joints()["radar_link"]
        static = TFMessage([transform("base_link", link, pose) for link, pose in joints().items()])
        cls.bag = tester.edited(simulated, cls.path("links.bag"), as_links, [("/tf_static", static)])
        cls.moving_bag = tester.edited(simulated, cls.path("moving.bag"), as_links, [("/tf", static)])
        l_I, q_IR = cls.q_BI.inv().apply(p_BR - cls.p_BI), cls.q_BI.inv() * q_BR
        cls.by_hand = {"extrinsics_translation": l_I.tolist(), "extrinsics_rotation_xyzw": q_IR.as_quat().tolist()}
        cls.run_folder = tester.run_bag(cls.bag, "irs", cls.path("by_hand"),
                                        *(f"{key}={value}" for key, value in cls.by_hand.items()))
        cls.imu_stamps = tester.stamps(cls.bag, tester.IMU)
        cls.scan_stamps = tester.stamps(cls.bag, tester.RADAR)

    def set_by_hand(self):
        """On the parameter server, since the command line of a node takes no lists."""
        for key, value in self.by_hand.items():
            rospy.set_param("/rio_t/" + key, value)

    def worst(self, one, other):
        common = one.keys() & other.keys()
        self.assertGreater(len(common), 40)
        return max(numpy.linalg.norm(one[t] - other[t]) for t in common)

    def play_whole(self, listener, bag=None, topics=TOPICS, rate=2.0):
        with tester.feed(listener, bag or self.bag, topics, rate) as player:
            player.wait()
        stamps = tester.stamps(bag, tester.IMU) if bag else self.imu_stamps
        listener.wait_for_stamp("odom", stamps[-1])
        listener.wait_for_stamp("odom_optimized", stamps[-1] - 4 * 10**8)  # the last scans may wait for more IMU

    def test_bag_runner_takes_the_extrinsics_from_the_tf_of_the_bag(self):
        hand = tum.read(os.path.join(self.run_folder, "trajectory.txt")).positions()
        for bag in (self.bag, self.moving_bag):
            run = tester.run_bag(bag, "irs", self.path("tf"), "extrinsics_source=tf",
                                 "extrinsics_translation=[9, 9, 9]")  # not to be read
            self.assertLess(self.worst(tum.read(os.path.join(run, "trajectory.txt")).positions(), hand), SAME_M)
        outcome = tester.run(tester.program("rio_t", "rio_t_bag"), "--bag", self.bag, "--config", "irs", "--output-dir",
                             self.path("none"), "--set", "extrinsics_source=tf", "--set", "imu_frame=nowhere")
        self.assertEqual(outcome.returncode, 1)
        self.assertIn("no tf from radar_link to nowhere", outcome.stdout)
        self.assertIn("radar_link exists with parent base_link", outcome.stdout)

    def test_urdf_gives_the_trajectory_of_the_numbers_by_hand_and_the_odometry_of_base_link(self):
        words = ("--wait", "rio_t", "urdf_robot.launch")
        with tester.Listener() as listener, tester.Process(shutil.which("roslaunch"), *words) as launch:
            listener.wait_until_heard()
            self.play_whole(listener)  # the publisher of the URDF waits for the clock of the bag
            odom = listener.messages["odom"]
            self.assertEqual({(m.header.frame_id, m.child_frame_id) for m in odom}, {("odom", "base_link")})
            self.assertEqual({m.header.frame_id for m in listener.messages["imu_bias"]}, {"imu_link"})
            self.assertIn("tf from imu_link", listener.value("odometry", "base_extrinsics_from"))
            launch.stop()
        self.check_against_the_imu(odom, LIVE_BOUND_M)
        # odom begins at base_link.
        p, q = pose_of(odom[0])
        self.assertLess(numpy.linalg.norm(p), 0.02)
        self.assertLess(abs(q.as_euler("zyx")[0]), 0.01)
        # The velocity is that of base_link: it gives the way between two poses.
        self.check_velocity(odom)
        # The radar's frame hangs below base_link, with x where the radar looks.
        shown = {t.child_frame_id: t for t in listener.tf_static}["rio_t_radar"]
        self.assertEqual(shown.header.frame_id, "base_link")
        p_BR, q_BR = joints()["radar_link"]
        self.assertLess(numpy.linalg.norm(listed(shown.transform.translation) - p_BR), 1e-6)
        x_B = Rotation.from_quat(listed(shown.transform.rotation)).apply([1.0, 0.0, 0.0])
        self.assertLess(numpy.linalg.norm(x_B - q_BR.apply([0.0, 1.0, 0.0])), 1e-6)

    def check_against_the_imu(self, odom, bound):
        """The odometry of base_link is the bag runner's of the IMU, moved to base_link and to where odom begins."""
        imu = tum.read(os.path.join(self.run_folder, "trajectory.txt"))
        poses = {t: (p, Rotation.from_quat(q)) for t, p, q in zip(imu.stamp.tolist(), imu.position, imu.quaternion)}
        first = poses[min(poses)]
        lever_I = -self.q_BI.inv().apply(self.p_BI)  # from the IMU to base_link
        def base(pose):
            return pose[0] + pose[1].apply(lever_I), pose[1] * self.q_BI.inv()
        p_0, q_0 = base(first)
        yaw = Rotation.from_euler("z", -2.0 * numpy.arctan2(q_0.as_quat()[2], q_0.as_quat()[3]))
        worst, count = 0.0, 0
        for message in odom:
            pose = poses.get(message.header.stamp.to_nsec())
            if pose is None:
                continue
            count += 1
            worst = max(worst, numpy.linalg.norm(pose_of(message)[0] - yaw.apply(base(pose)[0] - p_0)))
        self.assertGreater(count, 1000)
        self.assertLess(worst, bound)

    def check_velocity(self, odom):
        stamps = [m.header.stamp.to_nsec() for m in odom]
        fastest = max(range(len(odom)), key=lambda k: numpy.linalg.norm(listed(odom[k].twist.twist.angular)))
        self.assertGreater(numpy.linalg.norm(listed(odom[fastest].twist.twist.angular)), 0.5)
        worst = []
        for k in range(0, len(odom) - 1):
            (p, q), (p_next, _) = pose_of(odom[k]), pose_of(odom[k + 1])
            dt = 1e-9 * (stamps[k + 1] - stamps[k])
            mean = 0.5 * (listed(odom[k].twist.twist.linear) + listed(odom[k + 1].twist.twist.linear))
            worst.append(numpy.linalg.norm(q.apply(mean) - (p_next - p) / dt))
        # Between two solutions; at a new one the position jumps.
        self.assertLess(numpy.median(worst), 0.03)

    def test_numbers_by_hand_and_tf_give_the_same_optimised_trajectory_live(self):
        trajectories = []
        for name, parameters in (("hand", []), ("tf", ["extrinsics_source:=tf", "base_extrinsics_source:=tf"])):
            if name == "hand":
                self.set_by_hand()
            saved = self.path(name + ".txt")
            with tester.Listener() as listener, tester.node("config:=irs", "trajectory_file:=" + saved, *parameters):
                listener.wait_until_heard()
                publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
                publisher.publish(TFMessage([transform("base_link", link, pose) for link, pose in joints().items()]))
                if name == "tf":
                    tester.wait_for("the node listens to tf", lambda: publisher.get_num_connections() >= 2)
                self.play_whole(listener)
                self.assertTrue(tester.call("/rio_t/save_trajectory").success)
                publisher.unregister()
            poses = tum.read(saved).positions()
            poses.pop(max(poses))  # still in the window: will yet change
            trajectories.append(poses)
            self.setUp()
        self.assertLess(self.worst(*trajectories), SAME_M)

    def test_base_link_is_the_imu_if_no_tf_connects_them_and_the_log_says_so(self):
        self.set_by_hand()
        with tester.Listener() as listener, tester.node("config:=irs"):
            listener.wait_until_heard()
            self.play_whole(listener)
            self.assertEqual({m.child_frame_id for m in listener.messages["odom"]}, {"base_link"})
            self.assertIn("since tf does not have it", listener.value("odometry", "base_extrinsics_from"))
            self.assertEqual(listener.value("odometry", "imu_frame"), "imu_link")

    def test_parameters_place_an_imu_whose_frame_is_base_link(self):
        self.set_by_hand()
        rospy.set_param("/rio_t/base_extrinsics_translation", self.p_BI.tolist())
        rospy.set_param("/rio_t/base_extrinsics_rotation_xyzw", self.q_BI.as_quat().tolist())
        with tester.Listener() as listener, tester.node("config:=irs", "imu_frame:=base_link"):
            listener.wait_until_heard()
            self.play_whole(listener)
            self.assertIn("parameters base_extrinsics_*", listener.value("odometry", "base_extrinsics_from"))
            odom = listener.messages["odom"]
        self.check_against_the_imu(odom, LIVE_BOUND_M)

    def test_odometry_waits_for_a_tf_that_is_demanded(self):
        self.set_by_hand()
        with tester.Listener() as listener, tester.node("config:=irs", "base_extrinsics_source:=tf"):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag) as player:
                listener.wait_for_diagnosis("odometry", "waiting for tf from imu_link to base_link", WARN)
                player.wait()
            self.assertEqual(listener.messages["odom"], [])

    def test_a_bag_played_into_a_namespace_brings_its_tf(self):
        config = pathlib.Path(self.path("tf.yaml"))
        config.write_text((CONFIG / "irs.yaml").read_text() + "\nextrinsics_source: tf\nbase_extrinsics_source: tf\n")
        words = ("--wait", "rio_t", "rio_t.launch", f"config:={config}", "ns:=robot", "bag:=" + self.bag,
                 f"bag_rate:={2.0 / tester.SLOWNESS}")
        with tester.Listener(node="/robot/rio_t") as listener, tester.Process(shutil.which("roslaunch"), *words) as launch:
            listener.wait_for("odometry", lambda: listener.messages["odom"])
            launch.stop()

    def test_who_publishes_which_tf(self):
        cases = {("publish_tf:=false",): (set(), {("base_link", "rio_t_radar")}),
                 ("publish_radar_tf:=false", "invert_tf:=true", "tf_rate:=0"): ({("base_link", "odom")}, set())}
        for parameters, (moving, static) in cases.items():
            with tester.Listener() as listener, tester.node(
                    "config:=irs", "imu_frame:=base_link", "extrinsics_source:=parameters", *parameters):
                listener.wait_until_heard()
                self.play_whole(listener, rate=4.0)
                if moving:
                    last = listener.messages["odom"][-1].header.stamp
                    listener.wait_for("tf of the last odometry", lambda: (
                        listener.tf and listener.tf[-1].header.stamp >= last))
                if static:
                    listener.wait_for("static tf", lambda: listener.tf_static)
                self.assertEqual({(t.header.frame_id, t.child_frame_id) for t in listener.tf}, moving)
                self.assertEqual({(t.header.frame_id, t.child_frame_id) for t in listener.tf_static}, static)
                inverse = {t.header.stamp.to_nsec(): t.transform for t in listener.tf}
                for message in listener.messages["odom"][::100] if inverse else ():
                    t = inverse[message.header.stamp.to_nsec()]
                    p, q = pose_of(message)
                    q_back = Rotation.from_quat(listed(t.rotation))
                    self.assertLess(numpy.linalg.norm(q_back.apply(p) + listed(t.translation)), 1e-9)
                    self.assertLess((q_back * q).magnitude(), 1e-9)
            self.setUp()

    def test_stamps_are_the_times_of_measurement(self):
        """t_O > 0: the stamps are late, and the corrected ones earlier by it."""
        for correct in (True, False):
            with tester.Listener() as listener, tester.node("config:=irs", "imu_frame:=base_link",
                                                            f"correct_stamps:={str(correct).lower()}"):
                listener.wait_until_heard()
                self.play_whole(listener)
                for topic in ("ego_velocity", "points", "inliers"):
                    last = listener.messages[topic][-1].header.stamp.to_nsec()
                    if correct:
                        raw = min(self.scan_stamps, key=lambda stamp: abs(stamp - OFFSET_S * 1e9 - last))
                        self.assertAlmostEqual(1e-9 * (raw - last), listener.messages["time_offset"][-1].offset, delta=0.005)
                        self.assertAlmostEqual(1e-9 * (raw - last), OFFSET_S, delta=0.01)
                    else:
                        self.assertIn(last, self.scan_stamps, topic)
                # The offset's own message pairs with the radar's cloud.
                self.assertLessEqual({m.header.stamp.to_nsec() for m in listener.messages["time_offset"]},
                                     set(self.scan_stamps))
            self.setUp()

    def test_reset_goes_on_from_the_last_pose_or_from_the_origin(self):
        # The same again, one second after its end: for the IMU a gap and no jump of its clock.
        def later(topic, message):
            as_links(topic, message)
            if topic in TOPICS:
                message.header.stamp += rospy.Duration(13)
        again = tester.edited(self.path("simulated.bag"), self.path("later.bag"), later)
        for keeps in (True, False):
            with tester.Listener() as listener, tester.node("config:=irs", "imu_frame:=base_link",
                                                            f"reset_pose:={'keep' if keeps else 'zero'}"):
                listener.wait_until_heard()
                self.play_whole(listener)
                last, sigma = pose_of(listener.messages["odom"][-1]), listener.messages["odom"][-1].pose.covariance[0]
                self.assertGreater(numpy.linalg.norm(last[0]), 0.1)
                passed = len(listener.messages["odom"])
                tester.call("/rio_t/reset", Empty)  # waits for rest, with which the bag begins
                with tester.feed(listener, again):
                    listener.wait_for("odometry after the reset", lambda: len(listener.messages["odom"]) > passed)
                    first = listener.messages["odom"][passed]
                p, q = pose_of(first)
                start = last[0] if keeps else numpy.zeros(3)
                self.assertLess(numpy.linalg.norm(p - start), 0.05, f"keeps {keeps}: {p} after {last[0]}")
                if keeps:
                    # The attitude differs by roll and pitch alone: the platform stands otherwise, and gravity shows it.
                    self.assertLess(abs((q * last[1].inv()).as_quat()[2]), 0.01)
                self.assertEqual(keeps, first.pose.covariance[0] >= sigma, "the doubt about the last pose stays")
                listener.wait_for("what the diagnostics say", lambda: (
                    "reset_pose: " + ("keep" if keeps else "zero")) in (listener.value("odometry", "after_reset") or ""))
            self.setUp()


if __name__ == "__main__":
    import rostest
    rospy.init_node("frames_rostest")
    rospy.set_param("/use_sim_time", True)  # for the nodes started from here on; the tester keeps to the wall clock
    rostest.rosrun("rio_t", "frames_rostest", FramesTest)
