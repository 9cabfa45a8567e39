"""Trajectories between their poses. Quaternions are x y z w."""
import math

import numpy
from scipy.spatial.transform import Rotation


def interpolate(times, stamps, values):
    """Rows of `values`, given at `stamps`, at `times`."""
    return numpy.stack([numpy.interp(times, stamps, column) for column in values.T], -1)


def interpolate_rotations(times, stamps, quaternions):
    """Linear between neighbours, whose signs are made to agree: for poses close to each other."""
    flips = numpy.where(numpy.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0, -1.0, 1.0)
    signs = numpy.concatenate([[1.0], numpy.cumprod(flips)])
    return Rotation.from_quat(interpolate(times, stamps, quaternions * signs[:, None]))


def matrix_of(rotation):
    """As Rotation.as_matrix, which the scipy of ROS Noetic lacks."""
    return rotation.apply(numpy.eye(3)).T


def heading_between(a, b):
    """The turn about z that brings rotation `a` nearest to `b`."""
    R = matrix_of(b * a.inv())
    return Rotation.from_euler("z", math.atan2(R[1, 0] - R[0, 1], R[0, 0] + R[1, 1]))


def velocities(trajectory):
    """(n, 3) of positions at an even rate: central differences of fourth order. The two stamps at either end take
    those of second order."""
    t, p = trajectory.seconds(trajectory.stamp[0]), trajectory.position
    result = numpy.gradient(p, t, axis=0)
    if len(t) > 4:
        near = (p[3:-1] - p[1:-3]) / (t[3:-1] - t[1:-3])[:, None]
        far = (p[4:] - p[:-4]) / (t[4:] - t[:-4])[:, None]
        result[2:-2] = (4 * near - far) / 3
    return result
