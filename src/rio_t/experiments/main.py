"""The program: scripts/experiment.py."""
import pathlib
import shlex
import sys
import tempfile

from ..errors import RioTError
from .options import parse


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
    # Late: a wrong argument is told before numpy and matplotlib are installed.
    from .. import programs
    from . import table
    from .laboratory import Laboratory
    folder = programs.find(("rio_t_bag", "simulate"), "--programs DIR", options.programs)
    sources = table.sources_of(options)
    options.output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".runs_", dir=options.output) as scratch:
        lab = Laboratory(folder, pathlib.Path(scratch), options)
        page = table.EXPERIMENTS[options.experiment](lab, sources, options)
    page.notes = describe(options) + page.notes
    page.write(options.output, options.experiment, own_words(words))


def main(words):
    try:
        options = parse(words)
        if not options.check:
            run(options, words)
    except (RioTError, OSError, ImportError) as error:
        print(f"experiment.sh: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    return 0
