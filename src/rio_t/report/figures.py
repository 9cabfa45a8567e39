"""The figures of the report. All times in seconds of the run."""
import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from scipy.spatial.transform import Rotation

from ..plots import legend_above, pyplot, tidy
from .motion import POINTS_ONLY, USED

TRUTH, ESTIMATE, OPTIMIZED, REJECTED = "#222222", "#1f6fb4", "#e07b00", "#b02a37"
# Curves lie on each other where the estimate is good: wide below, narrow above.
STROKES = {TRUTH: {"linewidth": 3.2, "alpha": 0.45}, OPTIMIZED: {"linewidth": 2.0}, ESTIMATE: {"linewidth": 0.9}}
AXES = ("#c23b3b", "#2f8f4e", "#2f5fc2")  # x, y, z


def new_figure(rows, height, **kwargs):
    figure, axes = pyplot.subplots(rows, 1, figsize=(10, height), squeeze=False, **kwargs)
    return figure, axes[:, 0]


def finish_axes(axes, y_label, legend=True):
    tidy(axes, y_label)
    if legend and axes.get_legend_handles_labels()[0]:
        legend_above(axes, 6, borderaxespad=0.2, columnspacing=1.2)


def thinned(rows, most=4000):
    return rows[::max(1, len(rows) // most)]


def draw_trajectory(tracks, landmarks=None):
    """`tracks`: (name, colour, n x 3 positions), all in one world frame. `landmarks`: the table map.csv, in the frame of
    the estimate."""
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
    if landmarks is not None and len(landmarks["x"]):
        for axis, v in ((axes[0], "y"), (axes[1], "z")):
            view = axis.dataLim.frozen()  # stays that of the tracks, also when the aspect is made equal
            axis.plot(landmarks["x"], landmarks[v], ".", color="#8a8f98", markersize=4, label="landmarks",
                      scalex=False, scaley=False, zorder=1)
            axis.dataLim.set(view)
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
        axes[0].plot(e["time"], np.linalg.norm(difference, axis=1), color=colour, label=name,
                     **STROKES[colour])
        axes[2].plot(e["time"], e["yaw_deg"], color=colour, label=name, **STROKES[colour])
    name, _, e = errors[-1]
    for axis, colour in zip("xyz", AXES):
        axes[1].plot(e["time"], e[axis] - e["truth_" + axis], color=colour, linewidth=1.2, label=axis)
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
    for name, colour, (t, v_I, _) in motions:
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
    t, offset, sigma = table["time"], 1e3 * table["offset_s"], 1e3 * table["sigma_s"]
    shown = list(offset)
    if true_offset is not None:
        shown.append(1e3 * true_offset)
    # The first sigma is that of the prior, so the axis is scaled to the estimates and the settled band.
    settled = 3 * float(np.median(sigma[len(sigma) // 2:]))
    low, high = min(shown) - settled, max(shown) + settled
    margin = 0.08 * max(high - low, 0.1)
    is_estimated = bool(np.any(sigma > 0))
    if is_estimated:
        figure, axes = new_figure(2, 6.0, sharex=True, gridspec_kw={"height_ratios": [2, 1]})
        axes[0].fill_between(t, offset - 3 * sigma, offset + 3 * sigma, color=ESTIMATE, alpha=0.18, linewidth=0,
                             label="3 sigma")
    else:
        figure, axes = new_figure(1, 4.0)
    axes[0].plot(t, offset, color=ESTIMATE, linewidth=1.5, label="estimate" if is_estimated else "as given")
    if true_offset is not None:
        axes[0].axhline(1e3 * true_offset, color=TRUTH, linewidth=1.2, linestyle="--",
                        label=f"truth, {1e3 * true_offset:.2f} ms")
    axes[0].set_ylim(low - margin, high + margin)
    finish_axes(axes[0], "time offset [ms]")
    if is_estimated:
        if true_offset is not None:
            error = np.abs(offset - 1e3 * true_offset)
            axes[1].semilogy(t, np.maximum(error, 1e-4), color=REJECTED, linewidth=1.0, label="size of the error")
        axes[1].semilogy(t, sigma, color=ESTIMATE, linewidth=1.5, label="sigma")
        axes[1].yaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if sigma.max() < 100 * sigma.min() else (1,)))
        axes[1].yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes[1].yaxis.set_minor_formatter(NullFormatter())
        finish_axes(axes[1], "[ms]")
    axes[-1].set_xlabel("time [s]")
    return figure


def draw_extrinsics(table, configured):
    """Turn and, if it was estimated, lever arm, both from those configured. `configured`: lever arm and R_IR."""
    lever, R_IR = configured
    turn = (Rotation.from_quat(np.stack([table["q" + k] for k in "xyzw"], -1)) * R_IR.inv()).as_rotvec()
    moved = np.stack([table[k] for k in "xyz"], -1) - lever
    rows = [("turn [deg]", turn, "sigma_r", 180.0 / np.pi)]
    if np.any(table["sigma_x"] > 0):
        rows.append(("lever arm, moved by [mm]", moved, "sigma_", 1e3))
    figure, all_axes = new_figure(len(rows), 1.2 + 3.2 * len(rows), sharex=True)
    t = table["time"]
    for axes, (label, values, sigma_name, unit) in zip(all_axes, rows):
        settled = 0.0
        for value, axis, colour in zip(unit * values.T, "xyz", AXES):
            sigma = unit * table[sigma_name + axis]
            axes.fill_between(t, value - sigma, value + sigma, color=colour, alpha=0.15, linewidth=0)
            axes.plot(t, value, color=colour, linewidth=1.2, label=axis)
            settled = max(settled, 2 * float(np.median(sigma[len(sigma) // 2:])))
        axes.axhline(0.0, color=TRUTH, linewidth=1.2, linestyle="--", label="configured")
        # Scaled likewise, and to the configured value.
        reach = 1.08 * max(unit * float(np.abs(values).max()) + settled, 1e-3)
        axes.set_ylim(-reach, reach)
        finish_axes(axes, label)
    all_axes[-1].set_xlabel("time [s]")
    return figure


def draw_ego_velocity(table, predicted):
    figure, axes = new_figure(4, 8.5, sharex=True)
    used = np.isin(table["status"], USED)
    t = table["time"]
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
    for j, status in enumerate(sorted(set(table["status"][~used]) - {POINTS_ONLY})):
        rows = table["status"] == status
        axes[3].plot(t[rows], np.zeros(np.count_nonzero(rows)), "x", color=pyplot.cm.autumn(0.22 * j), markersize=5,
                     label=f"{status} ({np.count_nonzero(rows)})", clip_on=False)
    axes[3].set_ylim(bottom=0)
    finish_axes(axes[3], "points")
    axes[3].set_xlabel("time [s]")
    return figure


def draw_biases(table):
    figure, axes = new_figure(2, 5.2, sharex=True)
    for axis, colour in zip("xyz", AXES):
        axes[0].plot(table["time"], np.degrees(table["bg" + axis]), color=colour, linewidth=1.2, label=axis)
        axes[1].plot(table["time"], table["ba" + axis], color=colour, linewidth=1.2, label=axis)
    finish_axes(axes[0], "gyroscope [deg/s]")
    finish_axes(axes[1], "accelerometer [m/s\u00b2]", legend=False)
    axes[1].set_xlabel("time [s]")
    return figure
