"""Finds and runs the programs of rio_t."""
import os
import pathlib
import subprocess
import sys
import tempfile

from .errors import RioTError


# Exit statuses of a program that has a result. NOT_TRUSTED: summary.yaml says why not to trust it.
OK, NOT_TRUSTED = HAS_RESULT = (0, 3)


def find(names, option, given=None):
    """Folder that holds the programs: the given one, else beside the script, in a sourced workspace or in the build
    folder. `option` is what the user can give."""
    source = pathlib.Path(__file__).resolve().parents[2]
    # Absolute, because pathlib drops "./", and a name without a folder is looked up in PATH.
    candidates = [pathlib.Path(given).resolve()] if given else [
        pathlib.Path(sys.argv[0]).resolve().parent,
        *(pathlib.Path(p) / "lib" / "rio_t" for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(":") if p),
        source / os.environ.get("RIO_T_BUILD_DIR", "build") / "devel" / "lib" / "rio_t"]
    for folder in candidates:
        if all(is_program(folder / name) for name in names):
            return folder
    raise RioTError(f"not found: {' and '.join(names)}; run scripts/build.sh, source the setup.bash of a workspace, or "
                    f"give {option}")


def is_program(path):
    return path.is_file() and os.access(path, os.X_OK)


def run(*words, **options):
    """The completed process, with its output as text."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run([str(word) for word in words], text=True, check=False, **options)


def exit_code(status):
    """As os.waitstatus_to_exitcode, which Python 3.8 of ROS Noetic lacks."""
    return -os.WTERMSIG(status) if os.WIFSIGNALED(status) else os.WEXITSTATUS(status)


def usage_of(*words):
    """The resources (os.wait4) that a program with a result took."""
    with tempfile.TemporaryFile("w+") as errors, subprocess.Popen(
            [str(word) for word in words], stdout=subprocess.DEVNULL, stderr=errors) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = exit_code(status)
        if process.returncode not in HAS_RESULT:
            errors.seek(0)
            # After what went wrong come the likely causes.
            lines = [line.strip() for line in errors if ": warning: " not in line]
            raise RioTError(" ".join(lines).strip() or f"{words[0]} ended with status {process.returncode}")
    return usage


def cpu_seconds_of(*words):
    """CPU time [s], user and system, of a program that has a result. Other programs beside it do not count."""
    usage = usage_of(*words)
    return usage.ru_utime + usage.ru_stime


def output_of(*words):
    """The stdout of a program that has a result."""
    done = run(*words)
    if done.returncode not in HAS_RESULT:
        raise RioTError(done.stderr.strip() or f"{words[0]} ended with status {done.returncode}")
    return done.stdout
