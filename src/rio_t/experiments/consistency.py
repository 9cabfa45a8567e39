"""Seeds x motions: errors of the state over their stated sigmas, at all times (NEES)."""
from .. import nees
from ..plots import legend_above, pyplot, tidy
from .figures import name_cases
from .laboratory import grouped, one_run_or_fault, truth_of
from .page import Page, Table, fixed, mean, median

HONEST = (0.5, 2.0)  # NEES per degree of freedom beyond these is marked
COLUMNS = [f"{part} NEES" for part in nees.PARTS]


def work(source):
    """(Run, Consistency) of a bag of the source, or one line why there is none."""
    return one_run_or_fault(
        {}, lambda folder, bag: nees.read_consistency(folder, truth_of(bag), 1e-3 * source.offset))


def marks_of(rows, first):
    """Cells of NEES, from column `first` on, that are not honest."""
    return {(i, j) for i, row in enumerate(rows) for j in range(first, first + len(COLUMNS))
            if row[j] != "" and not HONEST[0] <= float(row[j]) <= HONEST[1]}


def remark_of(run):
    said = []
    if run.summary.get("health_at_end") not in (None, "ok"):
        said.append(f"health at the end: {run.summary['health_at_end']}")
    return ", ".join(said + [f"{run.summary[key]} {key}" for key in ("divergences", "reinitializations")
                             if run.summary.get(key)])


def row_of_run(source, result):
    key = [source.name, fixed(source.offset, 2), source.seed]
    if isinstance(result, str):
        return key + [""] * (len(COLUMNS) + 5) + [result]
    run, figures = result
    return key + [fixed(figures.nees[part], 3) for part in nees.PARTS] + [
        fixed(figures.offset_quantile(0.95), 2), fixed(figures.offset_quantile(1.0), 2),
        fixed(run.offset - source.offset, 3, sign=True), fixed(run.sigma, 3), fixed(run.figure("ate_m"), 4),
        remark_of(run)]


def row_of_group(motion, offset, results, middle):
    """`middle`: mean or median."""
    good = [result for result in results if not isinstance(result, str)]
    runs, figures = [run for run, _ in good], [figures for _, figures in good]
    errors = [run.offset - offset for run in runs]
    return [motion, fixed(offset, 2), len(good), len(results) - len(good)] + [
        fixed(middle([f.nees[part] for f in figures]), 2) for part in nees.PARTS] + [
        fixed(middle([f.offset_quantile(0.95) for f in figures]), 2), fixed(middle(errors), 3, sign=True),
        fixed(middle([abs(error) for error in errors]), 3), fixed(middle([run.sigma for run in runs]), 3),
        fixed(middle([run.figure("ate_m") for run in runs]), 3)]


def draw_nees(groups):
    figure, axis = pyplot.subplots(figsize=(max(7, 1.5 * len(groups) + 2), 4.6))
    colours = pyplot.get_cmap("viridis")
    axis.axhspan(*HONEST, color="#eeeeee")
    axis.axhline(1.0, color="#999999", linewidth=0.9)
    for i, part in enumerate(nees.PARTS):
        points = [(g + 0.12 * (i - (len(nees.PARTS) - 1) / 2), max(result[1].nees[part], 1e-3))
                  for g, results in enumerate(groups.values()) for result in results if not isinstance(result, str)]
        axis.plot(*zip(*points), "o", markersize=4, alpha=0.7, color=colours(0.9 * i / (len(nees.PARTS) - 1)),
                  label=part)
    axis.set_yscale("log")
    name_cases(axis, list(groups))
    tidy(axis, "NEES per degree of freedom", "motion and true offset; a dot is a run")
    legend_above(axis, len(nees.PARTS))
    return figure


def results_of(lab, sources):
    return lab.map([(source, 1, work(source)) for source in sources])


def run(lab, sources, _):
    results = results_of(lab, sources)
    page = Page("Consistency: errors over their stated sigmas")
    page.notes.append("NEES per degree of freedom: the mean over axes and time of (error / sigma)^2, 1 for an honest "
                      f"estimator; `!` marks what is outside {HONEST[0]:g} to {HONEST[1]:g}")
    page.notes.append("the truth is moved to the estimate at the first stamp by translation and yaw only; the "
                      f"{nees.SETTLING:g} s after it are left out")
    page.notes.append("axes are those of the world: tilt is the rotation error about x and y, yaw about z")
    page.notes.append("errors of one run are alike over time, so a run is little more than one sample of yaw or offset: "
                      "of an honest estimator, the mean of five runs is outside the limits three times in ten")
    groups = grouped(sources, [(source.name, source.offset) for source in sources], results)
    outside = []
    for name, title, middle in (("consistency", "Mean of the runs", mean),
                                ("consistency_median", "Median of the runs", median)):
        rows = [row_of_group(*key, group, middle) for key, group in groups.items()]
        page.tables.append(Table(name, title, [
            "motion", "true offset [ms]", "runs", "failed", *COLUMNS, "offset error/sigma, 95 % of time",
            "offset error at end [ms]", "size [ms]", "sigma at end [ms]", "ATE [m]"], rows, marks_of(rows, 4)))
        given = sum(cell != "" for row in rows for cell in row[4:4 + len(COLUMNS)])
        outside.append(f"{len(page.tables[-1].marks)} of {given} {middle.__name__}s")
    rows = [row_of_run(source, result) for source, result in zip(sources, results)]
    page.tables.append(Table("consistency_runs", "Each run", [
        "motion", "true offset [ms]", "seed", *COLUMNS, "offset error/sigma, 95 % of time", "largest",
        "offset error at end [ms]", "sigma at end [ms]", "ATE [m]", "remark, or why there is no result"], rows,
        marks_of(rows, 3)))
    page.figures.append((draw_nees(groups), "consistency.png"))
    page.conclusion = f"{' and '.join(outside)} of NEES are outside {HONEST[0]:g} to {HONEST[1]:g}"
    return page
