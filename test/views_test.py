"""The views of other tools: each reads as its format, and names topics and fields that the live node publishes."""
import ast
import json
import pathlib
import re
import xml.etree.ElementTree

import pytest
import yaml
from geometry_msgs.msg import TwistWithCovarianceStamped
from nav_msgs.msg import Odometry

from rio_t import live_tester

SOURCE = pathlib.Path(__file__).resolve().parents[1]


def field(path):
    """What `/rio_t/time_offset/offset` names in a message of its topic; raises if there is none."""
    _, node, topic, *names = path.split("/")
    assert node == "rio_t"
    value = live_tester.TOPICS[topic]()
    for name in names:
        array = re.fullmatch(r"(\w+)\[(\d+);(\d+)\]", name)  # PlotJuggler's covariance of six by six
        value = getattr(value, array[1])[6 * int(array[2]) + int(array[3])] if array else getattr(value, name)
    return value


def test_plotjuggler_layout():
    root = xml.etree.ElementTree.parse(SOURCE / "config" / "plotjuggler.xml").getroot()
    curves = [curve.get("name") for curve in root.iter("curve")]
    assert {curve.split("/")[2] for curve in curves} == {"time_offset", "innovation", "odom", "ego_velocity"}
    assert all(isinstance(field(curve), (bool, int, float)) for curve in curves)
    assert {topic.get("name") for topic in root.iter("topic")} == {"/".join(curve.split("/")[:3]) for curve in curves}


def test_rqt_perspective():
    groups = json.loads((SOURCE / "rviz" / "rio_t.perspective").read_text())["groups"]["pluginmanager"]
    running = ast.literal_eval(groups["keys"]["running-plugins"]["repr"])
    plots = [groups["groups"][f"plugin__rqt_plot__Plot__{k}"] for k in running["rqt_plot/Plot"]]
    topics = [topic for plot in plots for topic in ast.literal_eval(plot["groups"]["plugin"]["keys"]["topics"]["repr"])]
    assert len(topics) > 6
    assert all(isinstance(field(topic), float) for topic in topics)


def test_the_aggregator_and_the_docs_know_every_status():
    source = (SOURCE / "src" / "ros" / "live" / "live_odometry.cpp").read_text()
    names = re.findall(r'diagnostics_->add\(\s*(?:withName\()?"([^"]+)"', source)
    rates = re.findall(r'diagnostics_->add\((?:\*radar\.)?\w+_rate_?\)', source)
    assert len(names) + len(rates) == source.count("diagnostics_->add(") and len(names) > 6 and rates
    analyzers = yaml.safe_load((SOURCE / "config" / "diagnostics" / "aggregator.yaml").read_text())["analyzers"]
    shown = {start for group in analyzers["rio_t"]["analyzers"].values() for start in group["startswith"]}
    assert shown == {f"rio_t: {name}" for name in names} | {"rio_t: /"}, "the last one is for the topics"
    page = (SOURCE / "docs" / "ros.md").read_text()
    assert not [name for name in names if f"\n| {name} | " not in page]


def test_a_field_that_does_not_exist_is_found():
    with pytest.raises((AttributeError, KeyError)):
        field("/rio_t/time_offset/offsett")


@pytest.mark.parametrize("source, key, kind", [("odometry", "odom0", Odometry), ("velocity", "twist0", TwistWithCovarianceStamped)])
def test_robot_localization_is_fed_with_topics_of_its_kinds(source, key, kind):
    """Robot_localization is not in Debian: the contract of its parameters and messages is what we can check."""
    values = yaml.safe_load((SOURCE / "launch" / "examples" / f"ekf_{source}.yaml").read_text())
    node, topic = values[key].split("/")
    assert node == "rio_t" and live_tester.TOPICS[topic] is kind
    assert {values["odom_frame"], values["base_link_frame"]} == {"odom", "base_link"}
    rows = values[key + "_config"]
    assert len(rows) == 15 and any(rows[6:9]), "the velocity is what a radar gives"
    if kind is TwistWithCovarianceStamped:
        assert not any(rows[9:12]), "the radar does not know the angular velocity"
