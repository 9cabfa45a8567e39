"""The experiments by name, and how one runs."""
import pathlib
import shlex
import tempfile

from .. import programs
from ..errors import RioTError
from . import aids, consistency, delay, montecarlo, platforms, shifts, tables
from .laboratory import Laboratory, Source

EXPERIMENTS = {  # (laboratory, sources, options) -> Page
    "shifts": shifts.run,
    "delay": delay.run,
    "table1": tables.table1,
    "table2": tables.table2,
    "montecarlo": montecarlo.run,
    "consistency": consistency.run,
    "platforms": platforms.run,
    "aids": aids.run}


def sources_of(options):
    if options.bag:
        names = [bag.stem for bag in options.bag]
        for name in names:
            if names.count(name) > 1:
                raise RioTError(f"--bag: two bags are called {name}")
        return [Source(name, bag=bag) for name, bag in zip(names, options.bag)]
    return [Source(motion, seed, motion, offset) for motion in options.motion for offset in options.offsets
            for seed in range(1, options.seeds + 1)]


def describe(options):
    if options.bag:
        notes = [f"bags: {', '.join(bag.name for bag in options.bag)}; configuration {options.config}"]
    else:
        duration = f"; {options.duration:g} s each" if options.duration else ""
        notes = [f"simulated motions {', '.join(options.motion)}; seeds 1 to {options.seeds}; true offset "
                 f"{', '.join(f'{offset:g}' for offset in options.offsets)} ms{duration}; configuration "
                 f"{options.config}"]
    if options.simulate:
        notes.append(f"simulated with {shlex.join(options.simulate)}")
    if options.set:
        notes.append(f"parameters: {', '.join(options.set)}")
    return notes


def own_words(words):
    """The command line, quoted, without what experiment.sh adds."""
    without = [w for i, w in enumerate(words) if w != "--programs" and (i == 0 or words[i - 1] != "--programs")]
    return " ".join(["scripts/experiment.sh"] + [shlex.quote(word) for word in without])


def run(options, words):
    folder = programs.find(("rio_t_bag", "simulate"), "--programs DIR", options.programs)
    sources = sources_of(options)
    options.output_dir.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".runs_", dir=options.output_dir) as scratch:
        lab = Laboratory(folder, pathlib.Path(scratch), options)
        page = EXPERIMENTS[options.experiment](lab, sources, options)
    page.notes = describe(options) + page.notes
    page.write(options.output_dir, options.experiment, own_words(words))
