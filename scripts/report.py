#!/usr/bin/env python3
"""Report of one run: plots as PNG files and one self-contained report.html.

Reads the folder that rio_t_bag writes. Figures in the tables come from its summary.yaml and from the program
`evaluate`; this script only draws.
"""
import argparse
import base64
import csv
import html
import math
import os
import pathlib
import subprocess
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter  # noqa: E402
import yaml  # noqa: E402

TRUTH, ESTIMATE, OPTIMIZED, REJECTED = "#222222", "#1f6fb4", "#e07b00", "#b02a37"
# Curves lie on each other where the estimate is good: wide below, narrow above.
STROKES = {TRUTH: {"linewidth": 3.2, "alpha": 0.45}, OPTIMIZED: {"linewidth": 2.0}, ESTIMATE: {"linewidth": 0.9}}
AXES = ("#c23b3b", "#2f8f4e", "#2f5fc2")  # x, y, z
USED = ("moving", "zero_velocity")  # status of a scan that entered the estimate


class ReportError(Exception):
    """A fault of the input, told in one line."""


# --- Reading ---


def number(text):
    """Float, also of YAML's .nan and .inf."""
    return float(text.replace(".nan", "nan").replace(".inf", "inf"))


class Clock:
    """Seconds since the start of the run. The whole seconds are taken off first: a double resolves 0.24 us at a
    Unix epoch."""

    def __init__(self, first):
        self.epoch = int(first.split(".")[0].split("e")[0])

    def seconds(self, stamp):
        if "e" in stamp.lower():
            return float(stamp) - self.epoch
        whole, _, fraction = stamp.partition(".")
        return int(whole) - self.epoch + float("0." + (fraction or "0"))


def first_stamp(path):
    with open(path) as file:
        for line in file:
            if line.strip() and not line.startswith("#"):
                return line.split()[0]
    return None


def read_tum(path, clock):
    """Array of t x y z qx qy qz qw, one row a pose."""
    rows = []
    with open(path) as file:
        for count, line in enumerate(file, 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            try:
                row = [clock.seconds(words[0])] + [number(word) for word in words[1:]]
            except ValueError:
                row = []
            if len(row) != 8:
                raise ReportError(f"{path}:{count}: expected `stamp x y z qx qy qz qw`")
            rows.append(row)
    return np.array(rows).reshape(-1, 8)


def read_table(path, clock, columns):
    """Columns by name as arrays; `stamp` in seconds of the clock, `status` as text. None if the file is absent."""
    if not path.is_file():
        return None
    with open(path, newline="") as file:
        reader = csv.DictReader(file)
        missing = [name for name in columns if name not in (reader.fieldnames or [])]
        if missing:
            raise ReportError(f"{path}:1: no column '{missing[0]}'; expected the header `{','.join(columns)}`")
        table = {name: [] for name in columns}
        for count, row in enumerate(reader, 2):
            for name in columns:
                try:
                    text = row[name].strip()
                    table[name].append(
                        clock.seconds(text) if name == "stamp" else text if name == "status" else number(text))
                except (AttributeError, ValueError):
                    raise ReportError(f"{path}:{count}: {name} is '{row[name]}', expected a number") from None
    return {name: np.array(values) for name, values in table.items()}


def read_yaml(path):
    try:
        content = yaml.safe_load(path.read_text())
    except (OSError, yaml.YAMLError) as error:
        raise ReportError(f"{path}: {' '.join(str(error).split())}") from None
    if not isinstance(content, dict):
        raise ReportError(f"{path}: expected `key: value` lines")
    return content


def read_extrinsics(path):
    """Position of the radar in the IMU frame and R_IR."""
    config = read_yaml(path)
    try:
        lever = np.array(config["extrinsics_translation"], dtype=float).reshape(3)
        q = np.array(config["extrinsics_rotation_xyzw"], dtype=float).reshape(1, 4)
    except (KeyError, TypeError, ValueError):
        raise ReportError(f"{path}: expected extrinsics_translation (3 numbers) and extrinsics_rotation_xyzw "
                          "(4 numbers)") from None
    return lever, rotations(q)[0]


# --- The program that knows the figures ---


def find_evaluate():
    name = os.path.join("lib", "rio_t", "evaluate")
    here = pathlib.Path(__file__).resolve().parent
    candidates = [pathlib.Path(sys.argv[0]).resolve().parent / "evaluate", here / "evaluate"]
    candidates += [pathlib.Path(p) / name for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(":") if p]
    build = os.environ.get("RIO_T_BUILD_DIR", "build")
    candidates.append(here.parent / build / "devel" / name)
    for candidate in candidates:
        if candidate.is_file() and os.access(candidate, os.X_OK):
            return candidate
    raise ReportError("the program `evaluate` is not found: build the package and source its setup.bash, or give "
                      "--evaluate FILE")


def run_evaluate(program, arguments):
    try:
        done = subprocess.run([str(program), "--yaml"] + [str(a) for a in arguments], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, universal_newlines=True, check=False)
    except OSError as error:
        raise ReportError(f"{program}: {error.strerror}") from None
    if done.returncode != 0:
        raise ReportError(done.stderr.strip() or f"{program} failed with exit status {done.returncode}")
    return yaml.safe_load(done.stdout)


# --- Geometry, for curves only ---


def rotations(q):
    """Rotation matrices, n x 3 x 3, of quaternions x y z w."""
    x, y, z, w = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    return np.stack([
        np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], -1),
        np.stack([2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)], -1),
        np.stack([2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1)], 1)


