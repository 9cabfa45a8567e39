"""The install space alone: scripts/test_install.sh runs this where neither sources nor build folder can be seen."""
import os
import pathlib
import re
import shutil
import socket
import subprocess
import time

import pytest

SOURCE = pathlib.Path(os.environ["RIO_T_TEST_SOURCE"])
BUILD = pathlib.Path(os.environ["RIO_T_TEST_BUILD"])
PREFIX = BUILD / "install"
DOWNSTREAM = pathlib.Path(__file__).parent / "downstream"
DEADLINE = 600.0  # [s] for anything; far more than needed, even beside other work


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], text=True, check=False, timeout=DEADLINE, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, **options)
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    path = tmp_path_factory.mktemp("bag") / "run.bag"
    run("rosrun", "rio_t", "simulate", "--motion", "medium", "--duration", 14, "--static-start", 5, "--static-end", 1, "--out", path)
    return path


@pytest.fixture
def ros(monkeypatch, tmp_path):
    """The words of roslaunch with a master of its own."""
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{port}")
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path))
    return ["roslaunch", "-p", str(port)]


@pytest.mark.skipif(not os.environ.get("RIO_T_HIDDEN"), reason="this system cannot hide folders")
def test_neither_sources_nor_build_are_in_reach():
    assert not (SOURCE / "package.xml").exists()
    assert not (BUILD / "devel").exists()


def test_no_installed_file_names_the_sources_or_the_build():
    folders = b"|".join(re.escape(bytes(folder)) for folder in
                        [*(SOURCE / name for name in ("src", "include", "config", "launch", "scripts", "cmake", "msg")),
                         BUILD / "devel"])
    paths = re.compile(rb"(?<![\w.+-])(?:" + folders + rb")\b")
    # genpy installs the byte code of the devel space's __init__.py, too. Python sees that it is not that of the file beside it.
    found = {file.relative_to(PREFIX): paths.search(file.read_bytes()) for file in PREFIX.rglob("*")
             if file.is_file() and file.suffix != ".pyc"}
    assert {str(file): match[0] for file, match in found.items() if match} == {}


@pytest.mark.parametrize("program", ["rio_t_bag", "calibrate", "evaluate", "simulate", "report.py", "experiment.py"])
def test_programs_help(program):
    assert "usage" in run("rosrun", "rio_t", program, "--help").lower()


def test_configurations_are_found_without_a_sourced_workspace():
    environment = {"PATH": "/usr/bin:/bin", "LD_LIBRARY_PATH": os.environ["LD_LIBRARY_PATH"]}
    program = PREFIX / "lib/rio_t/rio_t_bag"
    assert "radar_format: ti_mmwave" in run(program, "--config", "ti_mmwave", "--print-config", env=environment)


def test_bag_launch_writes_a_run_and_report_draws_it(ros, bag, tmp_path):
    run(*ros, "rio_t", "bag.launch", f"bag:={bag.name}", "output_dir:=out", cwd=bag.parent,
        env={**os.environ, "PWD": str(bag.parent)})
    run("rosrun", "rio_t", "report.py", bag.parent / "out")
    assert (bag.parent / "out/report/report.html").is_file()


def test_a_copied_example_finds_our_configurations(tmp_path):
    (tmp_path / "launch").mkdir()
    shutil.copy(PREFIX / "share/rio_t/launch/examples/mavros.launch", tmp_path / "launch")
    assert "/rio_t/config: irs" in run("roslaunch", "--dump-params", tmp_path / "launch/mavros.launch")


@pytest.mark.parametrize("arguments, name", [(["nodelet:=false"], "/rio_t"), (["nodelet:=true", "ns:=robot"], "/robot/rio_t")])
def test_launch_file_plays_a_bag(ros, bag, arguments, name):
    words = [*ros, "rio_t", "irs.launch", f"bag:={bag}", "bag_rate:=3", "bag_args:=--loop", *arguments]
    with subprocess.Popen(words, stdout=subprocess.DEVNULL) as launch:
        try:
            end = time.monotonic() + DEADLINE
            while f"{name}/odom" not in subprocess.run(["rostopic", "list"], text=True, capture_output=True, check=False).stdout:
                assert launch.poll() is None and time.monotonic() < end, f"no topic {name}/odom"
            assert "child_frame_id" in run("rostopic", "echo", "-n", 1, f"{name}/odom")
            assert "radar_format: irs" in run("rosparam", "get", f"{name}/effective")
        finally:
            launch.terminate()


def test_another_package_builds_on_headers_libraries_and_messages(tmp_path):
    run("cmake", "-S", DOWNSTREAM, "-B", tmp_path, "-DCMAKE_BUILD_TYPE=Debug", "-DPYTHON_EXECUTABLE=/usr/bin/python3")
    run("cmake", "--build", tmp_path)
    program = tmp_path / "devel/lib/rio_t_downstream/rio_t_downstream"
    assert run(program) == "3 -0.5 0.03 0\n"  # forward 2, shifted by 1
