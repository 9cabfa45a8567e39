"""The command line of the experiments. Imports nothing that a bare machine lacks."""
import argparse
import dataclasses
import math
import os
import pathlib
import shlex

from . import __doc__ as description
from .. import command_line
from ..errors import RioTError, UsageError

# ms; the middle of the 18.5 ms frame that an IRS stamp begins.
FRAME_OFFSET = -9.25
HANDHELD = ("easy", "medium", "difficult")
OWN_SIMULATION = ("motion", "trajectory", "out", "ground-truth", "seed", "duration", "time-offset")


@dataclasses.dataclass(frozen=True)
class Plan:
    """What an experiment runs on unless the user says otherwise, and which parameters it sets itself."""
    motions: tuple
    offsets: tuple = (FRAME_OFFSET,)  # ms
    seeds: int = 3
    simulated_only: bool = False      # draws its bags, of more than one offset if asked
    own_keys: tuple = ("time_offset_model", "estimate_time_offset", "radar_stamp_shift", "mode", "refine_passes")


PASSES = ("mode", "radar_stamp_shift", "refine_passes")  # how often a bag is played, and as what
PLANS = {
    "shifts": Plan(("difficult",)),
    "delay": Plan(("difficult",)),
    "table1": Plan((*HANDHELD, "gym_loop")),
    "table2": Plan((*HANDHELD, "gym_loop")),
    # 30 and 100 ms: two delays of systems without a trigger.
    "montecarlo": Plan(HANDHELD, (FRAME_OFFSET, 30.0, 100.0), 10, True),
    "consistency": Plan(("difficult", "medium", "drone", "ground_vehicle", "gym_loop", "start_in_motion"), (30.0,), 5,
                        True, PASSES),
    "platforms": Plan((*HANDHELD, "gym_loop", "walk", "drone", "ground_vehicle", "kart", "constant_speed",
                       "start_in_motion"), (30.0,), 10, True, PASSES),
    "aids": Plan(("ground_vehicle", "kart", "drone", "difficult"), (30.0,), 3, True,
                 (*PASSES, "platform", "barometer_topic", "landmarks"))}


EXAMPLES = """Examples:
  rosrun rio_t experiment.py consistency --motion easy --seeds 2
  rosrun rio_t experiment.py shifts --bag walk.bag --config my.yaml --output-dir out
"""


class Parser(command_line.Parser):
    def error(self, message):
        raise UsageError(f"{message} (see --help)")


def number(text):
    value = float(text)
    if not math.isfinite(value):
        raise ValueError
    return value


def positive(text):
    value = number(text)
    if value <= 0:
        raise argparse.ArgumentTypeError(f"'{text}' is not above 0")
    return value


def count(text):
    if not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1")
    return int(text)


