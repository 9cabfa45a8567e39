"""rosrun finds each program, and once."""
import os
import pathlib

import pytest

from rio_t import programs

SOURCE = pathlib.Path(__file__).resolve().parents[1]
BUILD = SOURCE / os.environ.get("RIO_T_BUILD_DIR", "")


@pytest.mark.skipif(BUILD != SOURCE and SOURCE in BUILD.parents, reason="rosrun finds another devel space in the sources")
@pytest.mark.parametrize("program", ["rio_t_bag", "calibrate", "check_bag", "evaluate", "simulate", "draw_rig.py",
                                     "experiment.py", "report.py"])
def test_program_is_found(program):
    done = programs.run("rosrun", "rio_t", program, "--help", stdin=None)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "usage" in done.stdout.lower()
