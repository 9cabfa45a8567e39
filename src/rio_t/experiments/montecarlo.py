"""Seeds x motions x offsets: mean, spread, and whether the stated uncertainty is honest."""
import math

from ..plots import legend_above, pyplot, tidy
from .figures import COLOURS, name_cases
from .laboratory import MODELS, grouped, lc_rio, one_run_or_fault, rio_t
from .page import Page, Table, fixed, mean, median, spread

NORMAL_95 = 1.959964


def row_of_run(source, method, run):
    key, estimated = [source.name, source.seed, fixed(source.offset, 2), method], method != "LC-RIO"
    if isinstance(run, str):
        return key + [""] * 5 + [run]
    rejected = ", ".join(f"{count} {reason}" for reason, count in run.summary["scans_rejected"].items()
                         if reason != "before_initialization")
    return key + [fixed(run.offset - source.offset, 3, sign=True) if estimated else "",
                  fixed(run.sigma, 3) if estimated else "", fixed(run.figure("ate_m"), 4),
                  fixed(run.figure("t_rel"), 4), fixed(run.figure("r_rel_deg"), 3), rejected]


def row_of_group(name, offset, method, runs):
    good = [run for run in runs if not isinstance(run, str)]
    ates = [run.figure("ate_m") for run in good]
    # LC-RIO states no offset.
    estimates = [(run.offset - offset, run.sigma) for run in good] if method != "LC-RIO" else []
    errors = [error for error, _ in estimates]
    sizes = [abs(error) for error in errors]
    # A run that initialised only at the end has small errors and says nothing.
    used = [100 * run.figure("scans_used") / max(1.0, run.figure("scans_total")) for run in good]
    covered = [float(abs(error) <= NORMAL_95 * sigma) for error, sigma in estimates]
    return [name, fixed(offset, 2), method, len(good), len(runs) - len(good), fixed(min(used, default=math.nan), 0),
            fixed(mean(ates), 3), fixed(spread(ates), 3), fixed(median(ates), 3), fixed(max(ates, default=math.nan), 3),
            fixed(mean(errors), 3, sign=True), fixed(spread(errors), 3), fixed(mean(sizes), 3),
            fixed(max(sizes, default=math.nan), 3), fixed(mean([sigma for _, sigma in estimates]), 3),
            fixed(100 * mean(covered), 0)]


def draw_spread(groups):
    cases = list(dict.fromkeys((name, offset) for name, offset, _ in groups))
    methods = list(dict.fromkeys(method for _, _, method in groups))
    figure, axes = pyplot.subplots(2, 1, figsize=(max(7, 1.25 * len(cases) + 2), 8), sharex=True)
    for i, method in enumerate(methods):
        for g, (name, offset) in enumerate(cases):
            runs = [run for run in groups[name, offset, method] if not isinstance(run, str)]
            x = [g + 0.26 * (i - 1)] * len(runs)
            style = {"color": COLOURS[method.replace("RIO-T ", "")], "alpha": 0.55, "markersize": 4,
                     "label": method if g == 0 else None}
            axes[1].plot(x, [run.figure("ate_m") for run in runs], "o", **style)
            if method != "LC-RIO":
                axes[0].plot(x, [max(abs(run.offset - offset), 1e-3) for run in runs], "o", **style)
    name_cases(axes[1], cases)
    tidy(axes[0], "size of the offset error [ms]")
    tidy(axes[1], "ATE [m]", "motion and true offset; a dot is a run")
    for axis in axes:
        axis.set_yscale("log")
        legend_above(axis, 3)
    return figure


def run(lab, sources, _):
    settings = {**{f"RIO-T {model}": rio_t(model) for model in MODELS}, "LC-RIO": lc_rio()}
    keys = [(source, method) for source in sources for method in settings]
    results = lab.map([(source, 1, one_run_or_fault(settings[method])) for source, method in keys])
    page = Page("Monte-Carlo over seeds")
    page.notes.append("covered: share of the runs whose 95 % interval (estimate at the end +- 1.96 sigma) holds the "
                      "true offset")
    groups = grouped([source for source, _ in keys],
                     [(source.name, source.offset, method) for source, method in keys], results)
    page.tables.append(Table("montecarlo", "Errors by motion and offset", [
        "motion", "true offset [ms]", "method", "runs", "failed", "least scans used [%]", "ATE mean [m]", "ATE sd [m]",
        "ATE median [m]", "ATE max [m]", "offset error mean [ms]", "sd [ms]", "mean size [ms]", "max size [ms]",
        "mean sigma [ms]", "covered [%]"], [row_of_group(*key, runs) for key, runs in groups.items()]))
    page.tables.append(Table("montecarlo_runs", "Each run", [
        "motion", "seed", "true offset [ms]", "method", "offset error [ms]", "sigma [ms]", "ATE [m]", "t_rel [m/m]",
        "r_rel [deg/m]", "scans rejected after the start, or why there is no result"],
        [row_of_run(*key, run) for key, run in zip(keys, results)]))
    page.figures.append((draw_spread(groups), "montecarlo.png"))
    return page
