#!/usr/bin/env python3
"""The paper's experiments and more, on simulated or given bags: tables as Markdown and CSV, figures as PNG.

  shifts      stamps shifted by 0, 2.5, ... 15 ms: the estimate must follow, online and in a batch (Fig. 4); arrival
              against trigger stamps
  delay       100 ms of delay in passes, each with the estimate of the one before taken off the stamps
  table1      RIO-T against LC-RIO, which does not estimate the offset (Table I)
  table2      LC-RIO with the stamps of the bag and with stamps corrected by RIO-T's estimate (Table II)
  montecarlo  seeds x motions x offsets: mean, spread, and whether the stated uncertainty is honest
  consistency seeds x motions: errors of position, velocity, tilt, yaw and offset over their stated sigmas, at all
              times (NEES); 1 is honest, `!` marks what is below 0.5 or above 2

Both models of the offset run side by side: `imu` (ours) and `constant_acceleration` (the paper's). Only `consistency`
runs one model, that of the configuration or of --set time_offset_model=...
"""
import argparse
import concurrent.futures
import csv
import dataclasses
import math
import os
import pathlib
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from typing import Optional

# Also where another program reads this file, as the one in catkin's devel space does.
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))

# numpy, matplotlib and yaml are imported where they are used: a wrong argument is told before they are installed.

EXPERIMENTS = ("shifts", "delay", "table1", "table2", "montecarlo", "consistency")
SIMULATED_ONLY = ("montecarlo", "consistency")  # these draw their bags, of more than one offset if asked
MODELS = ("imu", "constant_acceleration")
COLOURS = {"imu": "#1f6fb4", "constant_acceleration": "#e07b00", "LC-RIO": "#777777"}
DEFAULT_SHIFTS = [2.5 * i for i in range(7)]  # ms
DELAY, PASSES = 100.0, 3                      # ms
# ms; the middle of the 18.5 ms frame that an IRS stamp begins, and two delays of systems without a trigger.
FRAME_OFFSET, DELAYED_OFFSETS = -9.25, (30.0, 100.0)
HANDHELD = ["easy", "medium", "difficult"]
DEFAULT_MOTIONS = {"shifts": ["difficult"], "delay": ["difficult"], "table1": HANDHELD + ["gym_loop"],
                   "table2": HANDHELD + ["gym_loop"], "montecarlo": HANDHELD,
                   "consistency": ["difficult", "medium", "drone", "ground_vehicle", "gym_loop", "start_in_motion"]}
DEFAULT_OFFSETS = {"montecarlo": [FRAME_OFFSET, *DELAYED_OFFSETS], "consistency": [30.0]}
DEFAULT_SEEDS = {"montecarlo": 10, "consistency": 5}
# What an experiment varies itself.
OWN_KEYS = ("time_offset_model", "estimate_time_offset", "radar_stamp_shift", "mode", "refine_passes")
OWN_SIMULATION = ("motion", "trajectory", "out", "ground-truth", "seed", "duration", "time-offset")
NORMAL_95 = 1.959964
HONEST = (0.5, 2.0)  # NEES per degree of freedom beyond these is marked


class ExperimentError(Exception):
    """Told in one line."""


# --- Bags and runs ---


@dataclasses.dataclass
class Source:
    """A bag, given or simulated when it is first needed."""
    name: str
    seed: Optional[int] = None
    motion: Optional[str] = None
    offset: Optional[float] = None  # ms, the truth if it is known
    bag: Optional[pathlib.Path] = None


@dataclasses.dataclass
class Run:
    """What is kept of one run of rio_t_bag. Times of offsets in ms."""
    offset: float
    sigma: float
    summary: dict
    curve: list     # (stamp [s], offset, sigma) after each scan
    scans: list     # (stamp [s], points) of each scan
    before: list = dataclasses.field(default_factory=list)  # Runs: the online pass of a batch, the earlier passes

    def figure(self, key):
        return float(self.summary.get(key, math.nan))


