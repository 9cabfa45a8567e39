"""Runs that disappoint say why, and good runs do not."""
import pathlib
import struct

import pytest
import rosbag
import yaml

from rio_t import programs


@pytest.fixture(name="run_with")
def run_with_fixture(programs_folder, simulated_run, tmp_path):
    """Runs rio_t_bag on the simulated bag with these settings: the process and the summary, None without one."""
    def run(*settings, bag=simulated_run / "run.bag", config="irs"):
        words = [word for setting in settings for word in ("--set", setting)]
        done = programs.run(programs_folder / "rio_t_bag", bag, "--config", config, "--output-dir", tmp_path / "out", *words)
        summary = tmp_path / "out" / "summary.yaml"
        return done, yaml.safe_load(summary.read_text()) if summary.exists() else None
    return run


def causes_of(summary):
    return [cause["name"] for cause in summary["causes"]]


def test_a_good_run_is_good(run_with):
    done, summary = run_with()
    assert done.returncode == 0
    assert (summary["verdict"], summary["causes"]) == ("good", [])
    assert all(check["good"] for check in summary["checks"])
    assert "verdict         good" in done.stdout


@pytest.mark.parametrize("motion", ["difficult", "ground_vehicle", "constant_speed"])
def test_other_good_runs_are_good(run_with, programs_folder, tmp_path, motion):
    bag = tmp_path / "other.bag"
    programs.output_of(programs_folder / "simulate", "--motion", motion, "--duration", 30, "--time-offset", 0.03, "--out",
                       bag)
    done, summary = run_with(bag=bag)
    assert (done.returncode, summary["verdict"], summary["causes"]) == (0, "good", [])


def test_a_start_in_motion_says_how_vague_the_heading_is(run_with, programs_folder, tmp_path):
    bag = tmp_path / "walk.bag"
    programs.output_of(programs_folder / "simulate", "--motion", "walk", "--duration", 40, "--static-start", 0, "--out", bag)
    _, summary = run_with(bag=bag)
    assert (summary["initialized_from"], summary["verdict"], causes_of(summary)) == ("motion", "doubtful", ["heading_vague"])
    # The user whose IMU has a small bias can say so.
    _, summary = run_with("init_motion_sigma_gyro_bias=0.0005", bag=bag)
    assert (summary["verdict"], summary["causes"]) == ("good", [])


def test_filtered_points_name_the_unit_of_the_power(run_with):
    done, summary = run_with("radar_power_unit=snr_decidb", "radar_min_snr_db=20")
    assert (done.returncode, summary) == (1, None)
    assert "every one of the" in done.stderr
    assert "points are below radar_min_snr_db 20 dB" in done.stderr
    assert "reads the power as snr_decidb" in done.stderr


def test_a_wrong_sign_is_not_trusted(run_with):
    done, summary = run_with("radar_doppler_sign=-1")
    if summary is None:  # it may also refuse to start
        assert done.returncode == 1
        assert "radar_doppler_sign" in done.stderr
        return
    assert done.returncode == 3
    assert summary["verdict"] == "bad"
    assert set(causes_of(summary)) & {"contradicts_imu", "diverged"}
    assert "radar_doppler_sign" in done.stdout


def test_a_mounting_that_follows_a_wrong_sign_is_named(run_with, programs_folder, tmp_path):
    """Nothing contradicts such a run any more: the radar is turned around, and its scans are used."""
    config = yaml.safe_load((pathlib.Path(__file__).parent.parent / "config" / "two_radars.yaml").read_text())
    radars = []
    for name in config["radars"]:
        lever, rotation = (",".join(map(str, config[name]["extrinsics_" + key])) for key in ("translation", "rotation_xyzw"))
        radars += ["--radar", f"{name} extrinsics-translation={lever} extrinsics-rotation-xyzw={rotation}"]
    bag = tmp_path / "pair.bag"
    programs.output_of(programs_folder / "simulate", "--motion", "medium", "--seed", 3, "--duration", 60, *radars, "--out", bag)
    _, summary = run_with(bag=bag, config="two_radars")
    assert (summary["verdict"], summary["causes"]) == ("good", [])
    _, summary = run_with("right/radar_doppler_sign=-1", bag=bag, config="two_radars")
    assert summary["verdict"] != "good"
    assert "mounting_far" in causes_of(summary)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_a_doppler_that_is_not_in_metres_per_second_is_named(run_with, programs_folder, tmp_path, factor):
    true, scaled = tmp_path / "true.bag", tmp_path / "scaled.bag"
    programs.output_of(programs_folder / "simulate", "--motion", "walk", "--seed", 2, "--duration", 60, "--out", true)
    with rosbag.Bag(str(true)) as bag, rosbag.Bag(str(scaled), "w") as to:
        for topic, message, stamp in bag.read_messages():
            if message._type == "sensor_msgs/PointCloud2":  # pylint: disable=protected-access
                offset = next(field.offset for field in message.fields if field.name == "v_doppler_mps")
                data = bytearray(message.data)
                for at in range(offset, len(data), message.point_step):
                    struct.pack_into("<f", data, at, factor * struct.unpack_from("<f", data, at)[0])
                message.data = bytes(data)
            to.write(topic, message, stamp)
    _, summary = run_with(bag=true)
    assert (summary["verdict"], summary["causes"]) == ("good", [])
    assert abs(summary["doppler_scale_error"]) < 0.02
    _, summary = run_with(bag=scaled)
    assert summary["verdict"] != "good"
    assert causes_of(summary)[0] == "doppler_scale"
    assert not next(check for check in summary["checks"] if check["name"] == "doppler_scaled_sigmas")["good"]


