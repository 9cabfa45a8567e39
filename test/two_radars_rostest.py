#!/usr/bin/env python3
"""The live node with two radars and their mountings estimated: against bag runner and truth, and its promises."""
import os
import pathlib
import shutil

import numpy
import rosbag
import rospy
import yaml
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rio_t import live_tester as tester
from rio_t import tum

OK, WARN = 0, 1
NAMES = ("left", "right")
SCANS = {name: f"/sensor_platform/radar_{name}/scan" for name in NAMES}
ANSWERS = {SCANS[name]: name + "/points" for name in NAMES}
TRIGGER = "/sensor_platform/radar_right/trigger"
TRIGGERED = ("right/stamp_source:=trigger", "right/trigger_topic:=" + TRIGGER)  # each radar has its own source
OF_RADAR = {"extrinsics": PoseWithCovarianceStamped,
            **{topic: tester.TOPICS[topic] for topic in ("time_offset", "ego_velocity", "innovation", "points", "inliers")}}
TOPICS = {**{topic: kind for topic, kind in tester.TOPICS.items() if topic not in OF_RADAR},
          **{f"{name}/{topic}": kind for name in NAMES for topic, kind in OF_RADAR.items()}}
CONFIG = pathlib.Path(__file__).resolve().parent.parent / "config" / "two_radars.yaml"
OFFSETS = {"left": 0.03, "right": -0.01}  # [s] true
TURN = numpy.radians([2.0, -2.0, 2.0])    # of the true mountings from those of CONFIG, about the axes of I
LONG = 60                                 # [s] of a bag that no test plays to its end
HONEST = 2.6                              # [sigma] of the truth, at most
OPTIMIZED_BOUND_M = 1e-8                  # as in live_rostest.py


def product(a, b):
    """Of quaternions x y z w."""
    return numpy.append(a[3] * b[:3] + b[3] * a[:3] + numpy.cross(a[:3], b[:3]), a[3] * b[3] - a[:3] @ b[:3])


def turn_between(q, told):
    """Rotation vector [rad] of the small turn about the axes of I that makes q of `told`."""
    turn = product(q, told * [-1, -1, -1, 1])
    return 2.0 * numpy.sign(turn[3]) * turn[:3]


def listed(message):
    return numpy.array([getattr(message, name) for name in message.__slots__])