def read_csv(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def read_run(folder):
    """What rio_t_bag left in the folder, with the passes that it keeps in folders below."""
    import yaml
    summary = yaml.safe_load((folder / "summary.yaml").read_text())
    curve = [(float(row["stamp"]), 1e3 * float(row["offset_s"]), 1e3 * float(row["sigma_s"]))
             for row in read_csv(folder / "time_offset.csv")]
    scans = [(float(row["stamp"]), row["points"]) for row in read_csv(folder / "ego_velocity.csv")]
    names = ["online"] + [f"pass_{i}" for i in range(1, len(summary.get("pass_offsets_s", [])))]
    before = [read_run(folder / name) for name in names if (folder / name).is_dir()]
    return Run(1e3 * float(summary["final_offset_s"]), 1e3 * float(summary["final_offset_sigma_s"]), summary, curve,
               scans, before)


def truth_of(bag):
    """The TUM file beside a simulated bag."""
    return pathlib.Path(bag).with_suffix(".tum")


class Laboratory:
    """Runs the programs. Bags and files of runs live in a scratch folder and are removed once read."""

    def __init__(self, programs, scratch, options, show_progress):
        self.programs, self.scratch, self.show_progress = programs, scratch, show_progress
        self.config, self.settings, self.jobs = options.config, options.set, options.jobs
        self.duration, self.simulation = options.duration, options.simulate
        self.stopped = threading.Event()
        self.lock = threading.Lock()
        self.done, self.total, self.started = 0, 0, time.monotonic()

    def execute(self, program, arguments):
        if self.stopped.is_set():
            raise ExperimentError("stopped")
        command = [str(self.programs / program)] + [str(a) for a in arguments]
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, universal_newlines=True,
                              check=False)
        if done.returncode != 0:
            lines = done.stderr.strip().splitlines()
            raise ExperimentError(lines[-1] if lines else f"{program} ended with status {done.returncode}")

    def simulate(self, source):
        handle, bag = tempfile.mkstemp(prefix=f"{source.name}_", suffix=".bag", dir=self.scratch)
        os.close(handle)
        arguments = ["--motion", source.motion, "--seed", source.seed, "--time-offset", repr(1e-3 * source.offset),
                     "--out", bag, "--ground-truth", truth_of(bag), *self.simulation]
        if self.duration is not None:
            arguments += ["--duration", repr(self.duration)]
        self.execute("simulate", arguments)
        return pathlib.Path(bag)

    def run(self, bag, settings, read=read_run):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="run_", dir=self.scratch))
        arguments = ["--bag", bag, "--config", self.config, "--output-dir", folder]
        for setting in self.settings + [f"{key}={value}" for key, value in settings.items()]:
            arguments += ["--set", setting]
        try:
            self.execute("rio_t_bag", arguments)
            return read(folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            self.tick()

    def tick(self):
        with self.lock:
            self.done += 1
            if not self.show_progress:
                return
            share = min(1.0, self.done / max(1, self.total))
            left = (time.monotonic() - self.started) * (1 / share - 1)
            sys.stderr.write(f"\r[{'#' * int(40 * share):40}] {self.done}/{self.total} runs, {left:4.0f} s left ")
            if self.done == self.total:
                sys.stderr.write("\n")
            sys.stderr.flush()

    def map(self, work):
        """Results, in order, of `work`: (source, count of runs, function of lab and bag). Side by side; a simulated
        bag is made for the first that wants it and removed after the last."""
        users, locks = {}, {}
        for source, _, _ in work:
            users[id(source)] = users.get(id(source), 0) + 1
            locks[id(source)] = threading.Lock()
        self.done, self.total, self.started = 0, sum(count for _, count, _ in work), time.monotonic()

        def one(source, function):
            if source.motion is None:
                return function(self, source.bag)
            with locks[id(source)]:
                if source.bag is None:
                    source.bag = self.simulate(source)
            try:
                return function(self, source.bag)
            finally:
                with locks[id(source)]:
                    users[id(source)] -= 1
                    if users[id(source)] == 0:
                        source.bag.unlink()
                        truth_of(source.bag).unlink()
                        source.bag = None

        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = [pool.submit(one, source, function) for source, _, function in work]
            try:
                return [future.result() for future in futures]
            except BaseException:
                self.stopped.set()
                for future in futures:
                    future.cancel()
                if self.show_progress:
                    sys.stderr.write("\n")
                raise


def rio_t(model, shift=0.0, **more):
    return {"estimate_time_offset": "true", "time_offset_model": model, "radar_stamp_shift": seconds(shift), **more}


def lc_rio(shift=0.0):
    return {"estimate_time_offset": "false", "radar_stamp_shift": seconds(shift)}


def seconds(milliseconds):
    return f"{1e-3 * milliseconds:.9f}"


def one_run(settings):
    return lambda lab, bag: lab.run(bag, settings)


def one_run_or_fault(settings):
    """The Run, or one line why there is none."""
    def function(lab, bag):
        try:
            return lab.run(bag, settings)
        except ExperimentError as error:
            return str(error)
    return function


# --- Tables and pages ---


@dataclasses.dataclass
class Table:
    name: str
    title: str
    columns: list
    rows: list
    marks: set = dataclasses.field(default_factory=set)  # (row, column) that the page, not the CSV, marks with `!`

    def markdown(self):
        cells = [self.columns] + [[f"{cell} !" if (i, j) in self.marks else str(cell) for j, cell in enumerate(row)]
                                  for i, row in enumerate(self.rows)]
        widths = [max(len(row[i]) for row in cells) for i in range(len(self.columns))]
        lines = ["| " + " | ".join(cell.ljust(width) for cell, width in zip(row, widths)) + " |" for row in cells]
        lines.insert(1, "| " + " | ".join("-" * width for width in widths) + " |")
        return "\n".join(lines)


def fixed(value, decimals, sign=False):
    return "" if value is None or math.isnan(value) else f"{value:{'+' if sign else ''}.{decimals}f}"


def mean(values):
    return statistics.fmean(values) if values else math.nan


def spread(values):
    return statistics.stdev(values) if len(values) > 1 else math.nan


def seed_text(seed):
    return "" if seed is None else str(seed)


@dataclasses.dataclass
class Page:
    """What an experiment leaves: facts, tables and figures."""
    title: str
    notes: list = dataclasses.field(default_factory=list)
    tables: list = dataclasses.field(default_factory=list)
    figures: list = dataclasses.field(default_factory=list)
    conclusion: str = ""  # the last line

    def write(self, folder, name, command):
        notes = self.notes + [f"command: `{command}`"]
        text = [f"# {self.title}", "\n".join(f"- {note}" for note in notes)]
        for table in self.tables:
            text += [f"## {table.title}", table.markdown()]
            with open(folder / f"{table.name}.csv", "w", newline="") as file:
                for note in notes:
                    file.write(f"# {note}\n")
                writer = csv.writer(file, lineterminator="\n")
                writer.writerow(table.columns)
                writer.writerows(table.rows)
        for figure, file_name in self.figures:
            figure.savefig(folder / file_name, dpi=120, bbox_inches="tight")
            text.append(f"![{file_name}]({file_name})")
        if self.conclusion:
            text.append(self.conclusion)
        (folder / f"{name}.md").write_text("\n\n".join(text) + "\n")
        shown = [table for table in self.tables if not table.name.endswith("_runs")]
        print("\n\n".join(f"{table.title}\n{table.markdown()}" for table in shown))
        files = [f"{name}.md"] + [f"{table.name}.csv" for table in self.tables] + [file for _, file in self.figures]
        print(f"\nin {folder}: {', '.join(files)}")
        if self.conclusion:
            print(self.conclusion)


def plots():
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot
    return matplotlib.pyplot


def tidy(axes, x_label, y_label):
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.grid(True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_curves(source, panels):
    """`panels`: for each model (name, [(label, Run, Run of the batch or None, end it should reach)])."""
    plt = plots()
    figure, axes = plt.subplots(1, len(panels), figsize=(6 * len(panels), 4.6), sharey=True, squeeze=False)
    colours = plt.get_cmap("viridis")
    ends = [v for _, curves in panels for _, run, _, goal in curves for v in (run.offset, goal)]
    for axis, (model, curves) in zip(axes[0], panels):
        begin = min(run.curve[0][0] for _, run, _, _ in curves)
        for i, (label, run, batch, goal) in enumerate(curves):
            colour = colours(0.9 * i / max(1, len(curves) - 1))
            if batch is not None:
                axis.plot([t - begin for t, _, _ in batch.curve], [offset for _, offset, _ in batch.curve],
                          color="#999999", linewidth=1.2, label="batch" if i + 1 == len(curves) else None)
            # Wide below, narrow above: passes that agree lie on each other.
            axis.plot([t - begin for t, _, _ in run.curve], [offset for _, offset, _ in run.curve],
                      color=colour, linewidth=max(1.2, 3.6 - 1.2 * i), label=label)
            axis.axhline(goal, color=colour, linewidth=0.9, linestyle=":")
        axis.set_title(model, loc="left", fontsize=10)
        tidy(axis, "time [s]", "time offset [ms]" if axis is axes[0][0] else "")
    margin = 0.35 * max(max(ends) - min(ends), 5.0)
    axes[0][0].set_ylim(min(ends) - margin, max(ends) + margin)
    axes[0][-1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=8)
    figure.suptitle(f"{label_of(source)}; dotted: the value to be reached", fontsize=10)
    return figure


def draw_bars(groups, methods, values, y_label):
    """`values[group][method]`."""
    plt = plots()
    figure, axis = plt.subplots(figsize=(max(6, 1.6 * len(groups) + 2), 4))
    colours = [COLOURS.get(method, COLOURS["imu"]) for method in methods]
    width = 0.8 / len(methods)
    for i, (method, colour) in enumerate(zip(methods, colours)):
        axis.bar([g + (i - (len(methods) - 1) / 2) * width for g in range(len(groups))],
                 [values[group][method] for group in groups], width * 0.94, color=colour, label=method)
    axis.set_xticks(range(len(groups)))
    axis.set_xticklabels(groups)
    tidy(axis, "", y_label)
    axis.legend(frameon=False, fontsize=9)
    return figure


# --- The experiments ---


def label_of(source):
    return source.name if source.seed is None else f"{source.name}, seed {source.seed}"


def stamps_apart(trigger, arrival):
    """Mean of arrival minus trigger stamp [ms] of the same scans, which the counts of their points tell. None if the
    scans cannot be paired."""
    best, best_share = None, 0.9
    for lag in range(-30, 31):
        pairs = list(zip(trigger.scans[max(0, -lag):], arrival.scans[max(0, lag):]))
        if len(pairs) < 20:
            continue
        share = mean([float(a[1] == b[1]) for a, b in pairs])
        if share > best_share:
            best, best_share = [1e3 * (b[0] - a[0]) for a, b in pairs if a[1] == b[1]], share
    return mean(best) if best else None


def shifts(lab, sources, options):
    values = options.shifts
    work, keys = [], []
    for source in sources:
        for model in MODELS:
            for shift in values:
                keys.append((source.name, source.seed, model, shift))
                work.append((source, 1, one_run(rio_t(model, shift, mode="batch"))))
            for stamps in () if "stamp_source" in options.set_keys else ("trigger", "arrival"):
                keys.append((source.name, source.seed, model, stamps))
                work.append((source, 1, one_run_or_fault(rio_t(model, stamp_source=stamps))))
    runs = dict(zip(keys, lab.map(work)))
    # A batch keeps the online run that it began from.
    batches = {key: run for key, run in runs.items() if key[-1] not in ("trigger", "arrival")}
    runs.update({key: run.before[0] for key, run in batches.items()})

    page = Page("Estimate of the time offset under shifted stamps")
    page.notes.append(f"shifts {', '.join(f'{shift:g}' for shift in values)} ms are added to the stamps of the radar "
                      "(radar_stamp_shift)")
    page.notes.append("the paper's mean step is 2.37 ms for shifts of 2.5 ms")
    page.notes.append("batch: the whole bag solved at once (mode: batch), its estimate at the end; grey in the figure")
    rows, single, arrival_rows = [], [], []
    for source in sources:
        at = lambda model, what: runs[source.name, source.seed, model, what]  # noqa: E731
        for model in MODELS:
            last = None
            for shift in values:
                run, batch = at(model, shift), batches[source.name, source.seed, model, shift]
                step = None if last is None else run.offset - last
                error = None if source.offset is None else run.offset - source.offset - shift
                single.append([source.name, seed_text(source.seed), model, f"{shift:g}", fixed(run.offset, 3),
                               fixed(run.sigma, 3), fixed(step, 3), fixed(error, 3, sign=True), fixed(batch.offset, 3),
                               fixed(batch.sigma, 3)])
                last = run.offset
            steps = [at(model, b).offset - at(model, a).offset for a, b in zip(values, values[1:])]
            ends = [batches[source.name, source.seed, model, shift].offset for shift in values]
            batch_steps = [b - a for a, b in zip(ends, ends[1:])]
            rows.append([source.name, seed_text(source.seed), model, fixed(at(model, values[0]).offset, 3),
                         fixed(mean(steps), 3), fixed(min(steps), 3), fixed(max(steps), 3), fixed(ends[0], 3),
                         fixed(mean(batch_steps), 3), fixed((values[-1] - values[0]) / (len(values) - 1), 3)])
            if "stamp_source" in options.set_keys:
                continue
            trigger, arrival = at(model, "trigger"), at(model, "arrival")
            fault = next((run for run in (trigger, arrival) if isinstance(run, str)), None)
            if fault is None:
                apart = stamps_apart(trigger, arrival)
                difference = arrival.offset - trigger.offset
                arrival_rows.append([source.name, seed_text(source.seed), model, fixed(trigger.offset, 3),
                                     fixed(arrival.offset, 3), fixed(difference, 3), fixed(apart, 3),
                                     fixed(None if apart is None else difference - apart, 3, sign=True)])
            elif model == MODELS[0]:
                page.notes.append(f"{label_of(source)}: arrival against trigger stamps not run ({fault})")
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
    source = sources[0]
    panels = []
    for model in MODELS:
        first = runs[source.name, source.seed, model, values[0]]
        base = source.offset if source.offset is not None else first.offset - values[0]
        panels.append((model, [(f"{shift:g} ms", runs[source.name, source.seed, model, shift],
                                batches[source.name, source.seed, model, shift], base + shift) for shift in values]))
    page.figures.append((draw_curves(source, panels), "shifts.png"))
    return page


def delay(lab, sources, options):
    del options

    def passes(model, base):
        def function(laboratory, bag):
            # Without a known truth the estimate of the bag as it is counts as zero delay, as in the paper.
            start = laboratory.run(bag, rio_t(model)).offset if base is None else base
            last = laboratory.run(bag, rio_t(model, DELAY - start, mode="refine", refine_passes=PASSES))
            return start, last.before + [last]
        return function

    keys = [(source, model) for source in sources for model in MODELS]
    results = lab.map([(source, 1 + (source.offset is None), passes(model, source.offset))
                       for source, model in keys])
    page = Page("A delay of 100 ms in passes")
    page.notes.append("stamps are shifted so that the whole offset is 100 ms (radar_stamp_shift); each pass takes the "
                      "estimate of the pass before off the stamps (mode: refine)")
    page.notes.append("paper: 66.2, 94.3 and 99.5 ms after passes 1, 2 and 3")
    rows = []
    for (source, model), (start, runs) in zip(keys, results):
        totals = [run.offset for run in runs]
        rows.append([source.name, seed_text(source.seed), model, fixed(start, 3)] + [fixed(t, 3) for t in totals] +
                    [fixed(totals[-1] - DELAY, 3, sign=True)])
    for model in MODELS:
        of_model = [runs for (_, m), (_, runs) in zip(keys, results) if m == model]
        totals = [mean([runs[i].offset for runs in of_model]) for i in range(PASSES)]
        rows.append(["mean", "", model, ""] + [fixed(t, 3) for t in totals] + [fixed(totals[-1] - DELAY, 3, sign=True)])
    page.tables.append(Table("delay", "Estimate of the delay after each pass", [
        "sequence", "seed", "model", "offset of the bag [ms]"] + [f"pass {i + 1} [ms]" for i in range(PASSES)] + [
            "error at the end [ms]"], rows))
    first = sources[0]
    panels = [(model, [(f"pass {i + 1}", run, None, DELAY) for i, run in enumerate(runs)])
              for (source, model), (_, runs) in zip(keys, results) if source is first]
    page.figures.append((draw_curves(first, panels), "delay.png"))
    return page


METRICS = (("t_rel", "t_rel [m/m]", 4), ("r_rel_deg", "r_rel [deg/m]", 3), ("ate_m", "ATE [m]", 3))


def metric_means(runs):
    return [mean([run.figure(key) for run in runs]) for key, _, _ in METRICS]


def percent(new, old):
    return fixed(100 * (new - old) / old, 1, sign=True) if old and not math.isnan(old) else ""


def need_truth(source, run):
    if "ate_m" not in run.summary:
        raise ExperimentError(f"{source.bag}: no ground truth in the bag; name its topic with "
                              "--set ground_truth_topic=..., or a TUM file with --set ground_truth=FILE")


def compared_table(names, baseline, methods, runs):
    """Rows of a method per sequence and their mean, each against the baseline. `runs[name][method]`: list of Run."""
    rows, ate = [], {}
    for name in names + (["mean"] if len(names) > 1 else []):
        chosen = names if name == "mean" else [name]
        figures = {m: [mean(c) for c in zip(*[metric_means(runs[n][m]) for n in chosen])] for m in methods}
        ate[name] = {m: figures[m][-1] for m in methods}
        for method in methods:
            used = [run for n in chosen for run in runs[n][method]]
            offset = mean([run.offset for run in used])
            rows.append([name, method, str(len(used)), fixed(offset, 2) if name != "mean" else ""] +
                        [fixed(value, decimals) for value, (_, _, decimals) in zip(figures[method], METRICS)] +
                        ["" if method == baseline else percent(value, old)
                         for value, old in zip(figures[method], figures[baseline])])
    columns = ["sequence", "method", "runs", "offset [ms]"] + [label for _, label, _ in METRICS] + [
        f"{label.split(' [')[0]} change [%]" for _, label, _ in METRICS]
    return columns, rows, ate


def runs_table(name, keys, results):
    rows = [[source.name, seed_text(source.seed), fixed(source.offset, 2), method, fixed(run.offset, 3),
             fixed(run.sigma or math.nan, 3)] +
            [fixed(run.figure(key), decimals + 1) for key, _, decimals in METRICS]
            for (source, method), run in zip(keys, results)]
    return Table(name, "Each run", ["sequence", "seed", "true offset [ms]", "method", "offset [ms]", "sigma [ms]"] +
                 [label for _, label, _ in METRICS], rows)


def table1(lab, sources, options):
    del options
    methods = ["LC-RIO"] + [f"RIO-T {model}" for model in MODELS]
    settings = dict(zip(methods, [lc_rio()] + [rio_t(model) for model in MODELS]))
    keys = [(source, method) for source in sources for method in methods]
    results = lab.map([(source, 1, one_run(settings[method])) for source, method in keys])
    runs = {}
    for (source, method), run in zip(keys, results):
        need_truth(source, run)
        runs.setdefault(source.name, {}).setdefault(method, []).append(run)
    page = Page("Table I: RIO-T against LC-RIO")
    page.notes.append("LC-RIO is the same graph with the offset held at zero (estimate_time_offset: false); changes "
                      "are against it")
    page.notes.append("paper, ATE of LC-RIO and RIO-T: Gym 0.274, 0.278; Mocap easy 0.124, 0.128; medium 0.128, 0.130; "
                      "difficult 0.489, 0.420 m")
    columns, rows, ate = compared_table(list(runs), "LC-RIO", methods, runs)
    page.tables += [Table("table1", "Mean of the runs", columns, rows), runs_table("table1_runs", keys, results)]
    shown = {"LC-RIO": "LC-RIO", "RIO-T imu": "imu", "RIO-T constant_acceleration": "constant_acceleration"}
    page.figures.append((draw_bars(list(ate), list(shown.values()),
                                   {n: {shown[m]: v for m, v in by.items()} for n, by in ate.items()}, "ATE [m]"),
                         "table1.png"))
    return page


def table2(lab, sources, options):
    del options
    original, corrected = "LC-RIO", "LC-RIO corrected"

    def pair(laboratory, bag):
        before = laboratory.run(bag, lc_rio())
        estimate = laboratory.run(bag, rio_t(MODELS[0])).offset
        return before, estimate, laboratory.run(bag, lc_rio(-estimate))

    results = lab.map([(source, 3, pair) for source in sources])
    runs, keys, flat = {}, [], []
    for source, (before, estimate, after) in zip(sources, results):
        need_truth(source, before)
        after.offset = estimate  # what the stamps were corrected by
        for method, run in ((original, before), (corrected, after)):
            runs.setdefault(source.name, {}).setdefault(method, []).append(run)
            keys.append((source, method))
            flat.append(run)
    page = Page("Table II: stamps corrected by RIO-T's estimate")
    page.notes.append(f"the offset is what the model `{MODELS[0]}` estimates at the end of the same bag; it is taken "
                      "off the stamps (radar_stamp_shift)")
    page.notes.append("paper, ATE of LC-RIO without and with correction: Gym 0.274, 0.278; Mocap difficult 0.489, "
                      "0.267 m; mean of three 0.348, 0.251 m")
    columns, rows, ate = compared_table(list(runs), original, [original, corrected], runs)
    page.tables += [Table("table2", "Mean of the runs", columns, rows), runs_table("table2_runs", keys, flat)]
    page.figures.append((draw_bars(list(ate), [original, corrected], ate, "ATE [m]"), "table2.png"))
    return page


def montecarlo(lab, sources, options):
    del options
    methods = [f"RIO-T {model}" for model in MODELS] + ["LC-RIO"]
    settings = dict(zip(methods, [rio_t(model) for model in MODELS] + [lc_rio()]))
    keys = [(source, method) for source in sources for method in methods]
    results = lab.map([(source, 1, one_run_or_fault(settings[method])) for source, method in keys])
    page = Page("Monte-Carlo over seeds")
    page.notes.append("covered: share of the runs whose 95 % interval (estimate at the end +- 1.96 sigma) holds the "
                      "true offset")
    groups, single = {}, []
    for (source, method), run in zip(keys, results):
        group = groups.setdefault((source.name, source.offset, method), {"runs": [], "failed": 0})
        if isinstance(run, str):
            group["failed"] += 1
            single.append([source.name, source.seed, fixed(source.offset, 2), method, "", "", "", "", "", run])
            continue
        need_truth(source, run)
        group["runs"].append((run, run.offset - source.offset))
        rejected = ", ".join(f"{count} {reason}" for reason, count in run.summary["scans_rejected"].items()
                             if reason != "before_initialization")
        estimated = method != "LC-RIO"
        single.append([source.name, source.seed, fixed(source.offset, 2), method,
                       fixed(run.offset - source.offset, 3, sign=True) if estimated else "",
                       fixed(run.sigma, 3) if estimated else "", fixed(run.figure("ate_m"), 4),
                       fixed(run.figure("t_rel"), 4), fixed(run.figure("r_rel_deg"), 3), rejected])
    rows = []
    for (name, offset, method), group in groups.items():
        runs = group["runs"]
        ates = [run.figure("ate_m") for run, _ in runs]
        errors = [error for _, error in runs] if method != "LC-RIO" else []
        covered = [float(abs(error) <= NORMAL_95 * run.sigma) for run, error in runs] if errors else []
        # A run that initialised only at the end has small errors and says nothing.
        used = [100 * run.figure("scans_used") / max(1.0, run.figure("scans_total")) for run, _ in runs]
        rows.append([name, fixed(offset, 2), method, len(runs), group["failed"],
                     fixed(min(used, default=math.nan), 0), fixed(mean(ates), 3),
                     fixed(spread(ates), 3), fixed(statistics.median(ates) if ates else math.nan, 3),
                     fixed(max(ates, default=math.nan), 3), fixed(mean(errors), 3, sign=True), fixed(spread(errors), 3),
                     fixed(mean([abs(e) for e in errors]), 3), fixed(max(map(abs, errors), default=math.nan), 3),
                     fixed(mean([run.sigma for run, _ in runs]) if errors else math.nan, 3),
                     fixed(100 * mean(covered), 0)])
    page.tables.append(Table("montecarlo", "Errors by motion and offset", [
        "motion", "true offset [ms]", "method", "runs", "failed", "least scans used [%]", "ATE mean [m]", "ATE sd [m]",
        "ATE median [m]", "ATE max [m]", "offset error mean [ms]", "sd [ms]", "mean size [ms]", "max size [ms]", "mean sigma [ms]",
        "covered [%]"], rows))
    page.tables.append(Table("montecarlo_runs", "Each run", [
        "motion", "seed", "true offset [ms]", "method", "offset error [ms]", "sigma [ms]", "ATE [m]", "t_rel [m/m]",
        "r_rel [deg/m]", "scans rejected after the start, or why there is no result"], single))
    page.figures.append((draw_spread(groups), "montecarlo.png"))
    return page


def draw_spread(groups):
    plt = plots()
    cases = list(dict.fromkeys((name, offset) for name, offset, _ in groups))
    methods = list(dict.fromkeys(method for _, _, method in groups))
    figure, axes = plt.subplots(2, 1, figsize=(max(7, 1.25 * len(cases) + 2), 8), sharex=True)
    for i, method in enumerate(methods):
        colour = COLOURS.get(method.replace("RIO-T ", ""), "#000000")
        for g, case in enumerate(cases):
            runs = groups[case + (method,)]["runs"]
            x = [g + 0.26 * (i - 1)] * len(runs)
            style = {"color": colour, "alpha": 0.55, "markersize": 4, "label": method if g == 0 else None}
            axes[1].plot(x, [run.figure("ate_m") for run, _ in runs], "o", **style)
            if method != "LC-RIO":
                axes[0].plot(x, [max(abs(error), 1e-3) for _, error in runs], "o", **style)
    axes[0].set_yscale("log")
    axes[1].set_yscale("log")
    axes[1].set_xticks(range(len(cases)))
    axes[1].set_xticklabels([f"{name}\n{offset:g} ms" for name, offset in cases], fontsize=8)
    tidy(axes[0], "", "size of the offset error [ms]")
    tidy(axes[1], "motion and true offset; a dot is a run", "ATE [m]")
    for axis in axes:
        axis.legend(frameon=False, fontsize=8, ncol=3, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


def judged(text):
    return text != "" and not HONEST[0] <= float(text) <= HONEST[1]


def consistency(lab, sources, options):
    import nees
    del options

    def work(source):
        def function(laboratory, bag):
            def read(folder):
                return read_run(folder), nees.read_consistency(folder, truth_of(bag), 1e-3 * source.offset)
            try:
                return laboratory.run(bag, {}, read)
            except (ExperimentError, nees.NeesError) as error:
                return str(error)
        return function

    results = lab.map([(source, 1, work(source)) for source in sources])
    if all(isinstance(result, str) for result in results):
        raise ExperimentError(f"no run has a result: {results[0]}")
    page = Page("Consistency: errors over their stated sigmas")
    page.notes.append("NEES per degree of freedom: the mean over axes and time of (error / sigma)^2, 1 for an honest "
                      f"estimator; `!` marks what is outside {HONEST[0]:g} to {HONEST[1]:g}")
    page.notes.append("the truth is moved to the estimate at the first stamp by translation and yaw only; the "
                      f"{nees.SETTLING:g} s after it are left out")
    page.notes.append("axes are those of the world: tilt is the rotation error about x and y, yaw about z")
    page.notes.append("errors of one run are alike over time, so a run is little more than one sample of yaw or offset: "
                      "of an honest estimator, the mean of five runs is outside the limits three times in ten")
    columns = [f"{part} NEES" for part in nees.PARTS]
    groups, single, single_marks = {}, [], set()
    for source, result in zip(sources, results):
        group = groups.setdefault((source.name, source.offset), [])
        key = [source.name, fixed(source.offset, 2), source.seed]
        if isinstance(result, str):
            single.append(key + [""] * (len(columns) + 5) + [result])
            continue
        run, figures = result
        need_truth(source, run)
        group.append(result)
        cells = [fixed(figures.nees[part], 3) for part in nees.PARTS]
        single_marks |= {(len(single), 3 + i) for i, cell in enumerate(cells) if judged(cell)}
        single.append(key + cells + [
            fixed(figures.offset_quantile(0.95), 2), fixed(figures.offset_quantile(1.0), 2),
            fixed(run.offset - source.offset, 3, sign=True), fixed(run.sigma, 3), fixed(run.figure("ate_m"), 4),
            remark_of(run)])
    for name, title, middle in (("consistency", "Mean of the runs", mean),
                                ("consistency_median", "Median of the runs", median)):
        rows, marks = [], set()
        for (motion, offset), group in groups.items():
            failed = sum(s.name == motion and s.offset == offset for s in sources) - len(group)
            of = lambda figure: middle([figure(run, figures) for run, figures in group])  # noqa: E731,B023
            cells = [fixed(of(lambda _, figures: figures.nees[part]), 2) for part in nees.PARTS]  # noqa: B023
            marks |= {(len(rows), 4 + i) for i, cell in enumerate(cells) if judged(cell)}
            rows.append([motion, fixed(offset, 2), len(group), failed, *cells,
                         fixed(of(lambda _, figures: figures.offset_quantile(0.95)), 2),
                         fixed(of(lambda run, _: run.offset - offset), 3, sign=True),  # noqa: B023
                         fixed(of(lambda run, _: abs(run.offset - offset)), 3),  # noqa: B023
                         fixed(of(lambda run, _: run.sigma), 3), fixed(of(lambda run, _: run.figure("ate_m")), 3)])
        page.tables.append(Table(name, title, [
            "motion", "true offset [ms]", "runs", "failed", *columns, "offset error/sigma, 95 % of time",
            "offset error at end [ms]", "size [ms]", "sigma at end [ms]", "ATE [m]"], rows, marks))
    page.tables.append(Table("consistency_runs", "Each run", [
        "motion", "true offset [ms]", "seed", *columns, "offset error/sigma, 95 % of time", "largest",
        "offset error at end [ms]", "sigma at end [ms]", "ATE [m]", "remark, or why there is no result"], single,
        single_marks))
    page.figures.append((draw_nees(groups, nees.PARTS), "consistency.png"))
    told = []
    for table in page.tables[:2]:
        given = sum(cell != "" for row in table.rows for cell in row[4:4 + len(columns)])
        told.append(f"{len(table.marks)} of {given} {'means' if table is page.tables[0] else 'medians'}")
    page.conclusion = f"{' and '.join(told)} of NEES are outside {HONEST[0]:g} to {HONEST[1]:g}"
    return page


def median(values):
    return statistics.median(values) if values else math.nan


def remark_of(run):
    said = []
    if run.summary.get("health_at_end") not in (None, "ok"):
        said.append(f"health at the end: {run.summary['health_at_end']}")
    for key in ("divergences", "reinitializations"):
        if run.summary.get(key):
            said.append(f"{run.summary[key]} {key}")
    return ", ".join(said)


def draw_nees(groups, parts):
    plt = plots()
    figure, axis = plt.subplots(figsize=(max(7, 1.5 * len(groups) + 2), 4.6))
    colours = plt.get_cmap("viridis")
    axis.axhspan(*HONEST, color="#eeeeee")
    axis.axhline(1.0, color="#999999", linewidth=0.9)
    for i, part in enumerate(parts):
        points = [(g + 0.12 * (i - (len(parts) - 1) / 2), figures.nees[part])
                  for g, group in enumerate(groups.values()) for _, figures in group]
        axis.plot([x for x, _ in points], [max(y, 1e-3) for _, y in points], "o", markersize=4, alpha=0.7,
                  color=colours(0.9 * i / (len(parts) - 1)), label=part)
    axis.set_yscale("log")
    axis.set_xticks(range(len(groups)))
    axis.set_xticklabels([f"{name}\n{offset:g} ms" for name, offset in groups], fontsize=8)
    tidy(axis, "motion and true offset; a dot is a run", "NEES per degree of freedom")
    axis.legend(frameon=False, fontsize=8, ncol=len(parts), loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


# --- Arguments ---


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise ExperimentError(f"{message} (see --help)")


def finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


finite.__name__ = "number"


def positive(text):
    value = finite(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not above 0")
    return value


def count(text):
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1")
    return int(text)


def shift_list(text):
    try:
        values = [finite(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) < 2 or any(b <= a for a, b in zip(values, values[1:])):
        raise argparse.ArgumentTypeError(f"'{text}' is not two or more rising numbers with commas between")
    return values


def own_setting(experiment, key):
    """Whether the experiment sets the parameter itself."""
    if experiment == "consistency":
        return key in ("mode", "radar_stamp_shift", "refine_passes")
    return key in OWN_KEYS


def simulation_words(text):
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise ExperimentError(f"--simulate '{text}': {str(error).lower()}") from error
    for word in words:
        if word.startswith("--") and word[2:].partition("=")[0] in OWN_SIMULATION:
            raise ExperimentError(f"--simulate: the experiment sets {word.partition('=')[0]} itself")
    return words


def join_simulate(words):
    """So that the value of --simulate may begin with a dash."""
    joined = []
    for word in words:
        if joined and joined[-1] == "--simulate":
            joined[-1] = f"--simulate={word}"
        else:
            joined.append(word)
    return joined


def parse(words):
    parser = Parser(prog="experiment.sh", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("experiment", choices=EXPERIMENTS, metavar="|".join(EXPERIMENTS))
    parser.add_argument("--output", metavar="DIR", type=pathlib.Path, help="where to write (results/EXPERIMENT)")
    parser.add_argument("--bag", metavar="BAG", type=pathlib.Path, action="append", default=[],
                        help="run on this bag instead of simulated ones; may be repeated; not for montecarlo "
                             "and consistency")
    parser.add_argument("--config", metavar="CONFIG", default="irs", help="configuration of rio_t_bag (irs)")
    parser.add_argument("--set", metavar="key=value", action="append", default=[],
                        help="parameter of rio_t_bag; may be repeated")
    parser.add_argument("--seeds", metavar="N", type=count,
                        help="simulated runs of each motion, seeds 1 to N (3; montecarlo 10; consistency 5)")
    parser.add_argument("--motion", metavar="NAME", action="append",
                        help="simulated motion; may be repeated (shifts, delay: difficult; tables: easy, medium, "
                             "difficult, gym_loop; montecarlo: easy, medium, difficult; consistency: difficult, "
                             "medium, drone, ground_vehicle, gym_loop, start_in_motion)")
    parser.add_argument("--time-offset", metavar="S", type=finite, action="append",
                        help="true offset of the simulated bags [s] (-0.00925; montecarlo also 0.03 and 0.1; "
                             "consistency 0.03; may be repeated for these two)")
    parser.add_argument("--duration", metavar="S", type=positive,
                        help="length of the simulated bags [s] (the motion's own)")
    parser.add_argument("--simulate", metavar="OPTIONS", default="",
                        help="more options for the simulated bags, as one word: \"--imu-rate 100 --points 30\"; "
                             "simulate --help lists them")
    parser.add_argument("--shifts", metavar="MS,MS,...", type=shift_list, default=DEFAULT_SHIFTS,
                        help="of the experiment `shifts` [ms] (0,2.5,...,15)")
    parser.add_argument("--jobs", metavar="N", type=count, default=os.cpu_count() or 1,
                        help="runs side by side (all cores)")
    parser.add_argument("--programs", metavar="DIR", type=pathlib.Path, help="where rio_t_bag and simulate are")
    parser.add_argument("--check", action="store_true", help="only check the arguments")
    options = parser.parse_args(join_simulate(words))
    for bag in options.bag:
        if not bag.is_file():
            raise ExperimentError(f"--bag {bag}: no such file")
    if options.bag and options.experiment in SIMULATED_ONLY:
        raise ExperimentError(f"--bag: {options.experiment} draws its bags itself")
    options.simulate = simulation_words(options.simulate)
    if options.bag:
        for name in ("seeds", "motion", "time_offset", "duration", "simulate"):
            if getattr(options, name) not in (None, []):
                raise ExperimentError(f"--{name.replace('_', '-')}: for simulated bags only, not with --bag")
    if options.time_offset and len(options.time_offset) > 1 and options.experiment not in SIMULATED_ONLY:
        raise ExperimentError("--time-offset: more than one is for montecarlo and consistency only")
    options.set_keys = set()
    for setting in options.set:
        key, equals, _ = setting.partition("=")
        if not equals or not key:
            raise ExperimentError(f"--set {setting}: expected key=value")
        if own_setting(options.experiment, key):
            raise ExperimentError(f"--set {setting}: the experiment sets {key} itself")
        options.set_keys.add(key)
    options.output = options.output or pathlib.Path("results") / options.experiment
    options.seeds = options.seeds or DEFAULT_SEEDS.get(options.experiment, 3)
    return options


def find_programs(given):
    here = pathlib.Path(__file__).resolve().parent
    candidates = [given] if given else [
        pathlib.Path(sys.argv[0]).resolve().parent,
        *(pathlib.Path(p) / "lib" / "rio_t" for p in os.environ.get("CMAKE_PREFIX_PATH", "").split(":") if p),
        here.parent / os.environ.get("RIO_T_BUILD_DIR", "build") / "devel" / "lib" / "rio_t"]
    for folder in candidates:
        if all(os.access(folder / name, os.X_OK) for name in ("rio_t_bag", "simulate")):
            return folder
    raise ExperimentError("the programs rio_t_bag and simulate are not found: run scripts/build.sh, or give "
                          "--programs DIR")


def sources_of(options):
    if options.bag:
        names = [bag.stem for bag in options.bag]
        for name in names:
            if names.count(name) > 1:
                raise ExperimentError(f"--bag: two bags are called {name}")
        return [Source(name, bag=bag) for name, bag in zip(names, options.bag)]
    default = DEFAULT_OFFSETS.get(options.experiment, [FRAME_OFFSET])
    offsets = [1e3 * s for s in options.time_offset] if options.time_offset else default
    motions = list(dict.fromkeys(options.motion or DEFAULT_MOTIONS[options.experiment]))
    return [Source(motion, seed, motion, offset) for motion in motions for offset in dict.fromkeys(offsets)
            for seed in range(1, options.seeds + 1)]


def describe(sources, options):
    if options.bag:
        notes = [f"bags: {', '.join(bag.name for bag in options.bag)}; configuration {options.config}"]
    else:
        motions = dict.fromkeys(s.motion for s in sources)
        offsets = dict.fromkeys(f"{s.offset:g}" for s in sources)
        duration = f"; {options.duration:g} s each" if options.duration else ""
        notes = [f"simulated motions {', '.join(motions)}; seeds 1 to {options.seeds}; true offset "
                 f"{', '.join(offsets)} ms{duration}; configuration {options.config}"]
    if options.simulate:
        notes.append(f"simulated with {shlex.join(options.simulate)}")
    if options.set:
        notes.append(f"parameters: {', '.join(options.set)}")
    return notes


def own_words(words):
    """The command line, quoted, without what experiment.sh adds."""
    without = [w for i, w in enumerate(words) if w != "--programs" and (i == 0 or words[i - 1] != "--programs")]
    return [shlex.quote(word) for word in without]


def main(words):
    try:
        options = parse(words)
        if options.check:
            return 0
        plots()  # fails now rather than after the runs
        programs = find_programs(options.programs)
        sources = sources_of(options)
        options.output.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".runs_", dir=options.output) as scratch:
            lab = Laboratory(programs, pathlib.Path(scratch), options, sys.stderr.isatty())
            page = globals()[options.experiment](lab, sources, options)
        page.notes = describe(sources, options) + page.notes
        page.write(options.output, options.experiment, " ".join(["scripts/experiment.sh"] + own_words(words)))
    except (ExperimentError, OSError, ImportError) as error:
        print(f"experiment.sh: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