def interpolate(t, times, values):
    return np.stack([np.interp(t, times, column) for column in values.T], -1)


def continuous(q):
    """Quaternions without jumps of sign, so that neighbours can be averaged."""
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def motion(poses):
    """Central differences over at least 50 ms: times, v_W, v_I, omega_I, one row each."""
    t, p, q = poses[:, 0], poses[:, 1:4], continuous(poses[:, 4:8])
    if len(t) < 3 or t[-1] - t[0] < 0.3:
        return None
    step = max(0.025, float(np.median(np.diff(t))))
    at = t[(t > t[0] + step) & (t < t[-1] - step)]
    v_W = (interpolate(at + step, t, p) - interpolate(at - step, t, p)) / (2 * step)
    R_WI = rotations(interpolate(at, t, q))
    before, after = rotations(interpolate(at - step, t, q)), rotations(interpolate(at + step, t, q))
    turn = np.einsum("nji,njk->nik", before, after)
    skew = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], -1)
    sine = 0.5 * np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1))
    scale = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-12), 1.0)
    omega_I = 0.5 * skew * scale[:, None] / (2 * step)
    return at, v_W, np.einsum("nji,nj->ni", R_WI, v_W), omega_I


# --- Drawing ---


def new_figure(rows, height, **kwargs):
    figure, axes = plt.subplots(rows, 1, figsize=(10, height), squeeze=False, **kwargs)
    return figure, axes[:, 0]


def finish_axes(axes, y_label, legend=True):
    axes.set_ylabel(y_label)
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    if legend and axes.get_legend_handles_labels()[0]:
        # Above the axes, where it hides no data.
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=6, fontsize=8, frameon=False,
                    borderaxespad=0.2, columnspacing=1.2)


