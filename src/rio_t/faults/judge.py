"""Figures of a run on a faulty bag, for the expectations."""
import dataclasses
import pathlib
import re

import numpy
from scipy.spatial.transform import Rotation

from .. import geometry, run_folder, tum

NOT_A_NUMBER = re.compile(r"(?<![a-z_])[-+]?\.?(nan|inf)(?![a-z_])", re.IGNORECASE)


@dataclasses.dataclass
class States:
    """Position and velocity in a world of its own, attitude, and standard deviations of p (in W) and v (in W)."""
    time: numpy.ndarray
    p: numpy.ndarray
    R: Rotation
    v: numpy.ndarray
    sigma_p: numpy.ndarray = None
    sigma_v: numpy.ndarray = None

    def part(self, keep):
        return States(*(getattr(self, field.name)[keep] for field in dataclasses.fields(self)))

    @property
    def body_velocity(self):
        return self.R.apply(self.v, inverse=True)


def read_run(folder):
    """The causal output with its uncertainty, ten times a second. None if there is none."""
    navigation = run_folder.read_navigation(pathlib.Path(folder))
    poses, sigmas = navigation.poses, navigation.sigmas
    if len(poses) == 0:
        return None
    return States(poses.seconds(0), poses.position, Rotation.from_quat(poses.quaternion), navigation.velocity,
                  sigmas[:, :3], sigmas[:, 6:])


def read_truth(path):
    """TUM file of a simulated motion."""
    poses = tum.read(path)
    return States(poses.seconds(0), poses.position, Rotation.from_quat(poses.quaternion), geometry.velocities(poses))


def shifted_back(run, shift, begin):
    """Undoes a jump by `shift` seconds of the stamps of the output, so that it can be compared with a reference. A small
    step back at the time `begin` leaves no jump: the samples until the clock has caught up have no output."""
    steps = numpy.diff(run.time)
    jumps = numpy.flatnonzero((steps > 0.5 * shift) if shift > 0 else (steps < 0.1 * shift))
    time = run.time.copy()
    if len(jumps):
        time[jumps[0] + 1:] -= shift
    else:
        time[run.time > begin] -= shift
    return dataclasses.replace(run, time=time)


def at(reference, times):
    """The reference at these times."""
    return States(times, geometry.interpolate(times, reference.time, reference.p),
                  geometry.interpolate_rotations(times, reference.time, reference.R.as_quat()),
                  geometry.interpolate(times, reference.time, reference.v))


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
    run = run.part(keep)
    true = at(reference, run.time)
    turn = geometry.heading_between(true.R[0], run.R[0])
    e_p = run.p - run.p[0] - turn.apply(true.p - true.p[0])
    e_v = run.v - turn.apply(true.v)
    sigma_p, sigma_v = numpy.maximum(run.sigma_p, 1e-9), numpy.maximum(run.sigma_v, 1e-9)
    ratio = numpy.maximum((numpy.abs(e_p) / sigma_p).max(axis=1), (numpy.abs(e_v) / sigma_v).max(axis=1))

    def norm(vectors):
        return numpy.linalg.norm(vectors, axis=1)

    return Errors(run.time - origin, norm(run.body_velocity - true.body_velocity), norm(e_p), norm(run.sigma_v),
                  norm(run.sigma_p), ratio)


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
    usual: dict = dataclasses.field(default_factory=dict)  # summary.yaml of the run without the fault

    def counted(self):
        """Every count of something that went wrong, beyond those of the run without the fault."""
        usual = counts_in(self.usual)
        return {name: count for name, count in counts_in(self.summary).items() if count > usual.get(name, 0)}


def counts_in(summary):
    counts = dict(summary.get("input_faults") or {})
    for name, count in (summary.get("scans_rejected") or {}).items():
        counts[name] = counts.get(name, 0) + count
    if summary.get("divergences"):
        counts["diverged"] = summary["divergences"]
    return counts


def files_with_nan(folder):
    spoiled = []
    for path in sorted(folder.glob("*.*")):
        if path.suffix in (".txt", ".csv", ".yaml") and NOT_A_NUMBER.search(path.read_text()):
            spoiled.append(path.name)
    return spoiled


def read_outcome(folder, status, messages, reference, origin, shift=0.0, begin=0.0):
    folder = pathlib.Path(folder)
    summary = run_folder.read_yaml(folder / "summary.yaml") if (folder / "summary.yaml").exists() else {}
    outcome = Outcome(status, messages, summary, files_with_nan(folder) if folder.exists() else [])
    if summary:
        outcome.run = read_run(folder)
        if outcome.run is not None and shift != 0.0:
            outcome.run = shifted_back(outcome.run, shift, origin + begin)
        if outcome.run is not None and reference is not None:
            outcome.errors = errors_against(reference, outcome.run, origin)
    return outcome
