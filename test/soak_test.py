"""What scripts/soak.sh makes of a run."""
import importlib.util
import sys

import numpy
import pytest


@pytest.fixture(name="soak")
def soak_fixture(scripts, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["soak.py"])  # it looks at its arguments before it imports the rest
    spec = importlib.util.spec_from_file_location("soak", scripts.parent / "bench/soak.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("seconds, passes", [
    (600.0, True), (595.0, True),  # at ten times real time: half a second on the clock of the wall
    (300.0, False), (30.0, False)])
def test_a_run_that_ends_early_fails(soak, seconds, passes):
    time = numpy.arange(0.0, seconds + 0.1, 5.0)
    # 200 MB; 200 samples of the IMU and 10 scans a second, which take 0.1 and 5 ms.
    record = numpy.stack([time, 0 * time + 200.0, 200 * time, 20 * time, 10 * time, 50 * time], -1)
    newest = {"input": {"scans": 6000, "scans_used": 6000}, "solver": {"updates": 6000}, "odometry": {"resets": "0"}}
    assert soak.judge(record, newest, 600.0, 10.0) == passes
