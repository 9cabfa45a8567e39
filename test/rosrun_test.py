"""rosrun finds each program, and once."""
import os
import pathlib
from xml.etree import ElementTree

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
    assert "Example" in done.stdout
    version = ElementTree.parse(SOURCE / "package.xml").findtext("version")
    done = programs.run("rosrun", "rio_t", program, "--version", stdin=None)
    assert (done.returncode, done.stdout.strip()) == (0, f"{program} of rio_t {version}")
