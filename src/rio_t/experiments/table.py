"""The experiments by name, and the bags that they run on."""
from ..errors import RioTError
from . import consistency, delay, montecarlo, shifts, table1, table2
from .laboratory import Source

EXPERIMENTS = {  # (laboratory, sources, options) -> Page
    "shifts": shifts.run,
    "delay": delay.run,
    "table1": table1.run,
    "table2": table2.run,
    "montecarlo": montecarlo.run,
    "consistency": consistency.run}


def sources_of(options):
    if options.bag:
        names = [bag.stem for bag in options.bag]
        for name in names:
            if names.count(name) > 1:
                raise RioTError(f"--bag: two bags are called {name}")
        return [Source(name, bag=bag) for name, bag in zip(names, options.bag)]
    return [Source(motion, seed, motion, offset) for motion in options.motion for offset in options.offsets
            for seed in range(1, options.seeds + 1)]
