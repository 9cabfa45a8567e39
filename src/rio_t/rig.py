"""Draws where the radars of a configuration sit and where they look, from above and from the side.

The IMU has x forward, y left, z up. The drawing takes the configuration as rio_t_bag reads it, so it understands
every way to give a mounting.
"""
import pathlib
import sys

import numpy as np
import yaml
from matplotlib.ticker import FuncFormatter
from scipy.spatial.transform import Rotation

from . import programs
from .command_line import Parser
from .errors import RioTError
from .geometry import matrix_of
from .plots import pyplot, tidy

COLOURS = ("tab:orange", "tab:blue", "tab:green", "tab:red", "tab:purple", "tab:brown")
VIEW = np.deg2rad(45.0)  # of the cone that stands for the field of view, to either side


def read_config(folder, name_or_path):
    """A configuration as rio_t_bag, which is in `folder`, reads it: names and every way to give a mounting."""
    return yaml.safe_load(programs.output_of(folder / "rio_t_bag", "--print-config", "--config", name_or_path))


def radars_of(config):
    """(name, lever arm, rotation that turns right, forward, up into the axes of the IMU) of each radar; both None if they
    come from tf."""
    names = config.get("radars") or [""]
    result = []
    for name in names:
        own = {**config, **(config.get(name) or {})} if name else config
        if own["extrinsics_source"] == "tf":
            result.append((str(name), None, None))
            continue
        result.append((str(name), np.array(own["extrinsics_translation"] or [0, 0, 0], float),
                       Rotation.from_quat(own["extrinsics_rotation_xyzw"])))
    return result


def angles(rotation):
    """Yaw to the left, pitch up and roll right side down in degrees, as mounting_yaw_pitch_roll_deg has them."""
    flu = rotation * Rotation.from_euler("z", 90, degrees=True)  # x forward, y left, z up of the radar
    forward, left, up = matrix_of(flu).T
    pitch = np.arctan2(forward[2], np.hypot(forward[0], forward[1]))
    yaw = np.arctan2(forward[1], forward[0])
    roll = np.arctan2(left[2], up[2])
    return np.rad2deg([yaw, pitch, roll])


def draw_view(axes, radars, size, across, along):
    """`across` and `along`: the axes of the IMU to the right and up on the paper, each with a sign."""
    def on_paper(vector):
        return np.array([across[1] * vector[..., across[0]], along[1] * vector[..., along[0]]])

    for k, label in enumerate("xyz"):
        tip = on_paper(0.5 * size * np.eye(3)[k])
        if np.linalg.norm(tip) < 1e-9:
            continue
        axes.plot(*(1.2 * tip), alpha=0)  # an annotation alone does not widen the axes
        axes.annotate("", tip, (0, 0), arrowprops={"arrowstyle": "->", "color": "black"})
        axes.annotate(f"{label} of the IMU", 1.12 * tip, ha="center", va="center", fontsize=8)
    axes.plot(0, 0, "ks", markersize=8)
    for (name, lever, rotation), colour in zip(radars, COLOURS * len(radars)):
        at = on_paper(lever)
        edge = np.linspace(-VIEW, VIEW, 25)
        for plane in (0, 2):  # the fan in azimuth, and that in elevation
            fan = np.zeros((len(edge), 3))
            fan[:, plane], fan[:, 1] = np.sin(edge), np.cos(edge)
            outline = on_paper(lever + size * rotation.apply(fan))
            axes.fill(*np.column_stack([at, outline, at]), color=colour, alpha=0.15, linewidth=0)
        axes.annotate("", on_paper(lever + size * rotation.apply([0, 1, 0])), at,
                      arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 2})
        axes.annotate("", on_paper(lever + 0.35 * size * rotation.apply([0, 0, 1])), at,
                      arrowprops={"arrowstyle": "->", "color": colour, "linestyle": ":"})
        axes.plot(*at, "o", color=colour, label=title(name, rotation))
    axes.set_aspect("equal", "datalim")
    axes.margins(0.1)


def title(name, rotation):
    yaw, pitch, roll = angles(rotation)
    return f"{name or 'radar'}: yaw {yaw:.1f}, pitch {pitch:.1f}, roll {roll:.1f} deg"


def draw(radars, file):
    size = max(0.3, 0.7 * max(np.linalg.norm(lever) for _, lever, _ in radars))
    figure, (top, side) = pyplot.subplots(1, 2, figsize=(11, 5.5))
    draw_view(top, radars, size, (1, -1.0), (0, 1.0))
    top.set_title("from above, forward is up")
    tidy(top, "x, forward [m]", "y, left is to the left [m]")
    top.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{-value:g}"))
    draw_view(side, radars, size, (0, 1.0), (2, 1.0))
    side.set_title("from the right, forward is to the right")
    tidy(side, "z, up [m]", "x, forward [m]")
    top.legend(loc="upper center", bbox_to_anchor=(1.1, -0.12), ncol=min(3, len(radars)), frameon=False, fontsize=9)
    figure.text(0.5, 0.01, "Solid arrow: where a radar looks. Dotted arrow: its upward axis.", ha="center", fontsize=8)
    figure.savefig(file, dpi=110, bbox_inches="tight")
    pyplot.close(figure)


EXAMPLES = """Example:
  rosrun rio_t draw_rig.py --config my.yaml --out rig.png
"""


def main(arguments):
    parser = Parser(prog="draw_rig.py", description=__doc__, epilog=EXAMPLES)
    parser.add_argument("--config", required=True, metavar="NAME_OR_PATH",
                        help="a configuration, as for rio_t_bag")
    parser.add_argument("--out", required=True, type=pathlib.Path, metavar="FILE.png", help="gets the drawing")
    parser.add_argument("--programs", type=pathlib.Path, metavar="FOLDER", help="folder that holds rio_t_bag")
    given = parser.parse_args(arguments)
    try:
        if not given.out.parent.is_dir():
            raise RioTError(f"--out {given.out}: there is no folder {given.out.parent}")
        folder = programs.find(["rio_t_bag"], "--programs", given.programs)
        radars = radars_of(read_config(folder, given.config))
        for name, lever, _ in radars:
            if lever is None:
                raise RioTError(f"--config {given.config}: the mounting of {name or 'the radar'} comes from tf "
                                "(extrinsics_source: tf); expected extrinsics_source: parameters with "
                                "extrinsics_translation and extrinsics_rotation_xyzw")
        draw(radars, given.out)
    except (RioTError, OSError, ValueError, KeyError) as error:
        print(f"draw_rig.py: {error}", file=sys.stderr)
        return 1
    return 0
