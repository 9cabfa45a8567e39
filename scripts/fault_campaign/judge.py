"""What a run of the bag runner on a faulty bag came to, in figures that expectations are about."""
import csv
import dataclasses
import math
import pathlib
import re

import numpy
import yaml

NOT_A_NUMBER = re.compile(r"(?<![a-z_])[-+]?\.?(nan|inf)(?![a-z_])", re.IGNORECASE)


def columns(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    return numpy.array([[float(value) for value in row] for row in rows[1:]]).reshape(-1, len(rows[0]))


def rotations(xyzw):
    x, y, z, w = (xyzw / numpy.linalg.norm(xyzw, axis=1, keepdims=True)).T
    return numpy.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
                        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=1).reshape(-1, 3, 3)


@dataclasses.dataclass
class States:
    """Position and velocity in a world of its own, attitude, and standard deviations of p (in W) and v (in W)."""
    time: numpy.ndarray
    p: numpy.ndarray
    R: numpy.ndarray
    v: numpy.ndarray
    sigma_p: numpy.ndarray = None
    sigma_v: numpy.ndarray = None


def read_run(folder):
    """The causal output where it is written with its uncertainty: ten times a second."""
    poses = numpy.loadtxt(pathlib.Path(folder) / "trajectory.txt", ndmin=2)
    table = columns(pathlib.Path(folder) / "navigation.csv")
    if len(table) == 0:
        return None
    # Both are in the order of output, in which a stamp may come twice (a bag that loops).
    rows, row = [], 0
    for stamp in table[:, 0]:
        while abs(poses[row, 0] - stamp) > 1e-7:
            row += 1
        rows.append(row)
    return States(table[:, 0], poses[rows, 1:4], rotations(poses[rows, 4:8]), table[:, 1:4], table[:, 4:7],
                  table[:, 10:13])


def read_truth(path):
    """TUM file of a simulated motion."""
    poses = numpy.loadtxt(path, ndmin=2)
    return States(poses[:, 0], poses[:, 1:4], rotations(poses[:, 4:8]),
                  numpy.gradient(poses[:, 1:4], poses[:, 0], axis=0))


def shifted_back(run, shift):
    """Undoes a jump by `shift` seconds of the stamps of the output, so that it can be compared with a reference."""
    steps = numpy.diff(run.time)
    jumps = numpy.flatnonzero((steps > 0.5 * shift) if shift > 0 else (steps < 0.1 * shift))
    time = run.time.copy()
    if len(jumps):
        time[jumps[0] + 1:] -= shift
    return dataclasses.replace(run, time=time)


def at(reference, times):
    """The reference at these times; the nearest entry for the attitude, which is close enough."""
    def interpolate(values):
        return numpy.stack([numpy.interp(times, reference.time, values[:, k]) for k in range(3)], axis=1)
    after = numpy.clip(numpy.searchsorted(reference.time, times), 1, len(reference.time) - 1)
    nearest = after - (times - reference.time[after - 1] < reference.time[after] - times)
    return States(times, interpolate(reference.p), reference.R[nearest], interpolate(reference.v))


@dataclasses.dataclass
class Errors:
    """Against the reference, at `time` [s] after the first message."""
    time: numpy.ndarray
    velocity: numpy.ndarray       # [m/s] norm, compared in the body frame, so that a turned world does not count
    position: numpy.ndarray       # [m] norm, origins and yaw aligned
    velocity_sigma: numpy.ndarray  # [m/s] of the estimate, root of the sum of variances
    position_sigma: numpy.ndarray  # [m] likewise
    ratio: numpy.ndarray          # largest |error| / sigma over the axes of p and v

    def part(self, begin, end):
        keep = (self.time >= begin) & (self.time < end)
        return Errors(*(getattr(self, f.name)[keep] for f in dataclasses.fields(self)))


def errors_against(reference, run, origin):
    """`origin`: stamp of the first message [s]. None where the two share no time."""
    keep = (run.time >= reference.time[0]) & (run.time <= reference.time[-1])
    if not keep.any():
        return None
    run = States(*(getattr(run, f.name)[keep] for f in dataclasses.fields(run)))
    true = at(reference, run.time)
    turn = run.R[0] @ true.R[0].T
    yaw = math.atan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    Rz = numpy.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    e_p = run.p - run.p[0] - (true.p - true.p[0]) @ Rz.T
    e_v = run.v - true.v @ Rz.T
    body = numpy.einsum("nji,nj->ni", run.R, run.v) - numpy.einsum("nji,nj->ni", true.R, true.v)
    sigma_p, sigma_v = numpy.maximum(run.sigma_p, 1e-9), numpy.maximum(run.sigma_v, 1e-9)
    ratio = numpy.maximum((numpy.abs(e_p) / sigma_p).max(axis=1), (numpy.abs(e_v) / sigma_v).max(axis=1))
    norm = lambda x: numpy.linalg.norm(x, axis=1)
    return Errors(run.time - origin, norm(body), norm(e_p), norm(run.sigma_v), norm(run.sigma_p), ratio)


@dataclasses.dataclass
class Outcome:
    """All that is known of a run."""
    status: int
    messages: str             # stderr
    summary: dict             # summary.yaml, empty without one
    not_a_number: list        # files that hold a nan or inf
    run: States = None
    errors: Errors = None     # against the truth, or the run without the fault
    reference: Errors = None  # of the run without the fault
    last_imu: float = None    # [s] stamp of the last IMU sample, on the time of the bag without fault
    length: float = 0.0       # [s] of the bag without fault
    has_truth: bool = True    # else the fault-free run stands for it

    def counted(self):
        """Every count of something that went wrong."""
        counts = dict(self.summary.get("input_faults") or {})
        for name, count in (self.summary.get("scans_rejected") or {}).items():
            counts[name] = counts.get(name, 0) + count
        if self.summary.get("divergences"):
            counts["diverged"] = self.summary["divergences"]
        return counts


def files_with_nan(folder):
    spoiled = []
    for path in sorted(pathlib.Path(folder).glob("*.*")):
        if path.suffix in (".txt", ".csv", ".yaml") and NOT_A_NUMBER.search(path.read_text()):
            spoiled.append(path.name)
    return spoiled


def read_outcome(folder, status, messages, reference, origin, shift=0.0):
    folder = pathlib.Path(folder)
    summary_file = folder / "summary.yaml"
    summary = yaml.safe_load(summary_file.read_text()) if summary_file.exists() else {}
    outcome = Outcome(status, messages, summary, files_with_nan(folder) if folder.exists() else [])
    if summary:
        outcome.run = read_run(folder)
        if outcome.run is not None and shift != 0.0:
            outcome.run = shifted_back(outcome.run, shift)
        if outcome.run is not None and reference is not None:
            outcome.errors = errors_against(reference, outcome.run, origin)
    return outcome
