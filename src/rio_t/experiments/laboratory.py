"""Runs the programs on bags, side by side."""
import concurrent.futures
import dataclasses
import math
import os
import pathlib
import shutil
import tempfile
import threading
from typing import Optional

from tqdm import tqdm

from .. import programs, run_folder
from ..errors import RioTError

MODELS = ("imu", "constant_acceleration")  # of the time offset: ours and the paper's


@dataclasses.dataclass
class Source:
    """A bag, given or simulated when it is first needed."""
    name: str
    seed: Optional[int] = None
    motion: Optional[str] = None
    offset: Optional[float] = None  # ms, the truth if it is known
    bag: Optional[pathlib.Path] = None
    words: list = dataclasses.field(default_factory=list)  # more options for `simulate`
    users: int = 0                  # work that still wants a simulated bag
    lock: threading.Lock = dataclasses.field(default_factory=threading.Lock)

    @property
    def label(self):
        return self.name if self.seed is None else f"{self.name}, seed {self.seed}"

    @property
    def seed_text(self):
        return "" if self.seed is None else str(self.seed)


@dataclasses.dataclass
class Run:
    """One run of rio_t_bag. Offsets and sigmas in ms."""
    offset: float
    sigma: float
    summary: dict
    curve: dict     # the table time_offset.csv
    scans: dict     # the table ego_velocity.csv
    before: list = dataclasses.field(default_factory=list)  # Runs: the online pass of a batch, the earlier passes
    cpu: float = math.nan  # [s] of rio_t_bag, user and system

    def figure(self, key):
        return float(self.summary.get(key, math.nan))


def read_run(folder):
    """What rio_t_bag left in the folder, with the passes that it keeps in folders below."""
    summary = run_folder.read_yaml(folder / "summary.yaml")
    if run_folder.radars(folder) != [""]:
        raise RioTError("expected a configuration of one radar: the experiments compare one time offset")
    names = ["online"] + [f"pass_{i}" for i in range(1, len(summary.get("pass_offsets_s", [])))]
    return Run(1e3 * float(summary["final_offset_s"]), 1e3 * float(summary["final_offset_sigma_s"]), summary,
               run_folder.read(folder, "time_offset.csv"), run_folder.read(folder, "ego_velocity.csv"),
               [read_run(folder / name) for name in names if (folder / name).is_dir()])


def truth_of(bag):
    """The TUM file beside a simulated bag."""
    return bag.with_suffix(".tum")


class Laboratory:
    """Runs the programs. Bags and files of runs live in a scratch folder and are removed once read."""

    def __init__(self, folder, scratch, options):
        self.folder, self.scratch, self.options = folder, scratch, options
        self.stopped = threading.Event()
        self.progress, self.lock = None, threading.Lock()

    def execute(self, program, *arguments):
        """CPU [s] that the program took."""
        if self.stopped.is_set():
            raise RioTError("stopped")
        return programs.cpu_seconds_of(self.folder / program, *arguments)

    def simulate(self, source):
        handle, name = tempfile.mkstemp(prefix=f"{source.name}_", suffix=".bag", dir=self.scratch)
        os.close(handle)
        bag, duration = pathlib.Path(name), self.options.duration
        self.execute("simulate", "--motion", source.motion, "--seed", source.seed,
                     "--time-offset", repr(1e-3 * source.offset), "--out", bag, "--ground-truth", truth_of(bag),
                     *source.words, *self.options.simulate,
                     *([] if duration is None else ["--duration", repr(duration)]))
        return bag

    def run(self, bag, settings, read=read_run):
        folder = pathlib.Path(tempfile.mkdtemp(prefix="run_", dir=self.scratch))
        arguments = ["--bag", bag, "--config", self.options.config, "--output-dir", folder]
        for setting in self.options.set + [f"{key}={value}" for key, value in settings.items()]:
            arguments += ["--set", setting]
        try:
            cpu = self.execute("rio_t_bag", *arguments)
            result = read(folder)
            run_of(result).cpu = cpu
            return result
        finally:
            shutil.rmtree(folder, ignore_errors=True)
            with self.lock:
                self.progress.update()

    def map(self, work):
        """Runs `work`, a list of (source, count of runs, function of lab and bag), side by side. Returns the results in
        order. A simulated bag is made for its first user and removed after its last. Raises RioTError if no run has a
        result."""
        for source, _, _ in work:
            source.users += 1

        def one(source, function):
            with source.lock:
                if source.bag is None:
                    source.bag = self.simulate(source)
            try:
                return function(self, source.bag)
            finally:
                with source.lock:
                    source.users -= 1
                    if source.users == 0 and source.motion is not None:
                        source.bag.unlink()
                        truth_of(source.bag).unlink()
                        source.bag = None

        with tqdm(total=sum(runs for _, runs, _ in work), unit="run", disable=None) as self.progress, \
                concurrent.futures.ThreadPoolExecutor(self.options.jobs) as pool:
            futures = [pool.submit(one, source, function) for source, _, function in work]
            try:
                results = [future.result() for future in futures]
            except BaseException:
                self.stopped.set()
                for future in futures:
                    future.cancel()
                raise
        if all(isinstance(result, str) for result in results):
            raise RioTError(f"no run has a result: {results[0]}")
        return results


def rio_t(model, shift=0.0, **more):
    """Settings that estimate the offset. `shift` of the stamps in ms."""
    return {"estimate_time_offset": "true", "time_offset_model": model, "radar_stamp_shift": seconds(shift), **more}


def lc_rio(shift=0.0):
    """Settings of the same graph with the offset held at zero."""
    return {"estimate_time_offset": "false", "time_offset_initial": "0", "radar_stamp_shift": seconds(shift)}


def seconds(milliseconds):
    return f"{1e-3 * milliseconds:.9f}"


def one_run(settings):
    return lambda lab, bag: lab.run(bag, settings)


def one_run_or_fault(settings, figures=None):
    """The Run, (Run, figures of its folder and the bag) if there are figures, or one line why there is none."""
    def function(lab, bag):
        def read(folder):
            return read_run(folder) if figures is None else (read_run(folder), figures(folder, bag))
        try:
            return lab.run(bag, settings, read)
        except RioTError as error:
            return str(error)
    return function


def run_of(result):
    return result[0] if isinstance(result, tuple) else result


def need_truth(source, run):
    if "ate_m" in run.summary:
        return
    if run_folder.starts_again(run.summary):
        raise RioTError(f"{source.label}: the estimate starts again where the clock of the IMU jumped, and no truth judges "
                        "that; run each part by itself (--set bag_start=..., --set bag_duration=...)")
    raise RioTError(f"{source.label}: no ground truth in the bag; name its topic with "
                    "--set ground_truth_topic=..., or a TUM file with --set ground_truth=FILE")


def grouped(sources, keys, results):
    """{key: its results}, each as one_run_or_fault gives it. All that ran need the truth."""
    groups = {}
    for source, key, result in zip(sources, keys, results):
        if not isinstance(result, str):
            need_truth(source, run_of(result))
        groups.setdefault(key, []).append(result)
    return groups
