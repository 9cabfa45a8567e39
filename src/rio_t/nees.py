"""Is the stated uncertainty honest? The normalised estimation error squared (NEES) of one run against the truth.

The NEES here is per degree of freedom: the mean over axes of (error / sigma)^2. Its expectation is 1.

What rio_t_bag states (navigation.csv), and what it is compared with:
  sigma_p   of the position in the axes of the world
  sigma_r   of the rotation vector d in R_true = Exp(d) R_estimated, so about the axes of the world: x and y are the
            tilt, z is the yaw
  sigma_v   of the velocity in the axes of the world, with what the yaw error adds to it
The world of the estimate has its origin and heading where the estimate began. The truth is moved there (translation
and yaw, never roll and pitch) at the first common stamp.
"""
import dataclasses
import math

import numpy
from scipy.spatial.transform import Rotation

from . import geometry, run_folder, tum
from .errors import RioTError

AXES = {"position": slice(0, 3), "z": slice(2, 3), "velocity": slice(6, 9), "tilt": slice(3, 5), "yaw": slice(5, 6)}
PARTS = (*AXES, "offset")
SETTLING = 1.0  # [s] after the first stamp that are left out: there the errors are nil by the alignment


@dataclasses.dataclass
class Consistency:
    """One run. `ratios` (n, 9): error / sigma of position, rotation vector, velocity; `offset_ratio`: of the offset.
    `nees`: mean over time and axes for each of PARTS."""
    ratios: numpy.ndarray
    offset_ratio: numpy.ndarray

    @property
    def nees(self):
        figures = {part: mean_square(self.ratios[:, axes]) for part, axes in AXES.items()}
        return {**figures, "offset": mean_square(self.offset_ratio)}

    def offset_quantile(self, share):
        return float(numpy.quantile(numpy.abs(self.offset_ratio), share)) if self.offset_ratio.size else math.nan


def mean_square(values):
    return float(numpy.mean(numpy.square(values))) if values.size else math.nan


def errors(navigation, truth):
    """(n, 9): position, rotation vector, velocity, in the axes of the world of the estimate."""
    estimate, origin = navigation.poses, truth.stamp[0]
    time, stamps = estimate.seconds(origin), truth.seconds(origin)
    if time[0] < 0 or time[-1] > stamps[-1]:
        raise RioTError("the truth does not reach over the estimate")
    p = geometry.interpolate(time, stamps, truth.position)
    R = geometry.interpolate_rotations(time, stamps, truth.quaternion)
    v = geometry.interpolate(time, stamps, geometry.velocities(truth))
    R_estimate = Rotation.from_quat(estimate.quaternion)
    turn = geometry.heading_between(R[0], R_estimate[0])
    aligned = turn.apply(p - p[0]) + estimate.position[0]
    rotation = (R_estimate * (turn * R).inv()).as_rotvec()
    return numpy.hstack([estimate.position - aligned, rotation, navigation.velocity - turn.apply(v)])


def consistency(navigation, offsets, truth, true_offset):
    """`offsets`: the table time_offset.csv; `true_offset` in s."""
    if len(truth) == 0:
        raise RioTError("there is no truth")
    if len(navigation.poses) == 0:
        raise RioTError("there is no pose")
    begin = navigation.poses.stamp[0] + int(1e9 * SETTLING)
    used = navigation.poses.stamp >= begin
    if not used.any():
        raise RioTError(f"no pose later than {SETTLING:g} s after the start")
    ratios = (errors(navigation, truth) / navigation.sigmas)[used]
    if not numpy.isfinite(ratios).all():
        raise RioTError("a sigma is 0 or not a number")
    # A sigma of 0: the offset is not estimated.
    estimated = (offsets["stamp"] >= begin) & (offsets["sigma_s"] > 0)
    return Consistency(ratios, (offsets["offset_s"][estimated] - true_offset) / offsets["sigma_s"][estimated])


def read_consistency(folder, truth_path, true_offset):
    """The consistency of the run in the folder. `true_offset` in s."""
    return consistency(run_folder.read_navigation(folder), run_folder.read(folder, "time_offset.csv"),
                       tum.read(truth_path), true_offset)
