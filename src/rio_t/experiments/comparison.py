"""Tables that compare methods by their errors against the truth."""
import math

from .page import Table, fixed, mean

METRICS = (("t_rel", "t_rel [m/m]", 4), ("r_rel_deg", "r_rel [deg/m]", 3), ("ate_m", "ATE [m]", 3))
LABELS = [label for _, label, _ in METRICS]


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
