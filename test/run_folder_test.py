"""What rio_t_bag writes is read as it was meant, and what is wrong in it is named."""
import shutil

import numpy
import pytest

from rio_t import run_folder, tum
from rio_t.errors import RioTError

LINE = ",".join(str(i) for i in range(1, 13)) + "\n"
HEADER = run_folder.COLUMNS["navigation.csv"] + "\n"


def test_a_real_run_is_read(simulated_run):
    folder = simulated_run / "run"
    summary = run_folder.read_yaml(folder / "summary.yaml")
    offsets, scans = run_folder.read(folder, "time_offset.csv"), run_folder.read(folder, "ego_velocity.csv")
    assert offsets["offset_s"][-1] == pytest.approx(summary["final_offset_s"], abs=1e-8)
    assert offsets["stamp"].dtype == numpy.int64
    assert len(scans["stamp"]) == summary["scans_total"]
    assert numpy.isin(scans["status"], ["moving", "zero_velocity"]).sum() == summary["scans_used"]
    assert set(run_folder.read(folder, "biases.csv")) == set("stamp bgx bgy bgz bax bay baz".split())
    navigation = run_folder.read_navigation(folder)
    assert set(navigation.poses.stamp) <= set(tum.read(folder / "trajectory.txt").stamp)
    assert navigation.sigmas.shape == (len(navigation.poses), 9)
    assert (navigation.sigmas > 0).all()


def test_a_run_of_two_radars_is_read(two_radar_run, tmp_path):
    folder = shutil.copytree(two_radar_run / "run", tmp_path / "run")
    assert run_folder.radars(folder) == ["left", "right"]
    summary = run_folder.read_yaml(folder / "summary.yaml")
    for radar in ("left", "right"):
        offsets = run_folder.read(folder, "time_offset.csv", radar)
        assert offsets["offset_s"][-1] == pytest.approx(summary[f"final_offset_s_{radar}"], abs=1e-8)
        scans = run_folder.read(folder, "ego_velocity.csv", radar)
        assert len(scans["stamp"]) == summary[f"scans_total_{radar}"]
        extrinsics = run_folder.read(folder, "extrinsics.csv", radar)
        assert [extrinsics["q" + k][-1] for k in "xyzw"] == summary[f"final_extrinsics_rotation_xyzw_{radar}"]
        assert [extrinsics["sigma_r" + k][-1] for k in "xyz"] == summary[f"final_extrinsics_rotation_sigma_{radar}"]
        assert (extrinsics["sigma_x"] == 0).all()
    assert summary["final_offset_s_right"] - summary["final_offset_s_left"] == pytest.approx(0.02, abs=2e-3)
    (folder / "summary.yaml").unlink()  # the run did not finish
    assert run_folder.radars(folder) == ["left", "right"]


def test_one_radar_has_no_name(simulated_run, tmp_path):
    assert run_folder.radars(simulated_run / "run") == [""]
    assert run_folder.radars(tmp_path) == [""]
    assert run_folder.of_radar("time_offset.csv", "") == "time_offset.csv"
    assert run_folder.of_radar("time_offset.csv", "left") == "time_offset_left.csv"
    assert run_folder.of_radar("final_offset_s", "left") == "final_offset_s_left"


def test_files_of_another_run_are_not_radars_of_this(two_radar_run, tmp_path):
    folder = shutil.copytree(two_radar_run / "run", tmp_path / "run")
    (folder / "ego_velocity_old.csv").write_text("")
    assert run_folder.radars(folder) == ["left", "right"]


def test_each_line_of_navigation_gets_its_pose(tmp_path):
    # The stamp 2 comes twice: the bag looped.
    poses = [(1, 10), (2, 20), (3, 30), (2, 40), (3, 50)]
    (tmp_path / "trajectory.txt").write_text("".join(f"{stamp} {x} 0 0 0 0 0 1\n" for stamp, x in poses))
    (tmp_path / "navigation.csv").write_text(HEADER + "".join(f"{stamp},{LINE}" for stamp in (2, 3, 2)))
    navigation = run_folder.read_navigation(tmp_path)
    assert navigation.poses.position[:, 0].tolist() == [20, 30, 40]
    assert navigation.velocity[0].tolist() == [1, 2, 3]
    assert navigation.sigmas[0].tolist() == list(range(4, 13))
    (tmp_path / "navigation.csv").write_text(HEADER + f"2.5,{LINE}")
    with pytest.raises(RioTError, match="navigation.csv has a stamp that trajectory.txt has not"):
        run_folder.read_navigation(tmp_path)


def test_a_run_that_never_initialised_has_empty_tables(tmp_path):
    (tmp_path / "trajectory.txt").write_text("")
    (tmp_path / "navigation.csv").write_text(HEADER)
    assert len(run_folder.read_navigation(tmp_path).poses) == 0


@pytest.mark.parametrize("text, message", [
    ("", "time_offset.csv:1: no column 'stamp'; expected the header `stamp,offset_s,sigma_s`"),
    ("stamp,offset_s\n1,2\n", "time_offset.csv:1: no column 'sigma_s'"),
    ("stamp,offset_s,sigma_s\n1,2,3\n4,x,6\n", "time_offset.csv:3: offset_s is 'x', expected a number"),
    ("stamp,offset_s,sigma_s\n1,2\n", "time_offset.csv:2: sigma_s is 'None', expected a number"),
    ("stamp,offset_s,sigma_s\nnan,2,3\n", "time_offset.csv:2: stamp is 'nan', expected a number")])
def test_a_broken_table_is_told(simulated_run, tmp_path, text, message):
    shutil.copytree(simulated_run / "run", tmp_path, dirs_exist_ok=True)
    (tmp_path / "time_offset.csv").write_text(text)
    with pytest.raises(RioTError) as told:
        run_folder.read(tmp_path, "time_offset.csv")
    assert message in str(told.value)


@pytest.mark.parametrize("content, message", [(b"a: [1", "summary.yaml: "), (b"42", "expected `key: value` lines"),
                                              (b"\xff\xfe\x00", "summary.yaml: ")])
def test_a_broken_summary_is_told_in_one_line(tmp_path, content, message):
    (tmp_path / "summary.yaml").write_bytes(content)
    with pytest.raises(RioTError) as told:
        run_folder.read_yaml(tmp_path / "summary.yaml")
    assert message in str(told.value)
    assert "\n" not in str(told.value)
