"""The run as a moving picture: its path from above, and beside it the time offset with its band of 3 sigma."""
import numpy as np
from PIL import Image

from ..errors import RioTError
from ..plots import pyplot, tidy
from .figures import ESTIMATE, TRUTH

FRAMES, FRAMES_PER_SECOND = 80, 10
COLOURS = 64  # a palette that all frames share: each then stores what changed, also with an old Pillow
SIGMAS = 3


def frame_times(time):
    """Evenly over the run, the last one at its end."""
    return np.linspace(time[0], time[-1], FRAMES)


def write_animation(path, track, offset, true_offset=None):
    """A GIF. `track`: the trajectory to draw; `offset`: the table of time_offset.csv; `true_offset` [s] or None."""
    if offset is None or track is None:
        raise RioTError(f"{path}: nothing to show; the run has no {'trajectory' if track is None else 'time offset'}")
    if path.suffix != ".gif":
        raise RioTError(f"{path}: expected a name that ends in .gif")
    known = offset["sigma_s"] > 0  # before the start nothing is estimated
    if not known.any():
        raise RioTError(f"{path}: nothing to show; the time offset was not estimated")
    time, value, sigma = offset["time"][known], 1e3 * offset["offset_s"][known], 1e3 * offset["sigma_s"][known]
    p_W = track.poses.position

    figure, (above, beside) = pyplot.subplots(1, 2, figsize=(9, 3.6), dpi=80, gridspec_kw={"width_ratios": [1, 1.6]})
    above.plot(p_W[:, 0], p_W[:, 1], color="#dddddd", linewidth=1)
    (line,) = above.plot([], [], color=ESTIMATE, linewidth=1.2)
    (here,) = above.plot([], [], "o", color=ESTIMATE)
    above.set_aspect("equal", adjustable="datalim")
    tidy(above, "y [m]", "x [m]")
    if true_offset is not None:
        beside.axhline(1e3 * true_offset, color=TRUTH, linestyle="--", linewidth=1, label="truth")
        beside.legend(loc="lower right", frameon=False)
    band = beside.fill_between(time, value, value, color=ESTIMATE, alpha=0.2)
    (estimate,) = beside.plot([], [], color=ESTIMATE, linewidth=1.4)
    text = beside.text(0.02, 0.94, "", transform=beside.transAxes)
    shown = [*value, 0.0] + ([1e3 * true_offset] if true_offset is not None else [])
    margin = 0.25 * max(np.ptp(shown), 1.0)
    beside.set_xlim(time[0], time[-1])
    beside.set_ylim(min(shown) - margin, max(shown) + margin)
    tidy(beside, "time offset [ms]", "time [s]")
    figure.tight_layout()

    def draw(now):
        nonlocal band
        path_so_far = track.time <= now
        line.set_data(p_W[path_so_far, 0], p_W[path_so_far, 1])
        here.set_data(p_W[path_so_far, 0][-1:], p_W[path_so_far, 1][-1:])
        row = time <= now
        estimate.set_data(time[row], value[row])
        band.remove()
        band = beside.fill_between(time[row], (value - SIGMAS * sigma)[row], (value + SIGMAS * sigma)[row],
                                   color=ESTIMATE, alpha=0.2)
        if row.any():
            text.set_text(f"{value[row][-1]:.2f} ms, sigma {sigma[row][-1]:.2f} ms")

    images = []
    for now in frame_times(time):
        draw(now)
        figure.canvas.draw()
        images.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB"))
    pyplot.close(figure)
    palette = images[-1].quantize(COLOURS)  # the last frame shows everything
    first, *others = [image.quantize(palette=palette, dither=0) for image in images]
    first.save(path, save_all=True, append_images=others, duration=1000 // FRAMES_PER_SECOND, loop=0)
