"""The fault campaign itself: it puts a fault into a bag, and judges the run."""
import os
import sys

from rio_t import programs


def test_a_case_is_judged(scripts, programs_folder, tmp_path):
    # Without data, on the simulated bag alone.
    done = programs.run(sys.executable, scripts / "faults.py", "--no-live", "--only", "bag_loop", "--only", "imu_in_g",
                        "--jobs", 1, "--programs", programs_folder, env={**os.environ, "RIO_T_DATA_DIR": str(tmp_path)})
    assert done.returncode == 0, done.stdout + done.stderr
    assert "2 of 2 cases pass" in done.stdout
