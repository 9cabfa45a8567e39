"""What the tests of the Python package share."""
import pathlib
import sys

import pytest

SOURCE = pathlib.Path(__file__).resolve().parents[1]
sys.path.insert(0, str(SOURCE / "src"))
from rio_t import programs  # noqa: E402


@pytest.fixture(scope="session")
def scripts():
    return SOURCE / "scripts"


@pytest.fixture(scope="session")
def programs_folder():
    return programs.find(("rio_t_bag", "simulate", "evaluate"), "a sourced workspace")


@pytest.fixture(scope="session")
def simulated_run(programs_folder, tmp_path_factory):
    """Folder with what rio_t_bag wrote of a short simulated bag (`run`) and with the truth (`truth.txt`)."""
    folder = tmp_path_factory.mktemp("simulated")
    programs.output_of(programs_folder / "simulate", "--motion", "easy", "--seed", 1, "--duration", 25,
                       "--time-offset", 0.03, "--out", folder / "run.bag", "--ground-truth", folder / "truth.txt")
    programs.output_of(programs_folder / "rio_t_bag", "--bag", folder / "run.bag", "--config", "irs", "--output-dir",
                       folder / "run")
    return folder
