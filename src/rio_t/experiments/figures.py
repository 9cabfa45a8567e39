"""Figures that more than one experiment draws."""
from ..plots import pyplot, tidy

COLOURS = {"imu": "#1f6fb4", "constant_acceleration": "#e07b00", "LC-RIO": "#777777"}


def draw_curves(source, panels):
    """`panels`: for each model (name, [(label, Run, Run of the batch or None, end it should reach)])."""
    figure, axes = pyplot.subplots(1, len(panels), figsize=(6 * len(panels), 4.6), sharey=True, squeeze=False)
    colours = pyplot.get_cmap("viridis")
    ends = [v for _, curves in panels for _, run, _, goal in curves for v in (run.offset, goal)]
    for axis, (model, curves) in zip(axes[0], panels):
        begin = min(run.curve["stamp"][0] for _, run, _, _ in curves)

        def plot(run, axis=axis, begin=begin, **style):
            axis.plot(1e-9 * (run.curve["stamp"] - begin), 1e3 * run.curve["offset_s"], **style)

        for i, (label, run, batch, goal) in enumerate(curves):
            colour = colours(0.9 * i / max(1, len(curves) - 1))
            if batch is not None:
                plot(batch, color="#999999", linewidth=1.2, label="batch" if i + 1 == len(curves) else None)
            # Wide below, narrow above: passes that agree lie on each other.
            plot(run, color=colour, linewidth=max(1.2, 3.6 - 1.2 * i), label=label)
            axis.axhline(goal, color=colour, linewidth=0.9, linestyle=":")
        axis.set_title(model, loc="left", fontsize=10)
        tidy(axis, "time offset [ms]" if axis is axes[0][0] else "", "time [s]")
    margin = 0.35 * max(max(ends) - min(ends), 5.0)
    axes[0][0].set_ylim(min(ends) - margin, max(ends) + margin)
    axes[0][-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    figure.suptitle(f"{source.label}; dotted: the value to be reached", fontsize=10)
    return figure


def draw_bars(groups, methods, values, y_label):
    """`values[group][method]`."""
    figure, axis = pyplot.subplots(figsize=(max(6, 1.6 * len(groups) + 2), 4))
    width = 0.8 / len(methods)
    for i, method in enumerate(methods):
        axis.bar([g + (i - (len(methods) - 1) / 2) * width for g in range(len(groups))],
                 [values[group][method] for group in groups], width * 0.94,
                 color=COLOURS.get(method, COLOURS["imu"]), label=method)
    axis.set_xticks(range(len(groups)))
    axis.set_xticklabels(groups)
    tidy(axis, y_label)
    axis.legend(frameon=False, fontsize=9)
    return figure


def name_cases(axis, cases):
    """`cases`: (motion, true offset [ms]) along the x axis."""
    axis.set_xticks(range(len(cases)))
    axis.set_xticklabels([f"{name}\n{offset:g} ms" for name, offset in cases], fontsize=8)
