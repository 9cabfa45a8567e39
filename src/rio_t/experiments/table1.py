"""RIO-T against LC-RIO, which does not estimate the offset (Table I)."""
from .comparison import by_sequence, compared_table, runs_table
from .figures import draw_bars
from .laboratory import MODELS, lc_rio, need_truth, one_run, rio_t
from .page import Page


def run(lab, sources, _):
    settings = {"LC-RIO": lc_rio(), **{f"RIO-T {model}": rio_t(model) for model in MODELS}}
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
    table, ate = compared_table("table1", "LC-RIO", settings, by_sequence(results))
    page.tables += [table, runs_table("table1_runs", results)]
    bars = {name: {method.replace("RIO-T ", ""): value for method, value in of.items()} for name, of in ate.items()}
    page.figures.append((draw_bars(list(bars), ["LC-RIO", *MODELS], bars, "ATE [m]"), "table1.png"))
    return page
