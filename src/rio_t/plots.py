"""The look of all figures."""
import matplotlib

matplotlib.use("Agg")  # draws into files, also without a screen

from matplotlib import pyplot  # noqa: E402,F401


def tidy(axes, y_label, x_label=None):
    axes.set_ylabel(y_label)
    if x_label is not None:
        axes.set_xlabel(x_label)
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def legend_above(axes, columns, **style):
    """Above the axes, where it hides no data."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncol=columns, fontsize=8, frameon=False, **style)
