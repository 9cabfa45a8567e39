"""Runs the pipeline on bags with a fault, and judges what it makes of them."""
import dataclasses
import functools
import os
import pathlib
import shutil
import subprocess
import tempfile
from typing import Optional

import numpy
import yaml

from .. import programs, run_folder
from ..errors import RioTError
from . import cases, injection, judge, stream

SIMULATION = ["--motion", "medium", "--seed", "11", "--time-offset", "0.03", "--duration", "60", "--static-start", "5",
              "--static-end", "3", "--imu-rate", "200"]
REAL_BAG = "real/ti_mmwave_rospkg_demo.bag"
TIMEOUT = 300.0  # [s] for one run of the pipeline: longer, it hangs


@dataclasses.dataclass(frozen=True)
class Bag:
    """A bag without fault, and how to run the pipeline on it."""
    name: str
    path: pathlib.Path
    config: str
    topics: tuple  # (topic, kind)
    truth: Optional[pathlib.Path] = None
    settings: tuple = ()  # of rio_t_bag in every run, key=value


def topics_of(folder, config):
    """Topics and their kinds, as the configuration names them."""
    values = yaml.safe_load(programs.output_of(folder / "rio_t_bag", "--print-config", "--config", config))
    return tuple((values[f"{kind}_topic"], kind) for kind in ("imu", "radar", "trigger"))


def bags_for(folder, scratch, given, config):
    """The given bag; else a simulated one, made with the programs in `folder`, and the real one if it is there."""
    if given:
        return [Bag("given", pathlib.Path(given).resolve(), config, topics_of(folder, config))]
    path, truth = scratch / "simulated.bag", scratch / "simulated.truth.txt"
    programs.output_of(folder / "simulate", *SIMULATION, "--out", path, "--ground-truth", truth)
    bags = [Bag("simulated", path, "irs", topics_of(folder, "irs"), truth)]
    real = pathlib.Path(os.environ.get("RIO_T_DATA_DIR", "../shared/data")) / REAL_BAG
    if real.exists():
        bags.append(Bag("real", real.resolve(), "ti_mmwave", topics_of(folder, "ti_mmwave")))
    else:
        print(f"No real bag at {real}: simulated data only (RIO_T_DATA_DIR names the folder).", flush=True)
    return bags


def run_pipeline(folder, bag, config, settings, output):
    """(exit status, stderr); a run that hangs has the status None."""
    words = [word for setting in settings for word in ("--set", setting)]
    try:
        done = programs.run(folder / "rio_t_bag", "--bag", bag, "--config", config, "--output-dir", output, *words,
                            timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return None, f"hangs: no end after {TIMEOUT:.0f} s"
    return done.returncode, done.stderr


@functools.lru_cache(maxsize=None)
def messages_of(bag):
    """Once in each process that runs cases."""
    return stream.read(bag.path, bag.topics)


def ensure_usual(folder, bag, settings, output):
    """The run without the fault, once for all cases with these settings."""
    if (output / "summary.yaml").exists():
        return
    own = pathlib.Path(tempfile.mkdtemp(prefix="usual_", dir=output.parent))
    status, errors = run_pipeline(folder, bag.path, bag.config, bag.settings + settings, own)
    if status not in programs.HAS_RESULT:
        raise RioTError(f"{bag.path} without a fault: {errors.strip()}")
    try:
        own.rename(output)
    except OSError:  # another case was faster
        shutil.rmtree(own)


def judge_case(folder, bag, case, scratch, keep):
    messages, (begin, end) = messages_of(bag), case.when
    scratch.mkdir(parents=True, exist_ok=True)
    site = injection.Site(messages[0].record, begin, end, numpy.random.RandomState(1))
    faulty = case.fault(messages, site)
    faulty_bag = scratch / "faulty.bag"
    stream.write(faulty_bag, faulty)
    status, errors = run_pipeline(folder, faulty_bag, bag.config, bag.settings + case.settings, scratch / "run")
    (scratch / "stderr.txt").write_text(errors)
    if not keep:
        faulty_bag.unlink()

    usual = scratch.parent / ("usual_" + "_".join(s.replace("/", "") for s in case.settings))
    ensure_usual(folder, bag, case.settings, usual)
    origin = 1e-9 * next(m for m in messages if m.kind == "imu").stamp
    truth = judge.read_truth(bag.truth) if bag.truth else judge.read_run(usual)
    outcome = judge.read_outcome(scratch / "run", status, errors, truth, origin, case.shift, begin)
    outcome.usual = run_folder.read_yaml(usual / "summary.yaml")
    outcome.reference = judge.errors_against(truth, judge.read_run(usual), origin)
    outcome.last_imu = 1e-9 * [m for m in faulty if m.kind == "imu"][-1].stamp - case.shift
    outcome.has_truth = bag.truth is not None
    outcome.length = 1e-9 * (messages[-1].record - messages[0].record)
    return case.expect.judge(outcome, begin, min(end, 1e6))


def run_case(folder, bag, name, scratch, keep):
    """(what happened, [what is wrong]) of one case on one bag, with the programs in `folder`."""
    try:
        return judge_case(folder, bag, next(case for case in cases.CASES if case.name == name), scratch, keep)
    except Exception as error:  # a case that cannot be judged has failed; the others go on
        return f"{type(error).__name__}: {error}", ["the case itself failed"]
