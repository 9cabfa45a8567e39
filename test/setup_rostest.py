#!/usr/bin/env python3
"""The live node in the set-ups that people have: namespaces, remapping, wall time, other drivers, managers, tools."""
import os
import pathlib
import shutil
import signal
import unittest

import dynamic_reconfigure.client
import numpy
import rosbag
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import Imu
from std_msgs.msg import Header
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from rio_t import live_tester as tester
from rio_t import paced_player
from rio_t import tum

OK, WARN, ERROR = 0, 1, 2
CONFIG = pathlib.Path(__file__).resolve().parent.parent / "config"
SAME_M = 1e-8  # live as in the bag runner, as in live_rostest.py
TI_MMWAVE = "/ti_mmwave/radar_scan_pcl"
TI_TRIGGER = "/sensor_platform/radar_right/trigger"


class SetupTest(tester.LiveTestCase):
    namespaces = ("/rio_t", "/rio_t_2", "/robot", "/diagnostic_aggregator")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.bag = tester.simulate(cls.path("run.bag"))
        cls.imu_stamps = tester.stamps(cls.bag, tester.IMU)
        with rosbag.Bag(cls.bag) as messages:
            scans = [scan for _, scan, _ in messages.read_messages([tester.RADAR])]
        cls.scan_stamps, cls.scan_sizes = [scan.header.stamp.to_nsec() for scan in scans], [scan.width for scan in scans]

    def setUp(self):
        super().setUp()
        rospy.set_param("/use_sim_time", True)

    def play_whole(self, listener, topics=(tester.IMU, tester.RADAR), bag=None, stamps=None, **more):
        with tester.feed(listener, bag or self.bag, topics, **more) as player:
            player.wait()
        listener.wait_for_stamp("odom", (stamps or self.imu_stamps)[-1])

    def test_namespace(self):
        """Relative topics, services and parameters lie in the namespace of the node."""
        saved = self.path("namespace.txt")
        parameters = ("config:=irs", "imu_topic:=imu", "radar_topic:=scan", "trajectory_file:=" + saved)
        with tester.Listener(node="/robot/rio_t") as listener, tester.node(*parameters, remap=("__ns:=/robot",)):
            listener.wait_until_heard()
            self.play_whole(listener, {tester.IMU: "/robot/imu", tester.RADAR: "/robot/scan"})
            listener.wait_for_diagnosis("input", "", None)
            self.assertIn("/robot/imu topic status", listener.diagnostics)
            self.assertIn("/robot/scan topic status", listener.diagnostics)
            response = tester.call("/robot/rio_t/save_trajectory")
            self.assertTrue(response.success, response.message)
            self.assertGreater(len(tum.read(saved).positions()), 20)
        # The bag runner reads the same relative names.
        run = tester.run_bag(self.bag, "irs", self.path("relative"), "imu_topic=" + tester.IMU[1:],
                             "radar_topic=" + tester.RADAR[1:])
        self.assertTrue(os.path.getsize(os.path.join(run, "trajectory.txt")) > 0)

    def test_remapping_is_told_with_the_resolved_names(self):
        with tester.Listener() as listener, tester.node("config:=irs", remap=(f"{tester.IMU}:=/other/imu",)):
            listener.wait_until_heard()
            listener.wait_for_diagnosis("input", "no IMU message yet on /other/imu", ERROR)
            self.play_whole(listener, {tester.IMU: "/other/imu", tester.RADAR: tester.RADAR})
            listener.wait_for("rate of the IMU", lambda: "Actual frequency (Hz)" in [
                v.key for v in listener.diagnostics["/other/imu topic status"].values])
            # After the bag its clock stands still.
            listener.wait_for_diagnosis("input", "ROS time stands still", WARN)
            listener.wait_for_diagnosis("/other/imu topic status", "No events recorded", ERROR)

    def test_another_publisher_of_our_frame_is_told(self):
        other = rospy.Publisher("/tf", TFMessage, queue_size=1, latch=True)
        transform = TransformStamped(header=Header(frame_id="map"), child_frame_id="base_link")
        transform.transform.rotation.w = 1.0
        with tester.Listener() as listener, tester.node("config:=irs"):
            other.publish(TFMessage([transform]))
            listener.wait_for_diagnosis("odometry", f"base_link from {rospy.get_name()} (below map)", WARN)
        other.unregister()

    def test_another_robot_that_has_our_radar_frame_is_told(self):
        other = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        transform = TransformStamped(header=Header(frame_id="other/base_link"), child_frame_id="rio_t_radar")
        transform.transform.rotation.w = 1.0
        other.publish(TFMessage([transform]))
        with tester.Listener() as listener, tester.node("config:=irs"):
            listener.wait_for_diagnosis("odometry", f"rio_t_radar from {rospy.get_name()} (below other/base_link)", WARN)
        other.unregister()

    def test_another_nodelet_of_the_manager_that_has_our_frame_is_told(self):
        """Both publish under the name of the manager."""
        nodelet = tester.program("nodelet", "nodelet")
        def load(name):
            return tester.Process(nodelet, "load", "rio_t/RioTNodelet", "manager", "__name:=" + name, "_config:=irs")
        with tester.Process(*tester.preloaded(), nodelet, "manager", "__name:=manager"), tester.Listener() as listener:
            with load("rio_t"):
                listener.wait_until_heard()
                with tester.feed(listener, self.bag):
                    listener.wait_for("tf", lambda: len(listener.tf) > 50)
                    listener.diagnostics.clear()
                    listener.wait_for_diagnosis("odometry", "running", OK)  # our own tf is not that of another
                with load("rio_t_2"), tester.feed(listener, self.bag):
                    listener.wait_for_diagnosis("odometry", "base_link from another nodelet of /manager (below odom)", WARN)

    def test_wall_time(self):
        rospy.set_param("/use_sim_time", False)
        with tester.Listener() as listener, tester.node("config:=irs"):
            listener.wait_until_heard()
            self.play_whole(listener)
            listener.wait_for_stamp("odom_optimized", self.scan_stamps[-4])
            # Stamps are those of the sensors, whatever the clock.
            self.assertLessEqual({m.header.stamp.to_nsec() for m in listener.messages["odom"]}, set(self.imu_stamps))

    def test_arrival_stamps(self):
        with tester.Listener() as listener, tester.node("config:=irs", "stamp_source:=arrival", "correct_stamps:=false"):
            listener.wait_until_heard()
            self.play_whole(listener)
            listener.wait_for_stamp("points", self.scan_stamps[-4])
            answers = list(listener.messages["points"])
            self.assertIsNone(listener.value("input", "dropped_imu_missing"))
        # The numbers of points tell which scans these are.
        sizes = [m.width for m in answers]
        firsts = [k for k in range(len(self.scan_stamps)) if self.scan_sizes[k:k + len(sizes)] == sizes]
        self.assertEqual(len(firsts), 1, (sizes, self.scan_sizes))
        self.assertGreater(len(sizes), 20)
        delays = [m.header.stamp.to_nsec() - stamp for m, stamp in zip(answers, self.scan_stamps[firsts[0]:])]
        # In `simulate` a scan arrives after 0.06 s, the IMU after 0.001 s. A busy machine delivers later, but the player does
        # not go on for longer than its patience before a scan is answered.
        delay = 1e-9 * numpy.median(delays)
        self.assertGreater(delay, 0.06 - 0.001 - 0.03)
        self.assertLess(delay, 0.06 + paced_player.PATIENCE + paced_player.TOLERANCE)

    def test_who_comes_late_gets_the_newest_poses_of_the_path(self):
        others = {name: kind for name, kind in tester.TOPICS.items() if name != "path"}
        with tester.Listener(others) as listener, tester.node("config:=irs", "path_max_poses:=10"):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag, rate=4.0, duration=7.0) as player:
                player.wait()
            optimized = listener.messages["odom_optimized"]
            newest = optimized[-1].header.stamp
            path = [pose.header.stamp for pose in rospy.wait_for_message("/rio_t/path", Path, tester.DEADLINE).poses]
            listener.wait_for_stamp("odom_optimized", path[-1].to_nsec())
            self.assertGreaterEqual(path[-1], newest)
            stamps = sorted({m.header.stamp for m in optimized if m.header.stamp <= path[-1]})
            self.assertGreater(len(stamps), 20)
            self.assertEqual(path, stamps[-10:])

    def test_aids_say_that_they_are_used(self):
        bag, barometer = self.path("vehicle.bag"), "/sensor_platform/baro"
        tester.check(tester.run(tester.program("rio_t", "simulate"), "--motion", "ground_vehicle", "--barometer",
                                "--static-start", 4, "--duration", 16, "--out", bag))
        with tester.Listener() as listener, tester.node("config:=irs", "platform:=ground_vehicle",
                                                        "barometer_topic:=" + barometer):
            listener.wait_until_heard()
            with tester.feed(listener, bag, (tester.IMU, tester.RADAR, barometer)):
                listener.wait_for_diagnosis("barometer", "in use", OK)
                listener.wait_for_diagnosis("ground vehicle", "the motion agrees", OK)

    def test_ti_mmwave(self):
        bag = tester.simulate(self.path("ti.bag"), "--format", "ti_mmwave", "--extrinsics-rotation-xyzw",
                              "0.923218461092,0.375992995522,-0.0267831268675,-0.0746967504749")
        optimized = tum.read(os.path.join(tester.run_bag(bag, "ti_mmwave", self.path("ti")),
                                          "trajectory_optimized.txt")).positions()
        saved = self.path("ti.txt")
        with tester.Listener() as listener, tester.node("config:=ti_mmwave", "trajectory_file:=" + saved):
            listener.wait_until_heard()
            self.play_whole(listener, (tester.IMU, TI_MMWAVE, TI_TRIGGER), bag, tester.stamps(bag, tester.IMU),
                            answers={TI_MMWAVE: "points"})
            self.assertTrue(tester.call("/rio_t/save_trajectory").success)
        kept = tum.read(saved).positions()
        common = (kept.keys() & optimized.keys()) - {max(kept)}
        self.assertGreater(len(common), 20)
        self.assertLess(max(numpy.linalg.norm(kept[t] - optimized[t]) for t in common), SAME_M)

    def test_nodelet_with_bad_parameters_is_refused_and_the_manager_lives_on(self):
        nodelet = tester.program("nodelet", "nodelet")
        with open(self.path("manager.txt"), "w") as told:
            words = (*tester.preloaded(), nodelet, "manager", "__name:=manager")
            with tester.Process(*words, stdout=told, stderr=told) as manager:
                outcome = tester.run(nodelet, "load", "rio_t/RioTNodelet", "manager", "__name:=rio_t", "_config:=irs",
                                     "_windou:=1.0")
                self.assertNotEqual(outcome.returncode, 0, outcome.stdout)
                self.assertIsNone(manager.process.poll(), "the manager died")
                rospy.delete_param("/rio_t/windou")
                with tester.Listener() as listener, tester.Process(nodelet, "load", "rio_t/RioTNodelet", "manager",
                                                                   "__name:=rio_t", "_config:=irs"):
                    listener.wait_until_heard()
                    listener.wait_for_diagnosis("input", "no IMU message yet", ERROR)
        text = pathlib.Path(self.path("manager.txt")).read_text()
        self.assertIn("/rio_t/windou", text)
        self.assertIn('did you mean "window"', text)

    def test_unloading_during_long_solves(self):
        """The solver has more to do than time for it; the nodelet goes all the same, and the manager stays."""
        nodelet = tester.program("nodelet", "nodelet")
        bag = tester.simulate(self.path("long.bag"), duration=40)
        heavy = ("_solver:=ceres", "_window:=60.0", "_max_iterations:=1000", "_max_queued_scans:=3")
        with tester.Process(*tester.preloaded(), nodelet, "manager", "__name:=manager") as manager:
            with tester.Listener() as listener, tester.Process(
                    nodelet, "load", "rio_t/RioTNodelet", "manager", "__name:=rio_t", "_config:=irs", *heavy) as loader:
                listener.wait_until_heard()
                with tester.play(bag, (tester.IMU, tester.RADAR), 10.0, "--loop"):
                    listener.wait_for("scans for which the solver has no time", lambda: listener.value(
                        "input", "dropped_queue_full") not in (None, "0"))
                    loader.stop()
                    self.assertIsNone(manager.process.poll(), "the manager died")
            with tester.Listener() as listener, tester.Process(nodelet, "load", "rio_t/RioTNodelet", "manager",
                                                               "__name:=rio_t", "_config:=irs"):
                listener.wait_until_heard()
                listener.wait_for_diagnosis("input", "no IMU message yet", ERROR)
            self.assertIsNone(manager.process.poll(), "the manager died")

    def test_dynamic_reconfigure(self):
        with tester.Listener() as listener, tester.node("config:=irs", "innovation_gate:=5.0"):
            listener.wait_until_heard()
            client = dynamic_reconfigure.client.Client("/rio_t", timeout=tester.DEADLINE)
            values = client.get_configuration(timeout=tester.DEADLINE)
            self.assertEqual(values["innovation_gate"], 5.0)  # what holds, not the default
            self.assertIn("[Hz]", next(p["description"] for p in client.get_parameter_descriptions()
                                       if p["name"] == "odom_rate"))
            with tester.feed(listener, self.bag) as player:
                listener.wait_for("odometry", lambda: len(listener.messages["odom"]) > 100)
                # Refused: nothing changes, and it is told why.
                answer = client.update_configuration({"innovation_gate": -1.0, "odom_rate": 20.0})
                self.assertEqual((answer["innovation_gate"], answer["odom_rate"]), (5.0, 0.0))
                self.assertEqual(rospy.get_param("/rio_t/effective/innovation_gate"), 5.0)
                listener.wait_for("the refusal", lambda: "innovation_gate: expected a finite number of at least 0" in (
                    listener.value("odometry", "last_reconfiguration") or ""))
                # Done: shown on the parameter server, in effect at once. No scan passes a gate of nothing.
                answer = client.update_configuration({"innovation_gate": 1e-6, "odom_rate": 20.0})
                before = len(listener.messages["odom"])
                self.assertEqual((answer["innovation_gate"], answer["odom_rate"]), (1e-6, 20.0))
                self.assertEqual(rospy.get_param("/rio_t/effective/odom_rate"), 20.0)
                listener.wait_for("scans that the gate rejects",
                                  lambda: int(listener.value("input", "dropped_innovation") or 0) > 3)
                player.wait()
            listener.wait_for("end of the bag", lambda: listener.messages["odom"][-1].header.stamp.to_nsec() >
                              self.imu_stamps[-1] - 10**8)
            # A few messages were on their way.
            periods = [m.header.stamp.to_nsec() * 20 // 10**9 for m in listener.messages["odom"][before + 50:]]
            self.assertGreater(len(periods), 10)
            self.assertEqual(len(periods), len(set(periods)))
            self.assertIsNone(listener.value("odometry", "last_reset_because") or None, "it needed no restart")

    def test_the_next_run_reads_its_configuration_and_no_value_of_the_run_before(self):
        effective = []
        for name, text in (("a", "imu_accel_noise_density: 0.5\nodom_rate: 5\n"), ("b", "imu_accel_noise_density: 0.01\n")):
            file = pathlib.Path(self.path(name + ".yaml"))
            file.write_text(text)
            with tester.Listener() as listener, tester.node(f"config:={file}"):
                listener.wait_for_diagnosis("input", "no IMU message yet", ERROR)  # it has started
                if name == "a":
                    client = dynamic_reconfigure.client.Client("/rio_t", timeout=tester.DEADLINE)
                    client.update_configuration({"tf_rate": 7.0})
                    client.close()
                effective.append(rospy.get_param("/rio_t/effective"))
                self.assertEqual(set(rospy.get_param("/rio_t")), {"config", "effective"}, "parameters of the user")
        values = [tuple(each[key] for key in ("imu_accel_noise_density", "odom_rate", "tf_rate")) for each in effective]
        self.assertEqual(values, [(0.5, 5.0, 7.0), (0.01, 0.0, 50.0)])

    def test_the_log_says_what_is_missing(self):
        seen = []
        subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, lambda message: seen.extend(
            status for status in message.status if "no IMU message yet on /wrong" in status.message))
        log = pathlib.Path(self.path("node.txt"))
        with open(log, "w") as told, tester.node("config:=irs", "imu_topic:=/wrong", stdout=told, stderr=told):
            tester.wait_for("four diagnoses", lambda: len(seen) >= 4)
        subscriber.unregister()
        text = log.read_text()
        self.assertIn("/rio_t: initialising, waiting for", text)
        self.assertIn("/rio_t: no IMU message yet on /wrong", text)
        self.assertEqual(text.count("no IMU message yet"), 1, text)  # it repeats a diagnosis after a minute

    def test_the_log_says_that_the_estimate_diverged_also_where_no_scan_comes(self):
        log = pathlib.Path(self.path("diverged.txt"))
        # No state is known so well: it diverges as it starts, at rest, by the IMU alone.
        with open(log, "w") as told, tester.Listener() as listener, tester.node(
                "config:=irs", "divergence_max_velocity_sigma:=1e-6", stdout=told, stderr=told):
            listener.wait_until_heard()
            with tester.feed(listener, self.bag, (tester.IMU,)):
                listener.wait_for_diagnosis("odometry", "diverged", ERROR)
        self.assertIn("/rio_t: diverged: do not trust the estimate", log.read_text())

    def test_the_log_asks_to_stand_still_only_if_the_start_wants_it(self):
        for mode, wants_rest in (("static", True), ("auto", True), ("motion", False)):
            log = pathlib.Path(self.path(mode + ".txt"))
            with open(log, "w") as told, tester.Listener() as listener, tester.node(
                    "config:=irs", "init_mode:=" + mode, stdout=told, stderr=told):
                listener.wait_until_heard()
                tester.call("/rio_t/reset", Empty)
            self.assertIn("; starts again", log.read_text())
            self.assertEqual("; starts again, stand still" in log.read_text(), wants_rest, mode)

    def test_save_trajectory_answers_with_the_whole_path(self):
        with tester.Listener() as listener, tester.node("config:=irs", "trajectory_file:=poses.txt", cwd=self.folder):
            listener.wait_until_heard()
            tester.call("/rio_t/reset", Empty)
            with tester.feed(listener, self.bag):
                listener.wait_for("optimised odometry", lambda: listener.messages["odom_optimized"])
                response = tester.call("/rio_t/save_trajectory")
        self.assertIn(" poses in " + os.path.realpath(self.path("poses.txt")), response.message)
        self.assertIn("all since the last reset", response.message)
        self.assertTrue(os.path.isfile(self.path("poses.txt")))

    def test_sigterm_ends_the_node_in_order(self):
        """As docker stop, systemd and kill end it: the master forgets its services."""
        with tester.node("config:=irs") as node:
            tester.call("/rio_t/reset", Empty)
            node.process.send_signal(signal.SIGTERM)
            self.assertEqual(node.wait(), 0)
        with self.assertRaises(rosgraph.MasterException):
            rosgraph.Master("/test").lookupService("/rio_t/reset")

    def test_a_topic_of_a_wrong_type_is_told(self):
        publisher = rospy.Publisher("/odd/imu", Header, queue_size=1)
        with tester.Listener() as listener, tester.node("config:=irs", "imu_topic:=/odd/imu"):
            listener.wait_for_diagnosis("input", "no IMU message yet on /odd/imu, which is published as std_msgs/Header, "
                                                 "expected sensor_msgs/Imu", ERROR)
        publisher.unregister()

    def test_mavros_gets_odometry_by_its_contract(self):
        """mavros is not in Debian: its topic, rate, frames and covariances are what we can check."""
        heard = []
        subscriber = rospy.Subscriber("/mavros/odometry/out", Odometry, heard.append, queue_size=None)
        topics = {name: kind for name, kind in tester.TOPICS.items() if name != "odom"}
        with tester.Listener(topics) as listener, tester.Process(
                shutil.which("roslaunch"), "--wait", "rio_t", "mavros.launch") as launch:
            listener.wait_until_heard()
            tester.wait_for("the publisher", lambda: subscriber.get_num_connections() > 0)
            with tester.feed(listener, self.bag) as player:
                player.wait()
            last = self.imu_stamps[-1] - 10**9 // 30
            tester.wait_for("the last odometry", lambda: heard and heard[-1].header.stamp.to_nsec() >= last)
            launch.stop()
        subscriber.unregister()
        self.assertEqual({(m.header.frame_id, m.child_frame_id) for m in heard}, {("odom", "base_link")})
        stamps = numpy.array([m.header.stamp.to_sec() for m in heard])
        self.assertAlmostEqual((len(stamps) - 1) / (stamps[-1] - stamps[0]), 30.0, delta=0.5)
        for message in heard:
            for covariance in (message.pose.covariance, message.twist.covariance):
                self.assertGreater(numpy.linalg.eigvalsh(numpy.array(covariance).reshape(6, 6))[0], 0.0)

    def test_check_bag_refuses_a_path_before_it_listens_and_names_a_silent_clock(self):
        def listen(*options):
            outcome = tester.run(tester.program("rio_t", "check_bag"), "--live", "--duration", 3, *options)
            return outcome.returncode, outcome.stdout
        kept = self.path("kept.bag")
        status, told = listen("--keep", self.bag)
        self.assertEqual(status, 2)
        self.assertIn("expected a new file", told)
        status, told = listen("--keep", kept, "--out", self.path("nowhere/my.yaml"))
        self.assertEqual(status, 2)
        self.assertIn("there is no folder", told)
        self.assertNotIn("listening", told)
        # A latched message waits for each who comes, and nobody publishes a clock.
        publisher = rospy.Publisher("/some_imu", Imu, queue_size=1, latch=True)
        publisher.publish(Imu())
        status, told = listen("--keep", kept)
        publisher.unregister()
        self.assertEqual(status, 1, told)
        self.assertIn("use_sim_time is true, but /clock is silent", told)
        self.assertFalse(os.path.exists(kept))

    def test_check_bag_keeps_barometer_and_tf_of_live_topics(self):
        kept, barometer = self.path("aids.bag"), "/sensor_platform/baro"
        bag = tester.simulate(self.path("barometer.bag"), "--barometer")
        # Of config/irs.yaml.
        mounting = TransformStamped(header=Header(frame_id="base_link"), child_frame_id="radar")
        mounting.transform.translation = Vector3(0.03, 0.03, -0.06)
        mounting.transform.rotation = Quaternion(0.69946, 0.71461, 0.00723, 0.00524)
        publisher = rospy.Publisher("/tf_static", TFMessage, queue_size=1, latch=True)
        publisher.publish(TFMessage([mounting]))  # before the clock of the bag
        words = ("--live", "--duration", tester.DEADLINE, "--keep", kept, "--out", self.path("aids.yaml"), "--set",
                 "barometer_topic=" + barometer, "--set", "extrinsics_source=tf")
        told = pathlib.Path(self.path("aids.txt"))
        with open(told, "w") as log, tester.Process(tester.program("rio_t", "check_bag"), *words, stdout=log,
                                                    stderr=log) as check:
            with tester.play(bag, (tester.IMU, tester.RADAR, barometer), 4.0) as player:
                player.wait()
            self.assertEqual(check.stop(), 0, told.read_text())  # it has heard enough
        publisher.unregister()
        with rosbag.Bag(kept) as messages:
            self.assertLessEqual({barometer, "/tf_static"}, set(messages.get_type_and_topic_info().topics))
        self.assertIn("barometer_topic: " + barometer, pathlib.Path(self.path("aids.yaml")).read_text())

    def test_check_bag_sees_two_publishers_of_a_live_topic(self):
        rospy.set_param("/use_sim_time", False)
        words = (shutil.which("rostopic"), "pub", "-r", "20", "/two/imu", "sensor_msgs/Imu", "{}")
        heard = rospy.Subscriber("/two/imu", Imu, queue_size=1)
        with tester.Process(*words), tester.Process(*words):
            tester.wait_for("two publishers", lambda: heard.get_num_connections() == 2)
            told = tester.run(tester.program("rio_t", "check_bag"), "--live", "--duration", 3).stdout
        heard.unregister()
        self.assertIn("Topic /two/imu has messages of 2 publishers by turns", " ".join(told.split()))

    @unittest.skipIf(any(name in pathlib.Path("/etc/os-release").read_text() for name in ("bullseye", "jammy")),
                     "the aggregator of Debian 11 and Ubuntu 22.04 does not find its own plugins")
    def test_diagnostics_aggregator(self):
        rospy.set_param("/use_sim_time", False)  # the aggregator publishes by the clock, and no bag gives one
        statuses = {}
        def keep(message):
            statuses.update({status.name: status for status in message.status})
        subscriber = rospy.Subscriber("/diagnostics_agg", DiagnosticArray, keep)
        tester.check(tester.run(shutil.which("rosparam"), "load", CONFIG / "diagnostics" / "aggregator.yaml",
                                "/diagnostic_aggregator"))
        aggregator = tester.program("diagnostic_aggregator", "aggregator_node")
        with tester.Listener() as listener, tester.node("config:=irs"), tester.Process(aggregator):
            listener.wait_until_heard()
            topics = [topic[1:].replace("/", " ") + " topic status" for topic in (tester.IMU, tester.RADAR)]
            names = {"/rio_t", "/rio_t/Estimate", "/rio_t/Input", *(
                f"/rio_t/Estimate/{name}" for name in ("odometry", "solver", "time offset")), *(
                f"/rio_t/Input/{name}" for name in ("input", *topics))}
            tester.wait_for("statuses " + ", ".join(sorted(names)), lambda: names <= set(statuses))
            self.assertFalse([name for name in statuses if name.startswith("/Other") and "rio_t" in name])
        subscriber.unregister()


if __name__ == "__main__":
    import rostest
    rospy.init_node("setup_rostest")
    rostest.rosrun("rio_t", "setup_rostest", SetupTest)
