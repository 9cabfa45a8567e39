#!/usr/bin/env python3
"""The live node and nodelet against the bag runner, and each of their promises, on a simulated bag."""
import os
import shutil

import numpy
import rosbag
import rospy
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rio_t import live_tester as tester
from rio_t import tum

OK, WARN, ERROR = 0, 1, 2
OPTIMIZED_BOUND_M = 1e-8  # the same numbers, to the last digit of the files
# The anchor of a live pose may come some IMU samples later than in the bag runner.
LIVE_BOUND_M = 0.05


class LiveTest(tester.LiveTestCase):
    namespaces = ("/rio_t", "/rio_t_2")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.bag = cls.path("run.bag")
        tester.check(tester.run(tester.program("rio_t", "simulate"), "--motion", "medium", "--seed", 3, "--duration", 14,
                                "--static-start", 5, "--static-end", 1, "--time-offset", 0.03, "--out", cls.bag))
        output = cls.path("run")
        tester.check(tester.run(tester.program("rio_t", "rio_t_bag"), "--bag", cls.bag, "--config", "irs", "--output-dir",
                                output))
        cls.live = tum.read(os.path.join(output, "trajectory.txt")).positions()
        cls.optimized = tum.read(os.path.join(output, "trajectory_optimized.txt")).positions()
        cls.saved = cls.path("saved.txt")
        with rosbag.Bag(cls.bag) as bag:
            cls.imu_stamps = [m.header.stamp.to_nsec() for _, m, _ in bag.read_messages([tester.IMU])]
            cls.scan_stamps = [m.header.stamp.to_nsec() for _, m, _ in bag.read_messages([tester.RADAR])]

    def whole_bag(self, listener, *topics):
        """Plays the bag, by default IMU and radar, and waits for the last odometry."""
        with tester.feed(listener, self.bag, topics or (tester.IMU, tester.RADAR)) as player:
            player.wait()
        listener.wait_for_stamp("odom", self.imu_stamps[-1])
        # The last scan may wait for IMU samples that the bag does not hold.
        listener.wait_for_stamp("odom_optimized", self.scan_stamps[-3])

    def compare_live(self, listener, least=0.99):
        odom = {m.header.stamp.to_nsec(): m.pose.pose.position for m in listener.messages["odom"]}
        common = sorted(odom.keys() & self.live.keys())
        # When the first state is there is up to the machine; from then on no sample may be missing.
        expected = [t for t in self.live if t >= min(odom)]
        self.assertGreater(len(expected), 0.5 * len(self.live))
        self.assertGreater(len(common), least * len(expected))
        worst = max(numpy.linalg.norm(self.live[t] - [odom[t].x, odom[t].y, odom[t].z]) for t in common)
        self.assertLess(worst, LIVE_BOUND_M)

    def compare_with_bag_runner(self, listener):
        self.compare_live(listener)
        response = tester.call("/rio_t/save_trajectory")
        self.assertTrue(response.success, response.message)
        saved = tum.read(self.saved).positions()
        newest = max(saved)  # still in the window: will yet change
        common = sorted((saved.keys() & self.optimized.keys()) - {newest})
        self.assertGreater(len(common), 60)
        worst = max(numpy.linalg.norm(saved[t] - self.optimized[t]) for t in common)
        self.assertLess(worst, OPTIMIZED_BOUND_M)

    def test_node_equals_bag_runner_and_keeps_the_topic_contract(self):
        with tester.Listener() as listener, tester.node("config:=irs", "trajectory_file:=" + self.saved):
            listener.wait_until_heard()
            self.whole_bag(listener)
            self.compare_with_bag_runner(listener)
            messages = listener.messages

            # One odometry for each IMU sample from the first on; each optimised state, in order.
            odom_stamps = [m.header.stamp.to_nsec() for m in messages["odom"]]
            first = self.imu_stamps.index(odom_stamps[0])
            self.assertEqual(odom_stamps, self.imu_stamps[first:])
            for name in ("odom_optimized", "time_offset", "ego_velocity"):
                stamps = [m.header.stamp.to_nsec() for m in messages[name]]
                self.assertEqual(stamps, sorted(set(stamps)), name)
                self.assertGreater(len(stamps), 60, name)

            for message in messages["odom"][::50] + messages["odom_optimized"]:
                self.assertEqual((message.header.frame_id, message.child_frame_id), ("odom", "base_link"))
                for covariance in (message.pose.covariance, message.twist.covariance):
                    matrix = numpy.array(covariance).reshape(6, 6)
                    numpy.testing.assert_array_equal(matrix, matrix.T)
                    self.assertGreater(numpy.linalg.eigvalsh(matrix)[0], 0.0)
            for name in ("ego_velocity", "inliers", "points"):
                self.assertEqual({m.header.frame_id for m in messages[name]}, {"rio_t_radar"}, name)
            self.assertEqual({m.header.frame_id for m in messages["imu_bias"]}, {"base_link"})
            self.assertEqual(messages["path"][-1].header.frame_id, "odom")
            points = {m.header.stamp.to_nsec(): m.width for m in messages["points"]}
            for message in messages["inliers"]:
                self.assertLessEqual(message.width, points[message.header.stamp.to_nsec()])
            self.assertTrue(all(m.sigma > 0.0 for m in messages["time_offset"]))
            self.assertEqual({m.observable for m in messages["time_offset"]}, {False, True})  # rest and motion
            last = messages["time_offset"][-1]
            self.assertLess(abs(last.offset - 0.03), 4.0 * last.sigma)

            # tf says what the odometry says.
            said = {t.header.stamp.to_nsec(): t for t in listener.tf}
            self.assertEqual({(t.header.frame_id, t.child_frame_id) for t in listener.tf}, {("odom", "base_link")})
            shown = [m for m in messages["odom"] if m.header.stamp.to_nsec() in said]
            periods = {stamp * 50 // 10**9 for stamp in odom_stamps}  # of tf_rate
            self.assertGreater(len(shown), 0.9 * len(periods))
            self.assertLessEqual(len(said), len(periods))
            for message in shown[::10]:
                pose, transform = message.pose.pose, said[message.header.stamp.to_nsec()].transform
                for told, shown_as, names in ((pose.position, transform.translation, "xyz"),
                                              (pose.orientation, transform.rotation, "xyzw")):
                    for name in names:
                        self.assertEqual(getattr(told, name), getattr(shown_as, name))
            listener.wait_for_diagnosis("odometry", "running", OK)
            listener.wait_for("no scan was lost", lambda: listener.value("input", "scans") == str(len(self.scan_stamps)))
            self.assertIsNone(listener.value("input", "dropped_queue_full"))

    def test_nodelet_equals_bag_runner_also_when_loaded_again_after_unloading_while_busy(self):
        nodelet = tester.program("nodelet", "nodelet")
        def load():
            return tester.Process(nodelet, "load", "rio_t/RioTNodelet", "manager", "__name:=rio_t", "_config:=irs",
                                  "_trajectory_file:=" + self.saved)
        with tester.Process(*tester.preloaded(), nodelet, "manager", "__name:=manager") as manager:
            with tester.Listener() as listener, load() as loader:
                listener.wait_until_heard()
                with tester.feed(listener, self.bag):
                    listener.wait_for("odometry", lambda: len(listener.messages["odom_optimized"]) > 10)
                    loader.stop()  # unloads, while the bag plays on
                self.assertIsNone(manager.process.poll(), "the manager died")
            with tester.Listener() as listener, load():
                listener.wait_until_heard()
                self.whole_bag(listener)
                self.compare_with_bag_runner(listener)
            self.assertIsNone(manager.process.poll(), "the manager died")

    def test_reset_starts_again(self):
        topics = {**tester.TOPICS, "map": PointCloud2}
        with tester.Listener(topics) as listener, tester.node("config:=irs", "landmarks:=true"):
            listener.wait_until_heard()
            # No more than the rest at the start: long enough to initialise. After the reset nothing comes that could
            # start it again before we look.
            with tester.feed(listener, self.bag, duration=4.5) as player:
                player.wait()
            listener.wait_for("odometry", lambda: listener.messages["odom"])
            listener.wait_for_diagnosis("odometry", "running", OK)
            tester.call("/rio_t/reset", Empty)
            listener.wait_for("the reset", lambda: listener.value("odometry", "resets") == "1")
            self.assertEqual(listener.diagnostics["odometry"].level, WARN)
            self.assertIn("initialising", listener.diagnostics["odometry"].message)
            self.assertEqual(listener.value("odometry", "last_reset_because"), "asked for by ~reset")
            self.assertIn("reset_pose: keep", listener.value("odometry", "after_reset"))
            heard, maps = len(listener.messages["odom"]), len(listener.messages["map"])
            with tester.feed(listener, self.bag, start=0.5, duration=4.5):
                listener.wait_for("odometry again", lambda: len(listener.messages["odom"]) > heard)
                listener.wait_for("an empty map in place of the old one, which is latched", lambda: any(
                    m.width == 0 and m.header.stamp.is_zero() for m in listener.messages["map"][maps:]))

    def test_an_odd_stamp_resets_nothing(self):
        """One scan is stamped so early that the stamp minus the offset, its time of measurement, is below zero."""
        odd = self.scan_stamps[80]

        def edit(topic, message):
            if topic == tester.RADAR and message.header.stamp.to_nsec() == odd:
                message.header.stamp = rospy.Time(0, 1000)
        bag = tester.edited(self.bag, self.path("odd.bag"), edit)
        with tester.Listener() as listener, tester.node("config:=irs"):
            listener.wait_until_heard()
            with tester.feed(listener, bag, answers={}) as player:
                player.wait()
            listener.wait_for_stamp("odom_optimized", self.scan_stamps[-3])
            listener.wait_for("a diagnosis after the last sample", lambda: int(
                listener.value("input", "imu_messages") or 0) == len(self.imu_stamps))
            self.assertEqual(listener.value("odometry", "resets"), "0")

    def test_a_gap_of_samples_that_are_not_finite_resets_node_and_estimator_at_once(self):
        first, last = (self.imu_stamps[0] + int(s * 1e9) for s in (7.0, 9.0))

        def edit(topic, message):
            if topic == tester.IMU and first <= message.header.stamp.to_nsec() <= last:
                message.linear_acceleration.x = float("nan")
        bag = tester.edited(self.bag, self.path("not_finite.bag"), edit)
        with tester.Listener() as listener, tester.node("config:=irs", "max_bridged_imu_gap:=1.0", "imu_jump_patience:=0.1"):
            listener.wait_until_heard()
            with tester.feed(listener, bag, answers={}) as player:
                player.wait()
            listener.wait_for("a diagnosis after the last sample", lambda: int(
                listener.value("input", "imu_messages") or 0) == len(self.imu_stamps))
            self.assertEqual(listener.value("odometry", "resets"), "1")
            because = listener.value("odometry", "last_reset_because")
            self.assertIn("that can be used came for 2.", because)
            self.assertIn("were not finite", because)
            self.assertIsNone(listener.value("input", "fault_imu_clock_restart"), "the session is a new one")

    def test_looping_bag_resets_and_runs_again(self):
        with tester.Listener() as listener, tester.node("config:=irs"):
            listener.wait_until_heard()
            with tester.play(self.bag, (tester.IMU, tester.RADAR), 4.0, "--loop"):
                listener.wait_for_stamp("odom", self.imu_stamps[-1])
                passed = len(listener.messages["odom"])
                listener.wait_for("odometry of the second time round",
                                  lambda: len(listener.messages["odom"]) > passed + 500)
                again = [m.header.stamp.to_nsec() for m in listener.messages["odom"][passed:passed + 500]]
                self.assertLess(again[0], self.imu_stamps[-1])
                self.assertEqual(again, sorted(again))
                # It stays said for as long as the node lives.
                listener.wait_for("the reason", lambda: "jumped back" in (
                    listener.value("odometry", "last_reset_because") or ""))

    def test_absent_trigger_is_told(self):
        with tester.Listener() as listener, tester.node("config:=irs", "stamp_source:=trigger"):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag):
                listener.wait_for_diagnosis("input", "no trigger yet on", ERROR)
                listener.wait_for("scans given up",
                                  lambda: int(listener.value("input", "dropped_trigger_missing") or 0) > 10)

    def test_trigger_stamps(self):
        with tester.Listener() as listener, tester.node("config:=irs", "stamp_source:=trigger",
                                                        "trajectory_file:=" + self.saved):
            listener.wait_until_heard()
            self.whole_bag(listener, tester.IMU, tester.RADAR, "/sensor_platform/radar/trigger")
            self.compare_with_bag_runner(listener)  # in this bag headers and triggers have the same stamps

    def test_extrinsics_from_tf(self):
        # Of config/irs.yaml, as the transform from the cloud's frame to base_link.
        with rosbag.Bag(self.bag) as bag:
            cloud_frame = next(m for _, m, _ in bag.read_messages([tester.RADAR])).header.frame_id
        transform = TransformStamped()
        transform.header.frame_id, transform.child_frame_id = "base_link", cloud_frame
        translation, rotation = transform.transform.translation, transform.transform.rotation
        translation.x, translation.y, translation.z = 0.03, 0.03, -0.06
        rotation.x, rotation.y, rotation.z, rotation.w = 0.69946, 0.71461, 0.00723, 0.00524
        # The bag starts again and again: its jumps back shall not cost half a second of samples each.
        parameters = ("config:=irs", "extrinsics_source:=tf", "imu_jump_patience:=0.01")
        rospy.set_param("/rio_t/extrinsics_translation", [9.0, 9.0, 9.0])  # not to be read
        with tester.Listener() as listener, tester.node(*parameters):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag):
                listener.wait_for_diagnosis("odometry", "waiting for tf from " + cloud_frame, WARN)
            self.assertEqual(listener.messages["odom"], [])
            publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
            publisher.publish(TFMessage([transform]))
            # The node has it once it waits for nothing or for something else. Then from the start of the bag.
            with tester.feed(listener, self.bag):
                listener.wait_for("extrinsics from tf", lambda: (
                    "waiting for tf" not in listener.diagnostics["odometry"].message))
            tester.call("/rio_t/reset", Empty)
            listener.messages["odom"].clear()
            self.whole_bag(listener)
            # The IMU samples before the first scan (0.1 of 11 s) are missed, and the initialisation is not quite the same.
            self.compare_live(listener, least=0.98)
            publisher.unregister()

    def test_wrong_parameters_are_named_and_end_the_node(self):
        outcome = tester.run(tester.program("rio_t", "rio_t_node"), "__name:=rio_t", "_config:=irs", "_windou:=1.0",
                             "_gravity:=heavy")
        self.assertEqual(outcome.returncode, 1, outcome.stdout)
        self.assertIn("/rio_t/windou", outcome.stdout)
        self.assertIn('did you mean "window"', outcome.stdout)
        self.assertIn("/rio_t/gravity", outcome.stdout)
        self.assertIn("(perhaps left by an earlier run: rosparam delete /rio_t)", outcome.stdout)
        rospy.delete_param("/rio_t")
        outcome = tester.run(tester.program("rio_t", "rio_t_node"), "__name:=rio_t", "_config:=irs", "_imu_topic:=a b",
                             "_radar_topic:=~scan")
        self.assertEqual(outcome.returncode, 1, outcome.stdout)
        self.assertIn('imu_topic: expected the name of a topic, got "a b"', outcome.stdout)
        self.assertIn('radar_topic: expected the name of a topic, got "~scan"', outcome.stdout)
        outcome = tester.run(tester.program("rio_t", "rio_t_node"), "__name:=rio_t", "config:=irs")
        self.assertEqual(outcome.returncode, 2, outcome.stdout)
        self.assertIn("a parameter is set with an underscore, _config:=irs", outcome.stdout)
        outcome = tester.run(tester.program("rio_t", "rio_t_node"), "__name:=rio_t_2", "_config:=no_such")
        self.assertEqual(outcome.returncode, 1, outcome.stdout)
        self.assertIn("no_such", outcome.stdout)

    def test_launch_file_plays_a_bag_to_the_nodelet_and_ends_with_it(self):
        words = ("--wait", "rio_t", "irs.launch", "bag:=" + self.bag, f"bag_rate:={2.0 / tester.SLOWNESS}",
                 "end_with_bag:=true", "nodelet:=true", "launch_prefix:=" + " ".join(tester.preloaded()))
        with tester.Listener() as listener, tester.Process(shutil.which("roslaunch"), *words) as launch:
            listener.wait_for_stamp("odom", self.imu_stamps[-1] - 10**9)  # the end of the player ends the nodelet, too
            self.assertEqual(launch.wait(), 0)


if __name__ == "__main__":
    import rostest
    rospy.init_node("live_rostest")
    rospy.set_param("/use_sim_time", True)  # for the nodes started from here on; the tester keeps to the wall clock
    rostest.rosrun("rio_t", "live_rostest", LiveTest)
