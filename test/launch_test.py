"""The launch files: their arguments, what they refuse, and what they put on the parameter server."""
import os
import shutil
import socket
import subprocess
import xml.etree.ElementTree as ElementTree

import pytest
import yaml
from conftest import SOURCE

from rio_t import launch_config
from rio_t.errors import RioTError

LAUNCH = SOURCE / "launch"
SENSORS = ("irs", "ti_mmwave", "two_radars")


def roslaunch(*words, folder=None):
    environment = {**os.environ, "PWD": str(folder or os.getcwd())}
    return subprocess.run(["roslaunch", *map(str, words)], cwd=folder, env=environment, text=True, capture_output=True,
                          check=False)


def parameters(*words, **options):
    done = roslaunch("--dump-params", *words, **options)
    assert done.returncode == 0, done.stderr
    return yaml.safe_load(done.stdout) or {}


def arguments(name):
    root = ElementTree.parse(LAUNCH / f"{name}.launch").getroot()
    return {arg.get("name"): arg.attrib for arg in root.findall("arg") if arg.get("value") is None}


@pytest.mark.parametrize("name", SENSORS)
def test_launch_files_of_sensors_have_all_arguments_of_the_general_one(name):
    general, ours = arguments("rio_t"), arguments(name)
    assert ours.pop("config")["default"] == name
    general.pop("config")
    if name == "two_radars":
        assert ours.pop("rviz_config")["default"].endswith("two_radars.rviz")
        general.pop("rviz_config")
    assert ours == general


@pytest.mark.parametrize("name", (*SENSORS, "rio_t", "bag"))
def test_every_argument_says_what_it_is_for(name):
    assert all(attributes.get("doc") for attributes in arguments(name).values())


def test_a_misspelt_argument_is_refused_with_the_right_one():
    done = roslaunch("--nodes", "rio_t", "irs.launch", "bga:=run.bag")
    assert "irs.launch has no argument bga:= ; did you mean bag:= ?" in done.stderr
    assert "/rio_t" not in done.stdout
    done = roslaunch("--nodes", LAUNCH / "bag.launch", "bag:=x", "output_dir:=y", "setings:=1")
    assert "bag.launch has no argument setings:=" in done.stderr


def test_special_names_and_launch_files_of_others_pass():
    launch_config.check_arguments(["roslaunch", "rio_t", "irs.launch", "bag:=x", "__ns:=robot", "_private:=1"], LAUNCH)
    launch_config.check_arguments(["roslaunch", "my_robot", "bringup.launch", "anything:=1"], LAUNCH)
    launch_config.check_arguments(["rostest", "live.test"], LAUNCH)
    # Ours have usual names.
    launch_config.check_arguments(["roslaunch", "my_robot", "irs.launch", "anything:=1"], LAUNCH)
    launch_config.check_arguments(["roslaunch", "/home/me/irs.launch", "anything:=1"], LAUNCH)
    with pytest.raises(RioTError):
        launch_config.check_arguments(["roslaunch", str(LAUNCH / "irs.launch"), "anything:=1"], LAUNCH)


def test_somebody_elses_launch_file_may_not_misspell_an_argument(tmp_path):
    mine = tmp_path / "mine.launch"
    mine.write_text('<launch><include file="$(find rio_t)/launch/irs.launch"><arg name="bga" value="x"/></include></launch>')
    assert "bga" in roslaunch("--nodes", mine).stderr
    mine.write_text('<launch><include file="$(find rio_t)/launch/irs.launch"><arg name="imu_topic" value="/i"/></include></launch>')
    assert parameters(mine, "mine:=1") == {"/rio_t/config": "irs", "/rio_t/imu_topic": "/i"}


def test_two_robots_share_neither_frame_nor_file():
    given = parameters(LAUNCH / "examples" / "two_robots.launch")
    for key in ("odom_frame", "base_link_frame", "radar_frame", "trajectory_file"):
        assert given[f"/robot1/rio_t/{key}"] != given[f"/robot2/rio_t/{key}"], key


def test_config_is_a_name_or_a_path_from_where_the_user_stands(tmp_path):
    (tmp_path / "sub").mkdir()
    own = tmp_path / "sub" / "own.yaml"
    own.write_text("gravity: 9.8\n")

    def path_of(name, folder):
        return launch_config.config_path(name, folder, SOURCE / "config")

    assert path_of("irs", tmp_path) == "irs"
    assert path_of("irs.yaml", tmp_path) == "irs.yaml"
    assert path_of("sub/own.yaml", tmp_path) == str(own)
    assert path_of("own.yaml", tmp_path / "sub") == str(own)
    assert path_of(str(own), "/") == str(own)
    (tmp_path / "irs").mkdir()
    assert path_of("irs", tmp_path) == "irs"  # a folder is no configuration
    with pytest.raises(RioTError, match="none.yaml"):
        path_of("sub/none.yaml", tmp_path)
    with pytest.raises(RioTError, match="config:=isr: .*, irs, "):
        path_of("isr", tmp_path)
    assert parameters("rio_t", "irs.launch", "config:=sub/own.yaml", folder=tmp_path) == {"/rio_t/config": str(own)}
    (tmp_path / "b").touch()
    assert parameters("rio_t", "bag.launch", "bag:=b", "output_dir:=o", "config:=sub/own.yaml",
                      folder=tmp_path) == {"/rio_t_bag/config": str(own)}


@pytest.mark.parametrize("words", [("irs.launch",), ("bag.launch", "bag:=b", "output_dir:=o")])
def test_a_configuration_that_is_not_there_is_refused(words):
    done = roslaunch("--nodes", "rio_t", *words, "config:=isr")
    assert "rio_t: config:=isr: there is no file" in done.stderr
    assert "/rio_t" not in done.stdout