def thinned(rows, most=4000):
    return rows[::max(1, len(rows) // most)]


def draw_trajectory(tracks):
    """`tracks`: (name, colour, n x 3 positions), all in one world frame."""
    everything = np.concatenate([p for _, _, p in tracks])
    span = np.maximum(np.ptp(everything, axis=0), 0.2)
    # The page is 10 inches wide; each view keeps true proportions.
    width = 8.6
    top = min(max(width * span[1] / span[0], 1.5), 8.0)
    side = min(max(width * span[2] / span[0], 1.2), 4.0)
    figure, axes = new_figure(2, top + side + 1.6, gridspec_kw={"height_ratios": [top, side]})
    for name, colour, p in tracks:
        p = thinned(p)
        axes[0].plot(p[:, 0], p[:, 1], color=colour, label=name, **STROKES[colour])
        axes[1].plot(p[:, 0], p[:, 2], color=colour, label=name, **STROKES[colour])
    name, _, last = tracks[-1]
    start, end = last[0], last[-1]
    for axis, v in ((axes[0], 1), (axes[1], 2)):
        axis.plot(start[0], start[v], "o", color="#2f8f4e", markersize=8, label=f"start, {name}", zorder=5)
        axis.plot(end[0], end[v], "s", color=REJECTED, markersize=7, label=f"end, {name}", zorder=5)
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_xlabel("x [m]")
    finish_axes(axes[0], "y [m]")
    finish_axes(axes[1], "z [m]", legend=False)
    axes[0].set_title("from above", fontsize=10, loc="left")
    axes[1].set_title("from the side", fontsize=10, loc="left")
    return figure


def draw_errors(errors):
    """`errors`: (name, colour, table of `evaluate --errors`)."""
    figure, axes = new_figure(3, 7.5, sharex=True)
    for name, colour, e in errors:
        difference = np.stack([e[k] - e["truth_" + k] for k in "xyz"], -1)
        axes[0].plot(e["stamp"], np.linalg.norm(difference, axis=1), color=colour, label=name,
                     **STROKES[colour])
        axes[2].plot(e["stamp"], e["yaw_deg"], color=colour, label=name, **STROKES[colour])
    name, _, e = errors[-1]
    for axis, colour in zip("xyz", AXES):
        axes[1].plot(e["stamp"], e[axis] - e["truth_" + axis], color=colour, linewidth=1.2, label=axis)
    axes[1].set_title(f"by axis of the world, {name}", fontsize=9, loc="left")
    finish_axes(axes[0], "position error [m]")
    finish_axes(axes[1], "position error [m]")
    finish_axes(axes[2], "yaw error [deg]", legend=False)
    axes[0].set_ylim(bottom=0)
    axes[2].set_xlabel("time [s]")
    return figure


def draw_velocity(motions):
    """`motions`: (name, colour, result of motion()); velocity in the IMU frame, which needs no alignment."""
    figure, axes = new_figure(4, 8.5, sharex=True)
    for name, colour, (t, _, v_I, _) in motions:
        style = {"color": colour, "label": name, **(STROKES[TRUTH] if colour == TRUTH else {"linewidth": 1.0})}
        for i in range(3):
            axes[i].plot(t, v_I[:, i], **style)
        axes[3].plot(t, np.linalg.norm(v_I, axis=1), **style)
    for i, axis in enumerate("xyz"):
        finish_axes(axes[i], f"v_{axis} [m/s]", legend=i == 0)
    finish_axes(axes[3], "speed [m/s]", legend=False)
    axes[3].set_xlabel("time [s]")
    return figure


def draw_offset(table, true_offset):
    t, offset, sigma = table["stamp"], 1e3 * table["offset_s"], 1e3 * table["sigma_s"]
    figure, axes = new_figure(2, 6.0, sharex=True, gridspec_kw={"height_ratios": [2, 1]})
    axes[0].fill_between(t, offset - 3 * sigma, offset + 3 * sigma, color=ESTIMATE, alpha=0.18, linewidth=0,
                         label="3 sigma")
    axes[0].plot(t, offset, color=ESTIMATE, linewidth=1.5, label="estimate")
    shown = list(offset)
    if true_offset is not None:
        axes[0].axhline(1e3 * true_offset, color=TRUTH, linewidth=1.2, linestyle="--",
                        label=f"truth, {1e3 * true_offset:.2f} ms")
        shown.append(1e3 * true_offset)
        error = np.abs(offset - 1e3 * true_offset)
        axes[1].semilogy(t, np.maximum(error, 1e-4), color=REJECTED, linewidth=1.0, label="size of the error")
    # The first sigma spans the whole prior: scaled to the estimates and the settled band.
    settled = 3 * float(np.median(sigma[len(sigma) // 2:]))
    low, high = min(shown) - settled, max(shown) + settled
    margin = 0.08 * max(high - low, 0.1)
    axes[0].set_ylim(low - margin, high + margin)
    axes[1].semilogy(t, sigma, color=ESTIMATE, linewidth=1.5, label="sigma")
    finish_axes(axes[0], "time offset [ms]")
    axes[1].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if sigma.max() < 100 * sigma.min() else (1,)))
    axes[1].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes[1].yaxis.set_minor_formatter(NullFormatter())
    finish_axes(axes[1], "[ms]")
    axes[1].set_xlabel("time [s]")
    return figure


def predicted_ego_velocity(table, offset, reference, extrinsics):
    """Velocity of the radar in its frame that `reference` predicts at the scans, n x 3, NaN outside; and how."""
    t, _, v_I, omega_I = reference
    at = table["stamp"].copy()
    if offset is not None and len(offset["stamp"]):
        at -= np.interp(at, offset["stamp"], offset["offset_s"])  # measured at stamp - t_O
    inside = (at >= t[0]) & (at <= t[-1])
    v, w = interpolate(at, t, v_I), interpolate(at, t, omega_I)
    if extrinsics is not None:
        lever, R_IR = extrinsics
        predicted, how = (v + np.cross(w, lever)) @ R_IR, "mounting from the configuration"
    else:
        # Any mounting is linear in velocity and turn rate. Fitted to the data, largest misfits left out.
        regressors = np.concatenate([v, w], axis=1)
        measured = np.stack([table["v" + k] for k in "xyz"], -1)
        use = inside & np.isin(table["status"], USED) & np.all(np.isfinite(measured), axis=1)
        if np.count_nonzero(use) < 20:
            return None, ""
        for _ in range(5):
            fit = np.linalg.lstsq(regressors[use], measured[use], rcond=1e-3)[0]
            misfit = np.linalg.norm(measured - regressors @ fit, axis=1)
            use = use & (misfit <= 4 * np.median(misfit[use]) + 1e-9)
        predicted, how = regressors @ fit, "mounting fitted to the data; give --config for the true one"
    predicted[~inside] = np.nan
    return predicted, how


def draw_ego_velocity(table, predicted):
    figure, axes = new_figure(4, 8.5, sharex=True)
    used = np.isin(table["status"], USED)
    t = table["stamp"]
    shift = predicted if predicted is not None else np.zeros((len(t), 3))
    for i, axis in enumerate("xyz"):
        value, sigma = table["v" + axis] - shift[:, i], table["sigma_" + axis]
        if predicted is not None:
            axes[i].fill_between(t[used], -3 * sigma[used], 3 * sigma[used], color=AXES[i], alpha=0.15, linewidth=0,
                                 label="3 sigma of the measurement")
            seen = used & np.isfinite(value)
            if np.any(seen):  # outliers are cut off at the edge, so that they do not hide the rest
                reach = 1.3 * max(float(np.percentile(np.abs(value[seen]), 99)), 3 * float(np.median(sigma[seen])))
                axes[i].set_ylim(-reach, reach)
        axes[i].plot(t[used], value[used], ".", color=AXES[i], markersize=3,
                     label="residual" if predicted is not None else "velocity")
        finish_axes(axes[i], f"{'residual' if predicted is not None else 'v'} {axis} [m/s]", legend=i == 0)
    axes[3].plot(t, table["points"], color="#999999", linewidth=0.9, label="points")
    axes[3].plot(t, table["inliers"], color=ESTIMATE, linewidth=1.0, label="inliers")
    for j, status in enumerate(sorted(set(table["status"][~used]))):
        rows = table["status"] == status
        axes[3].plot(t[rows], np.zeros(np.count_nonzero(rows)), "x", color=plt.cm.autumn(0.22 * j), markersize=5,
                     label=f"{status} ({np.count_nonzero(rows)})", clip_on=False)
    axes[3].set_ylim(bottom=0)
    finish_axes(axes[3], "points")
    axes[3].set_xlabel("time [s]")
    return figure


def draw_biases(table):
    figure, axes = new_figure(2, 5.2, sharex=True)
    for axis, colour in zip("xyz", AXES):
        axes[0].plot(table["stamp"], np.degrees(table["bg" + axis]), color=colour, linewidth=1.2, label=axis)
        axes[1].plot(table["stamp"], table["ba" + axis], color=colour, linewidth=1.2, label=axis)
    finish_axes(axes[0], "gyroscope [deg/s]")
    finish_axes(axes[1], "accelerometer [m/s\u00b2]", legend=False)
    axes[1].set_xlabel("time [s]")
    return figure


# --- Page ---

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; margin-bottom: 0; } h2 { font-size: 1.1rem; margin: 2.2rem 0 .5rem; }
p.note { color: #666; margin: .2rem 0 1rem; } img { width: 100%; height: auto; }
table { border-collapse: collapse; margin: .5rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .9rem .25rem 0; border-bottom: 1px solid #ddd; text-align: left; vertical-align: top; }
td.number, th.number { text-align: right; }
"""


def shown(value):
    if isinstance(value, bool) or value is None:
        return str(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {shown(v)}" for key, v in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(shown(v) for v in value)
    return str(value)


def table_html(header, rows):
    def cells(tag, row):
        parts = []
        for i, value in enumerate(row):
            numeric = ' class="number"' if i and len(row) > 2 else ""
            parts.append(f"<{tag}{numeric}>{html.escape(shown(value))}</{tag}>")
        return "<tr>" + "".join(parts) + "</tr>"

    head = cells("th", header) if header else ""
    return "<table>" + head + "".join(cells("td", row) for row in rows) + "</table>"


ACCURACY = (
    ("ATE: position, origin aligned, rmse [m]", "ape_origin_m", "rmse", ".4f"),
    ("ATE: position, origin aligned, largest [m]", "ape_origin_m", "max", ".4f"),
    ("orientation, origin aligned, rmse [deg]", "ape_origin_deg", "rmse", ".3f"),
    ("position, yaw and position aligned, rmse [m]", "ape_yaw_m", "rmse", ".4f"),
    ("position, SE3 aligned, rmse [m]", "ape_se3_m", "rmse", ".4f"),
    ("t_rel: RPE over 1 m, rmse [m/m]", "rpe_1m_m", "rmse", ".4f"),
    ("r_rel: RPE over 1 m, rmse [deg/m]", "rpe_1m_deg", "rmse", ".3f"),
    ("RPE over 1 s, rmse [m]", "rpe_1s_m", "rmse", ".4f"),
    ("RPE over 1 s, rmse [deg]", "rpe_1s_deg", "rmse", ".3f"),
    ("path of the truth [m]", "drift", "path_m", ".2f"),
    ("error at the end [m]", "drift", "final_m", ".3f"),
    ("yaw error at the end [deg]", "drift", "final_yaw_deg", ".2f"),
    ("drift [m/m]", "drift", "per_metre", ".4f"),
)


def accuracy_rows(evaluations):
    rows = [["matched poses"] + [str(e["matched_poses"]) for _, e in evaluations]]
    for label, key, field, form in ACCURACY:
        row = []
        for _, e in evaluations:
            value = e.get(key)
            empty = value is None or value.get("pairs") == 0
            row.append("\u2013" if empty else format(value[field], form))
        rows.append([label] + row)
    return rows


def offset_rows(e):
    return [
        ["truth [ms]", f"{1e3 * e['true_s']:.3f}"],
        ["last estimate minus truth [ms]", f"{1e3 * e['final_error_s']:.3f} (sigma {1e3 * e['final_sigma_s']:.3f})"],
        ["mean error [ms]", f"{1e3 * e['mean_error_s']:.3f}"],
        ["rmse [ms]", f"{1e3 * e['rmse_s']:.3f}"],
        ["largest error [ms]", f"{1e3 * e['max_error_s']:.3f}"],
        ["within 1, 2, 3 sigma",
         ", ".join(f"{100 * e[f'share_{k}_sigma']:.1f} %" for k in (1, 2, 3)) + " (honest: 68.3, 95.4, 99.7)"],
        ["mean of (error / sigma)\u00b2", f"{e['mean_normalised_square']:.3f} (honest: 1)"],
        ["estimates", str(e["samples"])],
    ]


class Page:
    """Collects sections, and writes each figure to a file of its own as well."""

    def __init__(self, folder, title):
        self.folder, self.title, self.parts = folder, title, []

    def heading(self, text, note=""):
        self.parts.append(f"<h2>{html.escape(text)}</h2>")
        self.note(note)

    def note(self, text):
        if text:
            self.parts.append(f'<p class="note">{html.escape(text)}</p>')

    def table(self, header, rows):
        self.parts.append(table_html(header, rows))

    def figure(self, name, figure):
        path = self.folder / f"{name}.png"
        figure.align_ylabels()
        figure.tight_layout()
        figure.savefig(path, dpi=110)
        plt.close(figure)
        data = base64.b64encode(path.read_bytes()).decode("ascii")
        self.parts.append(f'<img alt="{html.escape(name)}" src="data:image/png;base64,{data}">')

    def write(self):
        title = html.escape(self.title)
        text = (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
                f"<style>{STYLE}</style></head>\n<body><h1>{title}</h1>\n" + "\n".join(self.parts) + "\n</body></html>\n")
        path = self.folder / "report.html"
        path.write_text(text, encoding="utf-8")
        return path


def report(arguments):
    run = arguments.run
    if not run.is_dir():
        raise ReportError(f"{run}: no such folder; expected the output folder of rio_t_bag")
    estimates = [(name, colour, run / file) for name, colour, file in (
        ("optimised", OPTIMIZED, "trajectory_optimized.txt"), ("online", ESTIMATE, "trajectory.txt"))]
    if not estimates[-1][2].is_file():
        raise ReportError(f"{estimates[-1][2]}: missing; expected the output folder of rio_t_bag")
    estimates = [(name, colour, file) for name, colour, file in estimates if file.is_file() and first_stamp(file)]
    if arguments.ground_truth and not arguments.ground_truth.is_file():
        raise ReportError(f"{arguments.ground_truth}: no such file; expected a trajectory (TUM format)")
    clock = Clock(min((first_stamp(file) for _, _, file in estimates), default="0", key=float))
    poses = [(name, colour, read_tum(file, clock)) for name, colour, file in estimates]
    truth = read_tum(arguments.ground_truth, clock) if arguments.ground_truth else None
    offset = read_table(run / "time_offset.csv", clock, ("stamp", "offset_s", "sigma_s"))
    ego = read_table(run / "ego_velocity.csv", clock,
                     ("stamp", "vx", "vy", "vz", "sigma_x", "sigma_y", "sigma_z", "inliers", "points", "status"))
    biases = read_table(run / "biases.csv", clock, ("stamp", "bgx", "bgy", "bgz", "bax", "bay", "baz"))
    extrinsics = read_extrinsics(arguments.config) if arguments.config else None

    program = None
    if (truth is not None and estimates) or (arguments.true_offset is not None and offset is not None):
        program = arguments.evaluate or find_evaluate()
    folder = arguments.output or run / "report"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReportError(f"{folder}: cannot be made ({error.strerror})") from None

    page = Page(folder, f"rio_t: {run.resolve().name}")
    page.heading("Summary")
    if (run / "summary.yaml").is_file():
        page.table(None, [[key, value] for key, value in read_yaml(run / "summary.yaml").items() if key != "saved"])
    else:
        page.note("No summary.yaml: the run did not finish.")

    evaluations, errors = [], []
    if truth is not None and estimates:
        page.heading("Accuracy", f"Against {arguments.ground_truth.name}; online is what a live user gets, optimised "
                                 "what left the smoother's window. Definitions as in evo.")
        for name, colour, file in estimates:
            with tempfile.TemporaryDirectory() as scratch:
                table = pathlib.Path(scratch) / "errors.csv"
                try:
                    result = run_evaluate(program, [arguments.ground_truth, file, "--errors", table,
                                                    "--max-difference", arguments.max_difference])
                except ReportError as error:
                    if name == "online":
                        raise
                    page.note(str(error))  # few poses: a sparse truth may match none of them
                    continue
                evaluations.append((name, result["estimates"][0]))
                errors.append((name, colour, read_table(table, clock, (
                    "stamp", "x", "y", "z", "truth_x", "truth_y", "truth_z", "angle_deg", "yaw_deg"))))
        page.table([""] + [name for name, _ in evaluations], accuracy_rows(evaluations))

    if offset is not None and arguments.true_offset is not None and len(offset["stamp"]):
        page.heading("Time offset against the truth")
        result = run_evaluate(program, ["--time-offset", run / "time_offset.csv", "--true-offset",
                                        repr(arguments.true_offset)])
        page.table(None, offset_rows(result["time_offset"]))

    if poses:
        page.heading("Trajectory")
        if errors:
            e = errors[-1][2]
            tracks = [("ground truth", TRUTH, np.stack([e["truth_" + k] for k in "xyz"], -1))]
            tracks += [(name, colour, np.stack([e[k] for k in "xyz"], -1)) for name, colour, e in errors]
        else:
            tracks = [(name, colour, p[:, 1:4]) for name, colour, p in poses]
        page.figure("trajectory", draw_trajectory(tracks))
    else:
        page.note("No poses: the estimator never initialised.")
    if errors:
        page.heading("Error over time", "Aligned at the first pose.")
        page.figure("errors", draw_errors(errors))

    motions = [(name, colour, motion(p)) for name, colour, p in poses if name == "optimised" or len(poses) == 1]
    if truth is not None and poses:
        run_time = poses[-1][2][:, 0]  # the truth may cover much more
        near = (truth[:, 0] >= run_time[0] - 1) & (truth[:, 0] <= run_time[-1] + 1)
        motions.insert(0, ("ground truth", TRUTH, motion(truth[near])))
    motions = [m for m in motions if m[2] is not None]
    if motions:
        page.heading("Velocity", "In the IMU frame, from differences of the poses.")
        page.figure("velocity", draw_velocity(motions))
    if offset is not None and len(offset["stamp"]):
        page.heading("Time offset of the radar", "A scan stamped s was measured at s minus the offset.")
        page.figure("time_offset", draw_offset(offset, arguments.true_offset))
    if ego is not None and len(ego["stamp"]):
        predicted, how = None, ""
        if motions:
            predicted, how = predicted_ego_velocity(ego, offset, motions[0][2], extrinsics)
        if predicted is not None:
            page.heading("Ego-velocity residuals",
                         f"Radar minus what the {motions[0][0]} trajectory predicts, in the radar frame; {how}.")
        else:
            page.heading("Ego-velocity", "As measured, in the radar frame.")
        page.figure("ego_velocity", draw_ego_velocity(ego, predicted))
    if biases is not None and len(biases["stamp"]):
        page.heading("Biases of the IMU")
        page.figure("biases", draw_biases(biases))
    return page.write()


def finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError("expected a finite number")
    return value


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", metavar="RUN_DIR", type=pathlib.Path, help="output folder of rio_t_bag")
    parser.add_argument("--ground-truth", metavar="FILE", type=pathlib.Path, help="true trajectory, TUM format")
    parser.add_argument("--true-offset", metavar="S", type=finite, help="true time offset of the radar [s]")
    parser.add_argument("--max-difference", metavar="S", type=finite, default=0.01,
                        help="largest difference of the stamps of two poses that are compared [s] (0.01)")
    parser.add_argument("--config", metavar="FILE", type=pathlib.Path,
                        help="configuration of the run, for the radar's mounting")
    parser.add_argument("--output", metavar="DIR", type=pathlib.Path, help="where to write (RUN_DIR/report)")
    parser.add_argument("--evaluate", metavar="FILE", type=pathlib.Path, help="the program, if it is not found")
    try:
        print(report(parser.parse_args()))
    except (ReportError, OSError) as error:
        print(f"report.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
