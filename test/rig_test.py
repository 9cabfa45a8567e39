"""The drawing of a rig."""
import sys

from rio_t import programs


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
