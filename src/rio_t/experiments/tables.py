"""Methods compared by their errors against the truth: Tables I and II."""
import math

from .figures import draw_bars
from .laboratory import MODELS, lc_rio, need_truth, one_run, rio_t
from .page import Page, Table, fixed, mean

METRICS = (("t_rel", "t_rel [m/m]", 4), ("r_rel_deg", "r_rel [deg/m]", 3), ("ate_m", "ATE [m]", 3))
LABELS = [label for _, label, _ in METRICS]
ORIGINAL, CORRECTED = "LC-RIO", "LC-RIO corrected"


def percent(new, old):
    return fixed(100 * (new - old) / old, 1, sign=True) if old and not math.isnan(old) else ""


def compared_table(name, baseline, methods, runs):
    """A Table with a row of a method per sequence and of their mean, each against the baseline; and the ATE by
    sequence and method. `runs[sequence][method]`: list of Run."""
    rows, ate = [], {}
    for sequence in [*runs, *(["mean"] if len(runs) > 1 else [])]:
        chosen = list(runs) if sequence == "mean" else [sequence]
        figures = {method: [mean([mean([run.figure(key) for run in runs[n][method]]) for n in chosen])
                            for key, _, _ in METRICS] for method in methods}
        ate[sequence] = {method: figures[method][-1] for method in methods}
        for method in methods:
            used = [run for n in chosen for run in runs[n][method]]
            offset = mean([run.offset for run in used])
            rows.append([sequence, method, str(len(used)), fixed(offset, 2) if sequence != "mean" else ""] +
                        [fixed(value, decimals) for value, (_, _, decimals) in zip(figures[method], METRICS)] +
                        ["" if method == baseline else percent(value, old)
                         for value, old in zip(figures[method], figures[baseline])])
    columns = ["sequence", "method", "runs", "offset [ms]"] + LABELS + [
        f"{label.split(' [')[0]} change [%]" for label in LABELS]
    return Table(name, "Mean of the runs", columns, rows), ate


def runs_table(name, results):
    """`results`: (source, method, Run)."""
    rows = [[source.name, source.seed_text, fixed(source.offset, 2), method, fixed(run.offset, 3),
             fixed(run.sigma or math.nan, 3)] +
            [fixed(run.figure(key), decimals + 1) for key, _, decimals in METRICS] for source, method, run in results]
    return Table(name, "Each run", ["sequence", "seed", "true offset [ms]", "method", "offset [ms]", "sigma [ms]"] +
                 LABELS, rows)


def by_sequence(results):
    """`runs[sequence][method]` of (source, method, Run)."""
    runs = {}
    for source, method, run in results:
        runs.setdefault(source.name, {}).setdefault(method, []).append(run)
    return runs


def table1(lab, sources, _):
    """RIO-T against LC-RIO, which does not estimate the offset."""
    settings = {ORIGINAL: lc_rio(), **{f"RIO-T {model}": rio_t(model) for model in MODELS}}
    keys = [(source, method) for source in sources for method in settings]
    runs = lab.map([(source, 1, one_run(settings[method])) for source, method in keys])
    results = [(source, method, run) for (source, method), run in zip(keys, runs)]
    for source, _, run in results:
        need_truth(source, run)
    page = Page("Table I: RIO-T against LC-RIO")
    page.notes.append("LC-RIO is the same graph with the offset held at zero (estimate_time_offset: false); changes "
                      "are against it")
    page.notes.append("paper, ATE of LC-RIO and RIO-T: Gym 0.274, 0.278; Mocap easy 0.124, 0.128; medium 0.128, 0.130; "
                      "difficult 0.489, 0.420 m")
    table, ate = compared_table("table1", ORIGINAL, settings, by_sequence(results))
    page.tables += [table, runs_table("table1_runs", results)]
    bars = {name: {method.replace("RIO-T ", ""): value for method, value in of.items()} for name, of in ate.items()}
    page.figures.append((draw_bars(list(bars), [ORIGINAL, *MODELS], bars, "ATE [m]"), "table1.png"))
    return page


def pair(lab, bag):
    before = lab.run(bag, lc_rio())
    estimate = lab.run(bag, rio_t(MODELS[0])).offset
    after = lab.run(bag, lc_rio(-estimate))
    after.offset = estimate  # what the stamps were corrected by
    return before, after


def table2(lab, sources, _):
    """LC-RIO with the stamps of the bag and with stamps corrected by RIO-T's estimate."""
    results = []
    for source, (before, after) in zip(sources, lab.map([(source, 3, pair) for source in sources])):
        need_truth(source, before)
        results += [(source, ORIGINAL, before), (source, CORRECTED, after)]
    page = Page("Table II: stamps corrected by RIO-T's estimate")
    page.notes.append(f"the offset is what the model `{MODELS[0]}` estimates at the end of the same bag; it is taken "
                      "off the stamps (radar_stamp_shift)")
    page.notes.append("paper, ATE of LC-RIO without and with correction: Gym 0.274, 0.278; Mocap difficult 0.489, "
                      "0.267 m; mean of three 0.348, 0.251 m")
    methods = [ORIGINAL, CORRECTED]
    table, ate = compared_table("table2", ORIGINAL, methods, by_sequence(results))
    page.tables += [table, runs_table("table2_runs", results)]
    page.figures.append((draw_bars(list(ate), methods, ate, "ATE [m]"), "table2.png"))
    return page
