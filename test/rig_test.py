"""The drawing of a rig."""
import sys

import numpy
import pytest
from scipy.spatial.transform import Rotation

from rio_t import programs, rig
from rio_t.plots import pyplot


@pytest.mark.parametrize("given", [(30, 20, -10), (-120, -40, 170)])
def test_its_angles_are_those_of_the_configuration(programs_folder, tmp_path, given):
    (tmp_path / "my.yaml").write_text(f"mounting_yaw_pitch_roll_deg: {list(given)}\n")
    ((_, _, rotation),) = rig.radars_of(rig.read_config(programs_folder, tmp_path / "my.yaml"))
    assert rig.angles(rotation) == pytest.approx(given)


def test_from_above_left_is_left_and_forward_is_up(monkeypatch, tmp_path):
    figures = []
    monkeypatch.setattr(pyplot, "close", figures.append)
    forward = Rotation.from_euler("z", -90, degrees=True)
    rig.draw([("left", numpy.array([0.3, 0.4, 0.0]), forward)], tmp_path / "rig.png")
    monkeypatch.undo()
    pyplot.close(figures[-1])
    # From the right, forward is to the right. The arrow is 0.7 times as long as the lever arm.
    for axes, sits, looks_at in zip(figures[-1].axes, ([-0.4, 0.3], [0.3, 0.0]), ([-0.4, 0.65], [0.65, 0.0])):
        (place,) = (line.get_xydata()[0] for line in axes.get_lines() if line.get_label().startswith("left"))
        assert place.tolist() == sits
        (tip,) = (text.xy for text in axes.texts if (text.arrowprops or {}).get("linewidth") == 2)
        assert tip == pytest.approx(looks_at)


def test_it_is_drawn(scripts, programs_folder, tmp_path):
    out = tmp_path / "rig.png"
    done = programs.run(sys.executable, scripts / "draw_rig.py", "--config", "two_radars", "--out", out,
                        "--programs", programs_folder)
    assert done.returncode == 0, done.stderr
    assert out.read_bytes().startswith(b"\x89PNG")


def test_a_folder_that_is_not_there_is_named(scripts, programs_folder, tmp_path):
    out = tmp_path / "none" / "rig.png"
    done = programs.run(sys.executable, scripts / "draw_rig.py", "--config", "two_radars", "--out", out,
                        "--programs", programs_folder)
    assert done.returncode == 1
    assert done.stderr == f"draw_rig.py: --out {out}: there is no folder {out.parent}\n"


def test_a_mounting_that_comes_from_tf_is_told(scripts, programs_folder, tmp_path):
    (tmp_path / "my.yaml").write_text("radars: [left, right]\nleft: {radar_topic: /left}\n"
                                      "right: {radar_topic: /right, extrinsics_source: tf}\n")
    done = programs.run(sys.executable, scripts / "draw_rig.py", "--config", tmp_path / "my.yaml", "--out",
                        tmp_path / "rig.png", "--programs", programs_folder)
    assert done.returncode == 1
    assert done.stderr == (f"draw_rig.py: --config {tmp_path / 'my.yaml'}: the mounting of right comes from tf "
                           "(extrinsics_source: tf); expected extrinsics_source: parameters with extrinsics_translation "
                           "and extrinsics_rotation_xyzw\n")