def test_a_wrong_offset_that_is_held_is_named(run_with, programs_folder, tmp_path):
    bag = tmp_path / "late.bag"
    programs.output_of(programs_folder / "simulate", "--motion", "medium", "--duration", 60, "--time-offset", 0.03, "--out", bag)
    _, summary = run_with("estimate_time_offset=false", bag=bag)
    assert summary["verdict"] == "doubtful"
    assert causes_of(summary) == ["offset_far"]
    assert abs(summary["offset_error_s"] - 0.03) < 0.006
    _, summary = run_with("estimate_time_offset=false", "time_offset_initial=0.03", bag=bag)
    assert (summary["verdict"], summary["causes"]) == ("good", [])
    _, summary = run_with(bag=bag)
    assert "offset_error_s" not in summary


def test_a_wrong_lever_arm_that_is_held_is_named(run_with, programs_folder, tmp_path):
    bag = tmp_path / "arm.bag"
    programs.output_of(programs_folder / "simulate", "--motion", "difficult", "--duration", 40, "--out", bag)
    _, summary = run_with("extrinsics_translation=[0.03,0.03,0.14]", bag=bag)
    assert summary["verdict"] == "doubtful"
    assert causes_of(summary)[0] == "lever_arm_far"
    assert abs(summary["lever_arm_error"][2] + 0.2) < 0.05
    assert not next(check for check in summary["checks"] if check["name"] == "held_lever_arm_error_sigmas")["good"]
    _, summary = run_with(bag=bag)
    assert (summary["verdict"], summary["causes"]) == ("good", [])
    _, summary = run_with("extrinsics_translation=[]", bag=bag)
    assert "lever_arm_error" not in summary


def test_a_radar_that_falls_silent_is_bad(run_with, simulated_run, tmp_path):
    bag = tmp_path / "silent.bag"
    with rosbag.Bag(str(simulated_run / "run.bag")) as whole, rosbag.Bag(str(bag), "w") as silent:
        start, end = whole.get_start_time(), whole.get_end_time()
        for topic, message, stamp in whole.read_messages():
            if "radar" not in topic or stamp.to_sec() < start + 0.4 * (end - start):
                silent.write(topic, message, stamp)
    done, summary = run_with(bag=bag)
    assert (done.returncode, summary["verdict"]) == (3, "bad")
    assert causes_of(summary) == ["radar_silent"]
    assert "No scan was used from" in done.stdout


def test_a_start_without_rest_says_so(run_with):
    done, summary = run_with("init_mode=static", "init_duration=10", "bag_duration=2")
    assert (done.returncode, summary) == (1, None)
    assert "never initialised" in done.stderr
    assert "init_mode: auto" in done.stderr


def test_stamps_of_another_clock_are_named(run_with):
    done, summary = run_with("radar_stamp_shift=1000")
    assert (done.returncode, summary) == (1, None)
    assert "radar_stamp_shift" in done.stderr or "stamp_source: arrival" in done.stderr


def test_a_clock_of_the_radar_that_is_behind_is_named(run_with):
    done, summary = run_with("radar_stamp_shift=-1000")
    assert (done.returncode, summary) == (1, None)
    assert "are stamped before the first IMU sample, the first of them by " in done.stderr
    assert "too few points" not in done.stderr


def test_an_offset_beyond_its_bound_is_named(run_with):
    done, summary = run_with("max_time_offset=0.01", "radar_stamp_shift=0.1")
    assert "offset_at_bound" in causes_of(summary)
    assert summary["verdict"] != "good"
    assert "max_time_offset 0.01" in done.stdout


def test_several_bags_are_played_as_one(run_with, programs_folder, simulated_run, tmp_path):
    parts = [tmp_path / "part_0.bag", tmp_path / "part_1.bag"]
    with rosbag.Bag(str(simulated_run / "run.bag")) as whole:
        middle = (whole.get_start_time() + whole.get_end_time()) / 2
        with rosbag.Bag(str(parts[0]), "w") as first, rosbag.Bag(str(parts[1]), "w") as second:
            for topic, message, stamp in whole.read_messages():
                (first if stamp.to_sec() < middle else second).write(topic, message, stamp)
    _, whole_summary = run_with()
    trajectory = (tmp_path / "out" / "trajectory.txt").read_bytes()
    done = programs.run(programs_folder / "rio_t_bag", *parts, "--config", "irs", "--output-dir", tmp_path / "both")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "both" / "trajectory.txt").read_bytes() == trajectory
    assert yaml.safe_load((tmp_path / "both" / "summary.yaml").read_text())["scans_used"] == whole_summary["scans_used"]
