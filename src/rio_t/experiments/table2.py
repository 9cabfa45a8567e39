"""LC-RIO with the stamps of the bag and with stamps corrected by RIO-T's estimate (Table II)."""
from .comparison import by_sequence, compared_table, runs_table
from .figures import draw_bars
from .laboratory import MODELS, lc_rio, need_truth, rio_t
from .page import Page

ORIGINAL, CORRECTED = "LC-RIO", "LC-RIO corrected"


def pair(lab, bag):
    before = lab.run(bag, lc_rio())
    estimate = lab.run(bag, rio_t(MODELS[0])).offset
    after = lab.run(bag, lc_rio(-estimate))
    after.offset = estimate  # what the stamps were corrected by
    return before, after


def run(lab, sources, _):
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