@pytest.mark.parametrize("name", (*SENSORS, "rio_t", "bag"))
def test_an_argument_without_a_default_says_that_it_is_optional(name):
    """roslaunch --ros-args lists them among those that are required."""
    for attributes in arguments(name).values():
        assert (attributes.get("default") == "") == attributes["doc"].startswith("Optional. "), attributes


@pytest.mark.parametrize("word", ("bag_rate:=0", "bag_rate:=fast", "clock_hz:=-1", "bag_start:=-1", "bag_start:=nan"))
def test_a_number_that_the_player_would_refuse_is_refused(word):
    with pytest.raises(RioTError, match=f"{word}: expected a number"):
        launch_config.check_player(["roslaunch", "rio_t", "irs.launch", word])
    launch_config.check_player(["roslaunch", "rio_t", "irs.launch", "bag_rate:=0.5", "bag_start:=0", "clock_hz:=1e3"])


@pytest.mark.parametrize("name", sorted(file.name for file in (LAUNCH / "examples").glob("*.launch")))
def test_examples_refuse_what_the_others_refuse(name, tmp_path):
    assert "mavros.launch has no argument" in roslaunch("--nodes", "rio_t", "mavros.launch", "cnfig:=irs").stderr
    done = roslaunch("--nodes", "rio_t", name, "config:=isr", folder=tmp_path)
    assert "rio_t: config:=isr: there is no file" in done.stderr


@pytest.mark.parametrize("with_config", (False, True))
@pytest.mark.parametrize("name", sorted(file.name for file in (LAUNCH / "examples").glob("*.launch")))
def test_an_example_that_was_copied_into_another_package_finds_our_configurations(name, with_config, tmp_path):
    package = tmp_path / "my_robot"
    (package / "launch").mkdir(parents=True)
    shutil.copy(LAUNCH / "examples" / name, package / "launch")
    if with_config:
        (package / "config").mkdir()
        (package / "config" / "own.yaml").touch()
    given = parameters(package / "launch" / name, folder=tmp_path)
    assert {value for key, value in given.items() if key.endswith("rio_t/config")} == {"irs"}
    refused = roslaunch("--nodes", package / "launch" / name, "config:=isr", folder=tmp_path).stderr
    assert "config:=isr: there is no file" in refused and "the package has" in refused and " irs," in refused


def test_a_bag_that_is_not_there_is_refused(tmp_path):
    done = roslaunch("--nodes", "rio_t", "bag.launch", "bag:=nope.bag", "output_dir:=o", folder=tmp_path)
    assert "rio_t: bag nope.bag: no such file" in done.stderr
    for bag, path in (("nope.bag", tmp_path / "nope.bag"), (tmp_path, tmp_path)):
        done = roslaunch("--nodes", "rio_t", "irs.launch", f"bag:={bag}", folder=tmp_path)
        assert f"rio_t: bag {path}: no such file" in done.stderr
        assert "/rio_t" not in done.stdout
    (tmp_path / "my run.bag").touch()
    assert "/rio_t" in roslaunch("--nodes", "rio_t", "irs.launch", "bag:=my run.bag", folder=tmp_path).stdout


def test_bag_launch_knows_the_home_folder(simulated_run, tmp_path, monkeypatch):
    home, away = tmp_path / "my home", tmp_path / "away"
    home.mkdir()
    away.mkdir()
    (home / "run.bag").symlink_to(simulated_run / "run.bag")
    shutil.copy(SOURCE / "config" / "irs.yaml", home / "own.yaml")
    monkeypatch.setenv("HOME", str(home))
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    done = roslaunch("-p", port, "rio_t", "bag.launch", "bag:=~/run.bag", "config:=~/own.yaml", "output_dir:=~/2024",
                     folder=away)
    assert (home / "2024" / "summary.yaml").is_file(), done.stderr
    assert not list(away.iterdir())


def test_namespace_and_topics_reach_the_node_and_the_bag(tmp_path):
    (tmp_path / "run.bag").touch()
    words = ("rio_t", "irs.launch", "ns:=robot", "bag:=run.bag", "radar_topic:=scan", "clock_hz:=200", "bag_args:=--loop")
    assert parameters(*words, folder=tmp_path) == {"/use_sim_time": True, "/robot/rio_t/config": "irs",
                                                   "/robot/rio_t/radar_topic": "scan"}
    assert roslaunch("--nodes", *words, "nodelet:=true", "rviz:=true", folder=tmp_path).stdout.split() == [
        "/bag_player", "/robot/rio_t_manager", "/robot/rio_t", "/robot/rviz"]
    play = roslaunch("--args", "bag_player", *words, folder=tmp_path).stdout
    assert "--prefix=robot" in play and "--hz=200" in play and "--loop" in play and str(tmp_path / "run.bag") in play


def test_topics_of_the_bag_can_be_chosen(tmp_path):
    (tmp_path / "run.bag").touch()
    play = roslaunch("--args", "bag_player", "rio_t", "irs.launch", "bag:=run.bag", "bag_topics:=/a /b", folder=tmp_path).stdout
    assert "--topics /a /b --bags" in play


def test_a_bag_played_into_a_namespace_keeps_its_tf(tmp_path):
    """tf2 listens to /tf and /tf_static in every namespace."""
    (tmp_path / "run.bag").touch()

    def remappings(*words):
        play = roslaunch("--args", "bag_player", "rio_t", "irs.launch", "bag:=run.bag", *words, folder=tmp_path).stdout
        assert "/run.bag" in play
        return {word for word in play.split() if ":=/" in word}
    for namespace in ("robot", "/robot"):
        assert remappings("ns:=" + namespace) == {f"{namespace}/tf:=/tf", f"{namespace}/tf_static:=/tf_static"}
    assert remappings() == set()
