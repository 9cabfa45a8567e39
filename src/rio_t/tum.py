"""Trajectories in TUM format: a line `stamp x y z qx qy qz qw` for each pose, stamps in seconds."""
import dataclasses
import decimal

import numpy

from .errors import RioTError


@dataclasses.dataclass
class Trajectory:
    """Stamps are whole nanoseconds: a double of seconds resolves only 0.24 us at a Unix epoch."""
    stamp: numpy.ndarray       # (n) [ns]
    position: numpy.ndarray    # (n, 3) [m]
    quaternion: numpy.ndarray  # (n, 4) x y z w

    def __len__(self):
        return len(self.stamp)

    def __getitem__(self, rows):
        return Trajectory(self.stamp[rows], self.position[rows], self.quaternion[rows])

    def seconds(self, origin):
        """Stamps [s] after `origin` [ns]."""
        return 1e-9 * (self.stamp - origin)

    def positions(self):
        """{stamp [ns]: position}"""
        return dict(zip(self.stamp.tolist(), self.position))


def nanoseconds(text):
    """Stamp [ns] of seconds as text, to the last digit."""
    value = round(decimal.Decimal(text) * 10**9)
    if abs(value) >= 2**63:
        raise ValueError("too large")
    return value


def read(path):
    stamps, rows = [], []
    with open(path, errors="replace") as file:
        for count, line in enumerate(file, 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            try:
                stamp, *row = nanoseconds(words[0]), *map(float, words[1:])
            except (ValueError, ArithmeticError):
                row = []
            if len(row) != 7 or not any(row[3:]):
                raise RioTError(f"{path}:{count}: expected `stamp x y z qx qy qz qw`")
            stamps.append(stamp)
            rows.append(row)
    values = numpy.array(rows).reshape(-1, 7)
    return Trajectory(numpy.array(stamps, numpy.int64), values[:, :3], values[:, 3:])


def write(path, trajectory):
    with open(path, "w") as file:
        for stamp, p, q in zip(trajectory.stamp.tolist(), trajectory.position, trajectory.quaternion):
            numbers = " ".join(f"{value:.9f}" for value in (*p, *q))
            file.write(f"{decimal.Decimal(stamp).scaleb(-9):.9f} {numbers}\n")
