"""What the tests of the Python package share."""
import pathlib
import shutil
import sys

import pytest
import rosbag
import rospy

SOURCE = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCE / "src"))
from rio_t import programs  # noqa: E402


@pytest.fixture(scope="session")
def scripts():
    return SOURCE / "scripts"


@pytest.fixture(scope="session")
def programs_folder():
    return programs.find(("rio_t_bag", "simulate", "evaluate"), "a sourced workspace")


@pytest.fixture(scope="session")
def simulated_run(programs_folder, tmp_path_factory):
    """Folder with what rio_t_bag wrote of a short simulated bag (`run`) and with the truth (`truth.txt`)."""
    folder = tmp_path_factory.mktemp("simulated")
    programs.output_of(programs_folder / "simulate", "--motion", "easy", "--seed", 1, "--duration", 25,
                       "--time-offset", 0.03, "--out", folder / "run.bag", "--ground-truth", folder / "truth.txt")
    programs.output_of(programs_folder / "rio_t_bag", "--bag", folder / "run.bag", "--config", "irs", "--output-dir",
                       folder / "run")
    return folder


@pytest.fixture(scope="session")
def two_radar_run(programs_folder, simulated_run, tmp_path_factory):
    """The same with the radars `left` and `right`, and `rotation` estimated: what right sees is left's, stamped 20 ms
    later."""
    folder = tmp_path_factory.mktemp("two_radars")
    shutil.copy(simulated_run / "run.bag", folder)
    topic = "/sensor_platform/radar/scan"
    with rosbag.Bag(folder / "run.bag") as bag:
        scans = [(scan, time) for _, scan, time in bag.read_messages(topic)]
    with rosbag.Bag(folder / "run.bag", "a") as bag:
        for scan, time in scans:
            scan.header.stamp += rospy.Duration.from_sec(0.02)
            bag.write("/right", scan, time)
    (folder / "config.yaml").write_text((SOURCE / "config/irs.yaml").read_text() + f"""
radars: [left, right]
left: {{radar_topic: {topic}}}
right: {{radar_topic: /right}}
estimate_extrinsics: rotation
""")
    programs.output_of(programs_folder / "rio_t_bag", "--bag", folder / "run.bag", "--config", folder / "config.yaml",
                       "--output-dir", folder / "run")
    return folder