def shift_list(text):
    try:
        values = [number(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) < 2 or any(b <= a for a, b in zip(values, values[1:])):
        raise argparse.ArgumentTypeError(f"'{text}' is not two or more rising numbers with commas between")
    return values


def simulation_words(text):
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise UsageError(f"--simulate '{text}': {str(error).lower()}") from error
    for word in words:
        if word.startswith("--") and word[2:].partition("=")[0] in OWN_SIMULATION:
            raise UsageError(f"--simulate: the experiment sets {word.partition('=')[0]} itself")
    return words


def join_simulate(words):
    """Joins --simulate with its value, which may begin with a dash."""
    joined = []
    for word in words:
        if joined and joined[-1] == "--simulate":
            joined[-1] = f"--simulate={word}"
        else:
            joined.append(word)
    return joined


def by_plan(text_of):
    """"shifts, delay: 3; montecarlo: 10": what the plans have unless the user says otherwise."""
    names = {}
    for name, plan in PLANS.items():
        names.setdefault(text_of(plan), []).append(name)
    return "; ".join(f"{', '.join(of)}: {text}" for text, of in names.items())


def make_parser():
    parser = Parser(prog="experiment.py", description=description, epilog=EXAMPLES)
    parser.add_argument("experiment", choices=PLANS, metavar="|".join(PLANS))
    parser.add_argument("--output-dir", metavar="DIR", type=pathlib.Path, help="where to write (results/EXPERIMENT)")
    parser.add_argument("--bag", metavar="BAG", type=pathlib.Path, action="append", default=[],
                        help="run on this bag instead of simulated ones; may be repeated; not for "
                             + ", ".join(name for name, plan in PLANS.items() if plan.simulated_only))
    parser.add_argument("--config", metavar="CONFIG", default="irs", help="configuration of rio_t_bag (irs)")
    parser.add_argument("--set", metavar="key=value", action="append", default=[],
                        help="parameter of rio_t_bag; may be repeated")
    parser.add_argument("--seeds", metavar="N", type=count,
                        help=f"simulated runs of each motion, seeds 1 to N ({by_plan(lambda plan: str(plan.seeds))})")
    parser.add_argument("--motion", metavar="NAME", action="append",
                        help=f"simulated motion; may be repeated ({by_plan(lambda plan: ', '.join(plan.motions))})")
    parser.add_argument("--time-offset", metavar="S", type=number, action="append",
                        help="true offset of the simulated bags [s]; may be repeated where no --bag is taken ("
                             + by_plan(lambda plan: ", ".join(f"{1e-3 * ms:g}" for ms in plan.offsets)) + ")")
    parser.add_argument("--duration", metavar="S", type=positive,
                        help="length of the simulated bags [s] (the motion's own)")
    parser.add_argument("--simulate", metavar="OPTIONS", default="",
                        help="more options for the simulated bags, as one word: \"--imu-rate 100 --points 30\"; "
                             "simulate --help lists them")
    parser.add_argument("--shifts", metavar="MS,MS,...", type=shift_list, default=[2.5 * i for i in range(7)],
                        help="shifts of the stamps in the experiment `shifts` [ms] (0,2.5,...,15)")
    parser.add_argument("--jobs", metavar="N", type=count, default=os.cpu_count() or 1,
                        help="runs side by side (all cores)")
    parser.add_argument("--programs", metavar="DIR", type=pathlib.Path, help="where rio_t_bag and simulate are")
    parser.add_argument("--check", action="store_true", help="only check the arguments")
    return parser


def parse(words):
    options = make_parser().parse_args(join_simulate(words))
    plan = PLANS[options.experiment]
    for bag in options.bag:
        if not bag.is_file():
            raise RioTError(f"--bag {bag}: no such file")
    if options.bag and plan.simulated_only:
        raise UsageError(f"--bag: {options.experiment} draws its bags itself")
    options.simulate = simulation_words(options.simulate)
    if options.experiment == "platforms" and options.simulate:
        raise UsageError("--simulate: platforms draws these options itself")
    if options.experiment == "aids" and "--barometer" not in options.simulate:
        options.simulate.append("--barometer")
    if options.bag:
        for name in ("seeds", "motion", "time_offset", "duration", "simulate"):
            if getattr(options, name) not in (None, []):
                raise UsageError(f"--{name.replace('_', '-')}: for simulated bags only, not with --bag")
    if options.time_offset and len(options.time_offset) > 1 and not plan.simulated_only:
        raise UsageError("--time-offset: more than one is for montecarlo, consistency, platforms and aids only")
    options.set_keys = set()
    for setting in options.set:
        key, equals, _ = setting.partition("=")
        if not equals or not key:
            raise UsageError(f"--set {setting}: expected key=value")
        if key in plan.own_keys:
            raise UsageError(f"--set {setting}: the experiment sets {key} itself")
        options.set_keys.add(key)
    options.output_dir = options.output_dir or pathlib.Path("results") / options.experiment
    options.seeds = options.seeds or plan.seeds
    options.motion = list(dict.fromkeys(options.motion or plan.motions))
    options.offsets = list(dict.fromkeys(1e3 * s for s in options.time_offset) if options.time_offset else plan.offsets)
    return options
