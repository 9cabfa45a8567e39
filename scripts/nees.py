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

PARTS = ("position", "z", "velocity", "tilt", "yaw", "offset")
AXES = {"position": slice(0, 3), "z": slice(2, 3), "velocity": slice(6, 9), "tilt": slice(3, 5), "yaw": slice(5, 6)}
SETTLING = 1.0    # [s] after the first stamp that are left out: there the errors are nil by the alignment
ROW_TOLERANCE = 1e-6  # [s] between a line of navigation.csv and its pose


class NeesError(Exception):
    """Told in one line."""


@dataclasses.dataclass
class Poses:
    """Stamps from an origin that all files of a run share: [s], (n); positions (n, 3); unit quaternions x y z w."""
    time: numpy.ndarray
    position: numpy.ndarray
    quaternion: numpy.ndarray


@dataclasses.dataclass
class Consistency:
    """Of one run. `time` and `ratios` (n, 9): error / sigma of position, rotation vector, velocity, and `offset_time`,
    `offset_ratio` of the offset. `nees`: mean over time and axes for each of PARTS."""
    time: numpy.ndarray
    ratios: numpy.ndarray
    offset_time: numpy.ndarray
    offset_ratio: numpy.ndarray

    @property
    def nees(self):
        figures = {part: mean_square(self.ratios[:, axes]) for part, axes in AXES.items()}
        return {**figures, "offset": mean_square(self.offset_ratio)}

    def offset_quantile(self, share):
        return float(numpy.quantile(numpy.abs(self.offset_ratio), share)) if self.offset_ratio.size else math.nan


def mean_square(values):
    return float(numpy.mean(numpy.square(values))) if values.size else math.nan


# --- Rotations ---


def matrices(quaternions):
    x, y, z, w = numpy.moveaxis(numpy.asarray(quaternions, float), -1, 0)
    return numpy.stack([
        numpy.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
        numpy.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
        numpy.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], -2)


def logarithms(rotations):
    """Rotation vectors (n, 3) of matrices (n, 3, 3), for angles well below 180 deg."""
    twice_sine = numpy.stack([rotations[:, 2, 1] - rotations[:, 1, 2], rotations[:, 0, 2] - rotations[:, 2, 0],
                              rotations[:, 1, 0] - rotations[:, 0, 1]], -1)
    size = numpy.linalg.norm(twice_sine, axis=1)
    angle = numpy.arctan2(size, numpy.trace(rotations, axis1=1, axis2=2) - 1)
    return twice_sine * numpy.where(size > 1e-9, angle / numpy.maximum(size, 1e-9), 0.5)[:, None]


def turn_about_z(angle):
    c, s = math.cos(angle), math.sin(angle)
    return numpy.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


# --- Truth at the stamps of the estimate ---


def velocities(truth):
    """Of positions at an even rate: central differences of fourth order, over 10 ms at 400 Hz. The two stamps at
    either end take those of second order."""
    t, p = truth.time, truth.position
    result = numpy.gradient(p, t, axis=0)
    if len(t) > 4:
        near = (p[3:-1] - p[1:-3]) / (t[3:-1] - t[1:-3])[:, None]
        far = (p[4:] - p[:-4]) / (t[4:] - t[:-4])[:, None]
        result[2:-2] = (4 * near - far) / 3
    return result


def interpolate(time, stamps, values):
    return numpy.stack([numpy.interp(time, stamps, column) for column in values.T], -1)


def truth_at(truth, time):
    """Position, rotation and velocity at stamps within the truth."""
    if time.size and (time[0] < truth.time[0] or time[-1] > truth.time[-1]):
        raise NeesError("the truth does not reach over the estimate")
    # The signs of quaternions are made to agree, so that neighbours can be mixed.
    flips = numpy.where(numpy.sum(truth.quaternion[1:] * truth.quaternion[:-1], axis=1) < 0, -1.0, 1.0)
    quaternion = truth.quaternion * numpy.concatenate([[1.0], numpy.cumprod(flips)])[:, None]
    mixed = interpolate(time, truth.time, quaternion)
    mixed /= numpy.linalg.norm(mixed, axis=1)[:, None]
    return (interpolate(time, truth.time, truth.position), matrices(mixed),
            interpolate(time, truth.time, velocities(truth)))


def errors(estimate, velocity, truth):
    """(n, 9): position, rotation vector, velocity, in the axes of the world of the estimate."""
    p, R, v = truth_at(truth, estimate.time)
    R_estimate = matrices(estimate.quaternion)
    # The yaw that brings the first rotations nearest to each other.
    first = R_estimate[0] @ R[0].T
    turn = turn_about_z(math.atan2(first[1, 0] - first[0, 1], first[0, 0] + first[1, 1]))
    aligned = (p - p[0]) @ turn.T + estimate.position[0]
    rotation = logarithms(R_estimate @ numpy.swapaxes(turn @ R, 1, 2))
    return numpy.hstack([estimate.position - aligned, rotation, velocity - v @ turn.T])


def consistency(estimate, velocity, sigmas, offsets, truth, true_offset):
    """`sigmas` (n, 9) in the order of `errors`; `offsets` (m, 3): stamp, offset, sigma [s]."""
    if len(estimate.time) == 0:
        raise NeesError("there is no pose")
    ratios = errors(estimate, velocity, truth) / sigmas
    begin = estimate.time[0] + SETTLING
    used = estimate.time >= begin
    if not used.any():
        raise NeesError(f"no pose later than {SETTLING:g} s after the start")
    if not numpy.isfinite(ratios[used]).all():
        raise NeesError("a sigma is 0 or not a number")
    # A sigma of 0: the offset is not estimated.
    offsets = offsets[(offsets[:, 0] >= begin) & (offsets[:, 2] > 0)]
    return Consistency(estimate.time[used], ratios[used], offsets[:, 0],
                       (offsets[:, 1] - true_offset) / offsets[:, 2])


# --- Files ---


def read_table(path, origin, **how):
    table = numpy.loadtxt(path, ndmin=2, **how)
    table[:, 0] -= origin
    return table


def poses_of(table):
    return Poses(table[:, 0], table[:, 1:4], table[:, 4:8])


def read_consistency(folder, truth_path, true_offset):
    """Of what rio_t_bag left in the folder. `true_offset` in s."""
    truth = read_table(truth_path, 0.0)
    if len(truth) == 0:
        raise NeesError("there is no truth")
    origin = truth[0, 0]
    truth[:, 0] -= origin
    poses = read_table(folder / "trajectory.txt", origin)
    navigation = read_table(folder / "navigation.csv", origin, delimiter=",", skiprows=1)
    offsets = read_table(folder / "time_offset.csv", origin, delimiter=",", skiprows=1)
    if len(poses) == 0 or len(navigation) == 0:
        raise NeesError("there is no pose")
    rows = numpy.searchsorted(poses[:, 0], navigation[:, 0] - ROW_TOLERANCE)
    rows = numpy.minimum(rows, len(poses) - 1)
    if numpy.abs(poses[rows, 0] - navigation[:, 0]).max() > ROW_TOLERANCE:
        raise NeesError("navigation.csv has a stamp that trajectory.txt has not")
    return consistency(poses_of(poses[rows]), navigation[:, 1:4], navigation[:, 4:13], offsets, poses_of(truth),
                       true_offset)