class TwoRadarsTest(tester.LiveTestCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        config = yaml.safe_load(CONFIG.read_text())
        cls.told = {name: numpy.array(config[name]["extrinsics_rotation_xyzw"]) for name in NAMES}
        angle = numpy.linalg.norm(TURN)
        turn = numpy.append(numpy.sin(0.5 * angle) * TURN / angle, numpy.cos(0.5 * angle))
        cls.levers = {name: config[name]["extrinsics_translation"] for name in NAMES}
        cls.mounting = {}
        for name in NAMES:
            x, y, z, w = product(turn, cls.told[name])
            cls.mounting[name] = (f"extrinsics-translation={','.join(map(str, cls.levers[name]))} "
                                  f"extrinsics-rotation-xyzw={x:.9f},{y:.9f},{z:.9f},{w:.9f}")
        cls.bag = cls.simulate("run")
        # Diagnostics come once a second and judge several seconds. This bag plays on until they have said it.
        cls.long_bag = cls.simulate("long", duration=LONG)
        with rosbag.Bag(cls.bag) as bag:
            cls.scans = {name: [m.header.stamp.to_nsec() for _, m, _ in bag.read_messages([SCANS[name]])]
                         for name in NAMES}
            cls.last_imu = [m.header.stamp.to_nsec() for _, m, _ in bag.read_messages([tester.IMU])][-1]

    @classmethod
    def simulate(cls, bag, right="", duration=14):
        """A wild run with both radars; `right`: more of the right one."""
        path = cls.path(bag + ".bag")
        left = f"left {cls.mounting['left']} time-offset={OFFSETS['left']}"
        right = f"right {cls.mounting['right']} time-offset={OFFSETS['right']} first-trigger=0.08 {right}"
        tester.check(tester.run(tester.program("rio_t", "simulate"), "--motion", "medium", "--seed", 3, "--duration", duration,
                                "--static-start", 5, "--static-end", 1, "--radar", left, "--radar", right, "--out", path))
        return path

    def feed(self, listener, bag, *more, rate=2.0):
        return tester.feed(listener, bag, (tester.IMU, *SCANS.values(), *more), rate, ANSWERS)

    def test_node_equals_bag_runner_and_keeps_the_topic_contract(self):
        saved, run = self.path("saved.txt"), self.path("run")
        tester.check(tester.run(tester.program("rio_t", "rio_t_bag"), "--bag", self.bag, "--config", "two_radars",
                                "--output-dir", run, *(word for each in TRIGGERED for word in ("--set", each.replace(":=", "=")))))
        optimized = tum.read(os.path.join(run, "trajectory_optimized.txt")).positions()
        # By their own stamps the scans are found again.
        parameters = ("config:=two_radars", "trajectory_file:=" + saved, "correct_stamps:=false", *TRIGGERED)
        with tester.Listener(TOPICS) as listener, tester.node(*parameters):
            listener.wait_until_heard()
            # The node takes the scans in the order in which they come. It is that of the bag if no message is late by
            # 0.1 s of data.
            with self.feed(listener, self.bag, TRIGGER, rate=1.0) as player:
                listener.wait_for_diagnosis("input", "IMU and radars are coming", OK)
                player.wait()
            listener.wait_for_stamp("odom", self.last_imu)
            for name in NAMES:
                # The last scans may wait for IMU samples that the bag does not hold.
                for topic in OF_RADAR:
                    listener.wait_for_stamp(f"{name}/{topic}", self.scans[name][-3])
                self.check_topics_of_radar(listener, name)
                self.check_estimates_of_radar(listener, name, os.path.join(run, f"time_offset_{name}.csv"))
            messages = listener.messages["odom_optimized"]
            stamps = [m.header.stamp.to_nsec() for m in messages]
            self.assertEqual(stamps, sorted(stamps))
            live = {m.header.stamp.to_nsec(): listed(m.pose.pose.position) for m in messages}

            self.assertTrue(tester.call("/rio_t/save_trajectory").success)
            kept = tum.read(saved).positions()
            common = sorted((kept.keys() & optimized.keys()) - {max(kept)})  # the newest will yet change
            self.assertGreater(len(common), 120)
            self.assertLess(max(numpy.linalg.norm(kept[t] - optimized[t]) for t in common), OPTIMIZED_BOUND_M)
            self.assertGreater(len(live), 120)

            tester.call("/rio_t/reset", Empty)
            for name in NAMES:
                listener.wait_for_diagnosis("time offset " + name, "not estimated yet", OK)
                listener.wait_for_diagnosis("extrinsics " + name, "not estimated yet", OK)

    def check_topics_of_radar(self, listener, name):
        for topic in ("time_offset", "ego_velocity", "points", "inliers"):
            messages = listener.messages[f"{name}/{topic}"]
            self.assertEqual({m.header.frame_id for m in messages}, {"rio_t_radar_" + name}, topic)
            # Scans of this radar and of no other.
            self.assertLessEqual({m.header.stamp.to_nsec() for m in messages}, set(self.scans[name]), topic)
            self.assertGreater(len(messages), 60, topic)
        poses = {m.header.stamp.to_nsec(): m for m in listener.messages[name + "/extrinsics"]}
        offsets = {m.header.stamp.to_nsec() for m in listener.messages[name + "/time_offset"]}
        self.assertLessEqual(poses.keys() ^ offsets, set(self.scans[name][-2:]))  # these may be on their way
        self.assertEqual({m.header.frame_id for m in poses.values()}, {"base_link"})
        for message in poses.values():
            matrix = numpy.array(message.pose.covariance).reshape(6, 6)
            numpy.testing.assert_array_equal(matrix, matrix.T)
            numpy.testing.assert_array_equal(matrix[:3], numpy.zeros((3, 6)))  # the lever arm is not estimated
            self.assertGreater(numpy.linalg.eigvalsh(matrix[3:, 3:])[0], 0.0)
        # tf follows the estimate.
        said = {t.header.stamp.to_nsec(): t for t in listener.tf if t.child_frame_id == "rio_t_radar_" + name}
        self.assertEqual({t.header.frame_id for t in said.values()}, {"base_link"})
        shown = poses.keys() & said.keys()
        self.assertGreater(len(shown), 0.9 * len(poses))
        for stamp in shown:
            # The frame has x forward, the pose y: a quarter turn about z.
            quarter = numpy.array([0.0, 0.0, numpy.sqrt(0.5), numpy.sqrt(0.5)])
            shown_as = product(listed(poses[stamp].pose.pose.orientation), quarter)
            self.assertLess(min(numpy.linalg.norm(listed(said[stamp].transform.rotation) - sign * shown_as)
                                for sign in (-1.0, 1.0)), 1e-9)
        self.assertGreater(len({t.transform.rotation.x for t in said.values()}), 0.5 * len(said), "it never changes")

    def check_estimates_of_radar(self, listener, name, offsets_of_bag_runner):
        offsets = numpy.genfromtxt(offsets_of_bag_runner, delimiter=",", names=True)
        last = listener.messages[name + "/time_offset"][-1]
        of_bag_runner = offsets[numpy.argmin(abs(offsets["stamp"] - last.header.stamp.to_sec()))]
        self.assertLess(abs(last.offset - of_bag_runner["offset_s"]), 0.1 * last.sigma)
        self.assertLess(abs(last.offset - OFFSETS[name]), HONEST * last.sigma)
        self.assertLess(last.sigma, 0.005)
        pose = listener.messages[name + "/extrinsics"][-1].pose
        sigma = numpy.sqrt(numpy.array(pose.covariance).reshape(6, 6).diagonal()[3:])
        error = turn_between(listed(pose.pose.orientation), self.told[name]) - TURN
        self.assertTrue((abs(error) < HONEST * sigma).all(), f"{name}: {error} with sigmas {sigma}")
        self.assertLess(numpy.linalg.norm(error), 0.5 * numpy.linalg.norm(TURN), name)
        listener.wait_for_diagnosis("extrinsics " + name, "observed by the motion", OK)
        listener.wait_for("the turn in the diagnostics", lambda: numpy.allclose(
            yaml.safe_load(listener.value("extrinsics " + name, "turn_from_configured_deg")),
            numpy.degrees(turn_between(listed(pose.pose.orientation), self.told[name])), atol=0.01))

    def test_mounting_of_a_single_radar_is_told_without_a_name(self):
        rospy.set_param("/rio_t/extrinsics_rotation_xyzw", self.told["left"].tolist())
        rospy.set_param("/rio_t/extrinsics_translation", self.levers["left"])
        parameters = ("config:=irs", "radar_topic:=" + SCANS["left"], "estimate_extrinsics:=rotation")
        topics = {**tester.TOPICS, "extrinsics": PoseWithCovarianceStamped}
        with tester.Listener(topics) as listener, tester.node(*parameters):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag, (tester.IMU, SCANS["left"]), answers={SCANS["left"]: "points"}):
                for topic in topics:
                    enough = 2 if topic == "path" else 20  # the path comes once a second
                    listener.wait_for(topic, lambda topic=topic, enough=enough: len(listener.messages[topic]) > enough)
                listener.wait_for("tf of the radar", lambda: ("base_link", "rio_t_radar") in {
                    (t.header.frame_id, t.child_frame_id) for t in listener.tf})
                listener.wait_for_diagnosis("extrinsics", "")
                listener.wait_for_diagnosis("time offset", "")

    def test_radar_that_falls_silent_is_named(self):
        bag = self.simulate("silent", f"blackout=8,{LONG}", LONG)
        with tester.Listener(TOPICS) as listener, tester.node("config:=two_radars"):
            listener.wait_until_heard()
            with self.feed(listener, bag):
                listener.wait_for_diagnosis("input", "radar right is silent, topic " + SCANS["right"], WARN)
                listener.wait_for_diagnosis("time offset right", "kept: no scan of radar right is used now", OK)
                listener.wait_for_diagnosis("odometry", "running", OK)
                self.assertEqual(listener.value("odometry", "health"), "ok")

    def test_radar_that_contradicts_the_other_is_named(self):
        # This frame does not shake, unlike that of the example: the IMU knows which radar is right.
        parameters = ("config:=two_radars", "right/radar_doppler_sign:=-1", "imu_accel_noise_density:=0.0024")
        with tester.Listener(TOPICS) as listener, tester.node(*parameters):
            listener.wait_until_heard()
            with self.feed(listener, self.long_bag):
                listener.wait_for_diagnosis("input", "scans were used, rejected mostly as innovation", WARN)
                self.assertIn("radar right: ", listener.diagnostics["input"].message)
                self.assertNotIn("radar left", listener.diagnostics["input"].message)

    def test_mounting_that_follows_a_wrong_sign_is_named(self):
        """The IMU of the example is so noisy that the estimate follows the radar with the wrong sign."""
        with tester.Listener(TOPICS) as listener, tester.node("config:=two_radars", "right/radar_doppler_sign:=-1"):
            listener.wait_until_heard()
            with self.feed(listener, self.long_bag):
                listener.wait_for_diagnosis("extrinsics right", "differs from the configured one by more than three sigmas", WARN)
                listener.wait_for("the cause", lambda: "The estimated mounting of radar right is turned" in (
                    listener.value("odometry", "likely_cause_1") or ""))

    def test_radar_with_a_wrong_format_is_named_and_the_other_goes_on(self):
        with tester.Listener(TOPICS) as listener, tester.node("config:=two_radars", "right/radar_format:=ti_mmwave"):
            listener.wait_until_heard()
            with self.feed(listener, self.long_bag):
                listener.wait_for("scans that cannot be read", lambda: int(
                    listener.value("input", "right/dropped_cloud_not_usable") or 0) > 10)
                self.assertIsNone(listener.value("input", "left/dropped_cloud_not_usable"))
                listener.wait_for("the cause", lambda: "scans of radar right cannot be read. Set right/radar_format" in (
                    listener.value("odometry", "likely_cause_1") or ""))
                listener.wait_for_diagnosis("odometry", "running", OK)

    def test_a_radar_whose_mounting_tf_does_not_know_does_not_hold_up_the_other(self):
        parameters = ("config:=two_radars", "extrinsics_source:=tf", "imu_jump_patience:=0.01")
        publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=2, latch=True)
        transforms = []
        for name in NAMES:
            transform = TransformStamped()
            transform.header.frame_id, transform.child_frame_id = "base_link", "radar_" + name
            for key, value in zip("xyzw", self.told[name]):
                setattr(transform.transform.rotation, key, value)
            translation = transform.transform.translation
            translation.x, translation.y, translation.z = self.levers[name]
            transforms.append(transform)
        with tester.Listener(TOPICS) as listener, tester.node(*parameters):
            listener.wait_until_heard()
            publisher.publish(TFMessage(transforms[:1]))
            with self.feed(listener, self.long_bag):
                listener.wait_for("odometry by the left radar", lambda: listener.messages["left/innovation"])
                self.assertEqual(listener.messages["right/innovation"], [])
                publisher.publish(TFMessage(transforms))
                listener.wait_for("odometry by both", lambda: listener.messages["right/innovation"])
        publisher.unregister()

    def test_two_radars_that_a_remapping_puts_on_one_topic_are_refused(self):
        outcome = tester.run(tester.program("rio_t", "rio_t_node"), "__name:=rio_t", "_config:=two_radars",
                             f"{SCANS['left']}:={SCANS['right']}")
        self.assertEqual(outcome.returncode, 1, outcome.stdout)
        self.assertIn("right/radar_topic: expected another than that of left", outcome.stdout)
        self.assertIn(f'"{SCANS["right"]}" for both', outcome.stdout)

    def test_launch_file_shows_two_radars(self):
        bag = self.path("pair.bag")
        tester.check(tester.run(tester.program("rio_t", "simulate"), "--preset", "kart_pair", "--duration", 12, "--out", bag))
        words = ("--wait", "rio_t", "two_radars.launch", "bag:=" + bag, f"bag_rate:={4.0 / tester.SLOWNESS}")
        with tester.Listener(TOPICS) as listener, tester.Process(shutil.which("roslaunch"), *words) as launch:
            for topic in ("odom", "left/time_offset", "right/time_offset", "left/extrinsics", "right/extrinsics"):
                listener.wait_for(topic, lambda topic=topic: len(listener.messages[topic]) > 20)
            launch.stop()


if __name__ == "__main__":
    import rostest
    rospy.init_node("two_radars_rostest")
    rospy.set_param("/use_sim_time", True)  # for the nodes started from here on; the tester keeps to the wall clock
    rostest.rosrun("rio_t", "two_radars_rostest", TwoRadarsTest)
