"""Reads what rio_t_bag writes into its output folder."""
import csv
import dataclasses
import re

import numpy
import yaml

from . import tum
from .errors import RioTError

# The columns that the scripts read from each file. If a file lacks one, the error names both.
COLUMNS = {
    "navigation.csv": "stamp,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_rx,sigma_ry,sigma_rz,sigma_vx,sigma_vy,sigma_vz",
    "time_offset.csv": "stamp,offset_s,sigma_s",
    "ego_velocity.csv": "stamp,vx,vy,vz,sigma_x,sigma_y,sigma_z,inliers,points,status",
    "extrinsics.csv": "stamp,x,y,z,qx,qy,qz,qw,sigma_x,sigma_y,sigma_z,sigma_rx,sigma_ry,sigma_rz",
    "map.csv": "id,x,y,z,sigma,snr_db,sightings",
    "biases.csv": "stamp,bgx,bgy,bgz,bax,bay,baz"}
KINDS = {"stamp": tum.nanoseconds, "status": str}  # all other columns are numbers


@dataclasses.dataclass
class Navigation:
    """The causal states that come with their uncertainty, ten times a second."""
    poses: tum.Trajectory
    velocity: numpy.ndarray  # (n, 3) in the world
    sigmas: numpy.ndarray    # (n, 9) of position, rotation vector and velocity, in the axes of the world


def read_table(path, header):
    """Columns by name as arrays: `stamp` [ns], `status` as text, all others as numbers."""
    names = header.split(",")
    with open(path, newline="", errors="replace") as file:
        reader = csv.DictReader(file)
        missing = [name for name in names if name not in (reader.fieldnames or [])]
        if missing:
            raise RioTError(f"{path}:1: no column '{missing[0]}'; expected the header `{header}`")
        table = {name: [] for name in names}
        for count, row in enumerate(reader, 2):
            for name in names:
                try:
                    table[name].append(KINDS.get(name, float)(row[name].strip()))
                except (AttributeError, ValueError, ArithmeticError):
                    raise RioTError(f"{path}:{count}: {name} is '{row[name]}', expected a number") from None
    return {name: numpy.array(values, numpy.int64 if name == "stamp" else str if name == "status" else float)
            for name, values in table.items()}


def of_radar(name, radar):
    """The name of a file, or of a key of summary.yaml, of a radar; `radar` is empty if there is only one."""
    stem, dot, extension = name.partition(".")
    return f"{stem}_{radar}{dot}{extension}" if radar else name


def read(folder, name, radar=""):
    """A table of the run. `name`: of its file, without the name of the radar."""
    return read_table(folder / of_radar(name, radar), COLUMNS[name])


def read_yaml(path):
    try:
        content = yaml.safe_load(path.read_text())
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise RioTError(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(content, dict):
        raise RioTError(f"{path}: expected `key: value` lines")
    return content


def starts_again(summary):
    """Whether the trajectory starts again in a new world, since the clock of the IMU jumped while the estimate ran. Its
    summary has no distance from end to start, and no error."""
    return "imu_clock_restart" in (summary.get("input_faults") or {}) and "end_to_start_3d_m" not in summary


def radars(folder):
    """Names of the radars, in the order of the configuration; [""] for one radar, whose files carry no name."""
    if (folder / "summary.yaml").is_file():
        files = read_yaml(folder / "summary.yaml").get("saved") or []
    else:  # the run did not finish
        files = sorted(path.name for path in folder.glob("ego_velocity*.csv"))
    matches = [re.fullmatch(r"ego_velocity_([a-z0-9_]+)\.csv", str(file)) for file in files]
    return [match.group(1) for match in matches if match] or [""]


def read_navigation(folder):
    """The lines of navigation.csv with the poses of trajectory.txt that belong to them. Both are in the order of
    output, in which a stamp may come twice (a bag that loops)."""
    table, poses = read(folder, "navigation.csv"), tum.read(folder / "trajectory.txt")
    stamps, rows, row = poses.stamp.tolist(), [], 0
    try:
        for stamp in table["stamp"].tolist():
            row = stamps.index(stamp, row)
            rows.append(row)
    except ValueError:
        raise RioTError(f"{folder}: navigation.csv has a stamp that trajectory.txt has not") from None
    columns = numpy.stack([table[name] for name in COLUMNS["navigation.csv"].split(",")[1:]], -1)
    return Navigation(poses[rows], columns[:, :3], columns[:, 3:])
