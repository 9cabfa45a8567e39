"""The fault campaign itself: it puts a fault into a bag, and judges the run."""
import os
import sys
import types

import numpy
import pytest

from rio_t import programs
from rio_t.faults import judge, main
from rio_t.faults.expectations import Refuses, RefusesOrReports, Survives

MUST = Survives(0.3, 0.6, counted=("imu_gap",), grows=2.0)


def outcome(status=0, velocity=0.2, after=0.1, sigma=0.3, used=2, faults=("imu_gap",), ends=40.0, not_a_number=(),
            usual=()):
    """Of a run of 40 s with a fault from 10 to 20 s."""
    time = numpy.arange(0.0, 40.0, 0.1)
    during, ones = (time >= 10.0) & (time < 20.0), numpy.ones(len(time))

    def errors(velocity, after, sigma):
        return judge.Errors(time, numpy.where(during, velocity, after), 0.1 * ones, numpy.where(during, sigma, 0.1), ones, ones)

    summary = {"scans_total": 3, "scans_used": used, "scans_rejected": {"innovation": 1},
               "input_faults": {fault: 1 for fault in faults}}
    return judge.Outcome(status, "rio_t_bag: what it says", summary, list(not_a_number), types.SimpleNamespace(time=[ends]),
                         errors(velocity, after, sigma), errors(0.1, 0.1, 0.1), last_imu=40.0, length=40.0,
                         usual={"input_faults": {fault: 1 for fault in usual}})


def test_a_run_as_it_must_be_passes():
    assert MUST.judge(outcome(), 10.0, 20.0)[1] == []


@pytest.mark.parametrize("change, wrong", [
    ({"velocity": 0.5}, "velocity error 0.50 m/s"), ({"after": 0.25}, "not recovered"), ({"sigma": 0.15}, "sigma grew 1.5 times"),
    ({"used": 1}, "3 scans came, 2 accounted for"), ({"faults": ()}, "imu_gap not counted"),
    ({"usual": ("imu_gap",)}, "imu_gap not counted"),
    ({"ends": 39.0}, "output ends 1.0 s before the IMU"), ({"not_a_number": ["a.csv"]}, "nan or inf in a.csv"),
    ({"status": 1}, "does not run"), ({"status": None}, "does not run"), ({"status": -11}, "does not run")])
def test_a_run_as_it_must_not_be_fails(change, wrong):
    happened, (told,) = MUST.judge(outcome(**change), 10.0, 20.0)
    assert wrong in told
    if "status" in change:
        assert "what it says" in happened


def test_an_input_that_must_be_refused():
    assert Refuses("what it").judge(outcome(1), 0.0, 1.0)[1] == []
    assert Refuses("what it").judge(outcome(0), 0.0, 1.0)[1] == ["exit status 0"]
    assert Refuses("units").judge(outcome(1), 0.0, 1.0)[1] == ["does not say so"]
    assert RefusesOrReports("units").judge(outcome(0), 0.0, 1.0)[1] == ["an estimate from such input, without a word"]


def test_a_case_that_fails_is_the_exit_status(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(main, "run", lambda *_: [("a", "b", "must", "what happened", []), ("c", "b", "must", "else", ["wrong"])])
    assert main.main(["--no-live", "--output-dir", str(tmp_path)]) == 1
    assert "1 of 2 cases pass" in capsys.readouterr().out
    assert "**FAIL**: wrong" in (tmp_path / "table.md").read_text()


def test_the_run_without_the_fault_is_made_anew(monkeypatch, tmp_path):
    for name in ("usual_", "bag_loop"):
        (tmp_path / "simulated" / name).mkdir(parents=True)
    monkeypatch.setattr(main, "run", lambda *_: [("a", "b", "must", "what happened", [])])
    assert main.main(["--no-live", "--output-dir", str(tmp_path)]) == 0
    assert [path.name for path in (tmp_path / "simulated").iterdir()] == ["bag_loop"]


def test_a_campaign_without_a_case_fails(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(main, "run", lambda *_: [])
    assert main.main(["--no-live", "--output-dir", str(tmp_path)]) == 1
    for more in ([], ["--check"]):
        with pytest.raises(SystemExit) as ended:
            main.main(["--no-live", "--only", "live_bag_loops", *more])
        assert ended.value.code == 2
        assert "no case is left: live_bag_loops run live, and --no-live leaves out" in capsys.readouterr().err


def test_a_case_is_judged(scripts, programs_folder, tmp_path):
    # Without data, on the simulated bag alone.
    environment = {**os.environ, "RIO_T_DATA_DIR": str(tmp_path), "TMPDIR": str(tmp_path)}
    done = programs.run(sys.executable, scripts / "faults.py", "--no-live", "--only", "bag_loop", "--only", "imu_in_g",
                        "--only", "scan_before_imu", "--jobs", 1, "--programs", programs_folder, env=environment)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "3 of 3 cases pass" in done.stdout
    assert list(tmp_path.iterdir()) == [], "temporary files left behind"
