"""100 ms of delay in passes, each with the estimate of the one before taken off the stamps."""
from .figures import draw_curves
from .laboratory import MODELS, rio_t
from .page import Page, Table, fixed, mean

DELAY, PASSES = 100.0, 3  # ms


def passes(model, base):
    def function(lab, bag):
        # Without a known truth the estimate of the bag as it is counts as zero delay, as in the paper.
        start = lab.run(bag, rio_t(model)).offset if base is None else base
        last = lab.run(bag, rio_t(model, DELAY - start, mode="refine", refine_passes=PASSES))
        return start, last.before + [last]
    return function


def run(lab, sources, _):
    keys = [(source, model) for source in sources for model in MODELS]
    results = lab.map([(source, 1 + (source.offset is None), passes(model, source.offset)) for source, model in keys])
    page = Page("A delay of 100 ms in passes")
    page.notes.append("stamps are shifted so that the whole offset is 100 ms (radar_stamp_shift); each pass takes the "
                      "estimate of the pass before off the stamps (mode: refine)")
    page.notes.append("paper: 66.2, 94.3 and 99.5 ms after passes 1, 2 and 3")

    def cells(totals):
        return [fixed(total, 3) for total in totals] + [fixed(totals[-1] - DELAY, 3, sign=True)]

    rows = [[source.name, source.seed_text, model, fixed(start, 3)] + cells([run.offset for run in runs])
            for (source, model), (start, runs) in zip(keys, results)]
    for model in MODELS:
        of_model = [runs for (_, m), (_, runs) in zip(keys, results) if m == model]
        rows.append(["mean", "", model, ""] + cells([mean([run.offset for run in runs]) for runs in zip(*of_model)]))
    page.tables.append(Table("delay", "Estimate of the delay after each pass", [
        "sequence", "seed", "model", "offset of the bag [ms]"] + [f"pass {i + 1} [ms]" for i in range(PASSES)] + [
            "error at the end [ms]"], rows))
    panels = [(model, [(f"pass {i + 1}", run, None, DELAY) for i, run in enumerate(runs)])
              for (source, model), (_, runs) in zip(keys, results) if source is sources[0]]
    page.figures.append((draw_curves(sources[0], panels), "delay.png"))
    return page
