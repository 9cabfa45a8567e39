"""Stamps shifted by known times: the estimate must follow, online and in a batch (Fig. 4)."""
from .figures import draw_curves
from .laboratory import MODELS, one_run, one_run_or_fault, rio_t
from .page import Page, Table, fixed, mean

STAMPS = ("trigger", "arrival")


def stamps_apart(trigger, arrival):
    """Mean of arrival minus trigger stamp [ms] of the same scans, which the counts of their points tell. None if the
    scans cannot be paired, or in more than one way: the counts hardly vary."""
    fits = []
    for lag in range(-30, 31):
        a = {key: column[max(0, -lag):] for key, column in trigger.scans.items()}
        b = {key: column[max(0, lag):] for key, column in arrival.scans.items()}
        size = min(len(a["stamp"]), len(b["stamp"]))
        if size < 20:
            continue
        same = a["points"][:size] == b["points"][:size]
        if same.mean() > 0.9:
            fits.append(1e-6 * (b["stamp"][:size] - a["stamp"][:size])[same].mean())
    return fits[0] if len(fits) == 1 else None


def follow(source, model, values, batches):
    """Rows of both tables for the shifted runs of one bag: of all steps, of each shift."""
    runs = [batch.before[0] for batch in batches]  # a batch keeps the online run that it began from
    steps = [b.offset - a.offset for a, b in zip(runs, runs[1:])]
    batch_steps = [b.offset - a.offset for a, b in zip(batches, batches[1:])]
    key = [source.name, source.seed_text, model]
    each = []
    for shift, run, batch, step in zip(values, runs, batches, [None] + steps):
        error = None if source.offset is None else run.offset - source.offset - shift
        each.append(key + [f"{shift:g}", fixed(run.offset, 3), fixed(run.sigma, 3), fixed(step, 3),
                           fixed(error, 3, sign=True), fixed(batch.offset, 3), fixed(batch.sigma, 3)])
    return key + [fixed(runs[0].offset, 3), fixed(mean(steps), 3), fixed(min(steps), 3), fixed(max(steps), 3),
                  fixed(batches[0].offset, 3), fixed(mean(batch_steps), 3),
                  fixed((values[-1] - values[0]) / (len(values) - 1), 3)], each


def compare_stamps(source, model, trigger, arrival):
    apart, difference = stamps_apart(trigger, arrival), arrival.offset - trigger.offset
    return [source.name, source.seed_text, model, fixed(trigger.offset, 3), fixed(arrival.offset, 3),
            fixed(difference, 3), fixed(apart, 3), fixed(None if apart is None else difference - apart, 3, sign=True)]


def run(lab, sources, options):
    values = options.shifts
    work, keys = [], []
    for source in sources:
        for model in MODELS:
            for shift in values:
                keys.append((source.label, model, shift))
                work.append((source, 1, one_run(rio_t(model, shift, mode="batch"))))
            for stamps in () if "stamp_source" in options.set_keys else STAMPS:
                keys.append((source.label, model, stamps))
                work.append((source, 1, one_run_or_fault(rio_t(model, stamp_source=stamps))))
    runs = dict(zip(keys, lab.map(work)))

    page = Page("Estimate of the time offset under shifted stamps")
    page.notes.append(f"shifts {', '.join(f'{shift:g}' for shift in values)} ms are added to the stamps of the radar "
                      "(radar_stamp_shift)")
    page.notes.append("the paper's mean step is 2.37 ms for shifts of 2.5 ms")
    page.notes.append("batch: the whole bag solved at once (mode: batch), its estimate at the end; grey in the figure")
    rows, single, arrival_rows, panels = [], [], [], []
    for source in sources:
        for model in MODELS:
            batches = [runs[source.label, model, shift] for shift in values]
            row, each = follow(source, model, values, batches)
            rows.append(row)
            single += each
            if source is sources[0]:
                base = batches[0].before[0].offset - values[0] if source.offset is None else source.offset
                panels.append((model, [(f"{shift:g} ms", batch.before[0], batch, base + shift)
                                       for shift, batch in zip(values, batches)]))
            if "stamp_source" in options.set_keys:
                continue
            pair = [runs[source.label, model, stamps] for stamps in STAMPS]
            faults = [run for run in pair if isinstance(run, str)]
            if not faults:
                arrival_rows.append(compare_stamps(source, model, *pair))
            elif model == MODELS[0]:
                page.notes.append(f"{source.label}: arrival against trigger stamps not run ({faults[0]})")
    page.tables.append(Table("shifts_steps", "Mean step between consecutive shifts", [
        "sequence", "seed", "model", "first estimate [ms]", "mean step [ms]", "least step [ms]", "largest step [ms]",
        "first batch [ms]", "mean batch step [ms]", "true step [ms]"], rows))
    page.tables.append(Table("shifts", "Estimate at the end, each shift", [
        "sequence", "seed", "model", "shift [ms]", "estimate [ms]", "sigma [ms]", "step [ms]", "error [ms]",
        "batch [ms]", "batch sigma [ms]"], single))
    if arrival_rows:
        page.tables.append(Table("shifts_arrival", "Stamps of arrival against stamps of the trigger", [
            "sequence", "seed", "model", "trigger [ms]", "arrival [ms]", "difference [ms]", "stamps apart [ms]",
            "error [ms]"], arrival_rows))
    page.figures.append((draw_curves(sources[0], panels), "shifts.png"))
    return page
