"""The program: scripts/report.py."""
import argparse
import dataclasses
import math
import pathlib
import sys
import tempfile
from typing import Optional

import numpy as np

from . import __doc__ as description
from . import figures
from .. import programs, run_folder, tum
from ..errors import RioTError
from .accuracy import ERRORS, accuracy_rows, offset_rows, run_evaluate
from .motion import motion, predicted_ego_velocity, read_extrinsics
from .page import Page

ESTIMATES = (("optimised", figures.OPTIMIZED, "trajectory_optimized.txt"), ("online", figures.ESTIMATE, "trajectory.txt"))


@dataclasses.dataclass
class Track:
    """A trajectory under its name and colour; `time` in seconds of the run."""
    name: str
    colour: str
    file: pathlib.Path
    poses: tum.Trajectory
    time: Optional[np.ndarray] = None


@dataclasses.dataclass
class Run:
    """What is drawn. Tables are None if their file is absent or has no row; they have a column `time` [s]."""
    origin: int     # [ns] where the seconds of the run begin
    estimates: list  # Tracks, the online one last
    truth: Optional[Track]
    offset: Optional[dict]
    scans: Optional[dict]
    biases: Optional[dict]


def timed(table, origin):
    return {**table, "time": 1e-9 * (table["stamp"] - origin)}


def read_run(folder, truth_file):
    if not folder.is_dir():
        raise RioTError(f"{folder}: no such folder; expected the output folder of rio_t_bag")
    if not (folder / "trajectory.txt").is_file():
        raise RioTError(f"{folder / 'trajectory.txt'}: missing; expected the output folder of rio_t_bag")
    if truth_file and not truth_file.is_file():
        raise RioTError(f"{truth_file}: no such file; expected a trajectory (TUM format)")
    estimates = [Track(name, colour, folder / file, tum.read(folder / file))
                 for name, colour, file in ESTIMATES if (folder / file).is_file()]
    estimates = [track for track in estimates if len(track.poses)]
    truth = Track("ground truth", figures.TRUTH, truth_file, tum.read(truth_file)) if truth_file else None
    origin = min((int(track.poses.stamp[0]) for track in estimates), default=0) // 10**9 * 10**9
    for track in estimates + ([truth] if truth else []):
        track.time = track.poses.seconds(origin)

    def table(name):
        if not (folder / name).is_file():
            return None
        content = timed(run_folder.read(folder, name), origin)
        return content if len(content["time"]) else None

    return Run(origin, estimates, truth, table("time_offset.csv"), table("ego_velocity.csv"), table("biases.csv"))


def add_summary(page, folder):
    page.heading("Summary")
    if (folder / "summary.yaml").is_file():
        summary = run_folder.read_yaml(folder / "summary.yaml")
        page.table([[key, value] for key, value in summary.items() if key != "saved"])
    else:
        page.note("No summary.yaml: the run did not finish.")


def add_accuracy(page, run, program, max_difference):
    """Errors over time: (name, colour, table of `evaluate --errors`)."""
    page.heading("Accuracy", f"Against {run.truth.file.name}; online is what a live user gets, optimised "
                             "what left the smoother's window. Definitions as in evo.")
    evaluations, errors = [], []
    for track in run.estimates:
        with tempfile.TemporaryDirectory() as scratch:
            table = pathlib.Path(scratch) / "errors.csv"
            try:
                result = run_evaluate(program, run.truth.file, track.file, "--errors", table, "--max-difference",
                                      max_difference)
            except RioTError as error:
                if track.name == "online":
                    raise
                page.note(str(error))  # few poses: a sparse truth may match none of them
                continue
            evaluations.append(result["estimates"][0])
            errors.append((track.name, track.colour, timed(run_folder.read_table(table, ERRORS), run.origin)))
    page.table(accuracy_rows(evaluations), [""] + [name for name, _, _ in errors])
    return errors


def add_trajectory(page, run, errors):
    page.heading("Trajectory")
    if errors:
        def positions(table, prefix=""):
            return np.stack([table[prefix + k] for k in "xyz"], -1)
        tracks = [(run.truth.name, run.truth.colour, positions(errors[-1][2], "truth_"))]
        tracks += [(name, colour, positions(table)) for name, colour, table in errors]
    else:
        tracks = [(track.name, track.colour, track.poses.position) for track in run.estimates]
    page.figure("trajectory", figures.draw_trajectory(tracks))
    if errors:
        page.heading("Error over time", "Aligned at the first pose.")
        page.figure("errors", figures.draw_errors(errors))


def motions_of(run):
    """(name, colour, result of motion()): of the truth near the run, and of the best estimate."""
    motions = [(track.name, track.colour, motion(track.time, track.poses)) for track in run.estimates[:1]]
    if run.truth and run.estimates:
        time, span = run.truth.time, run.estimates[-1].time  # the truth may cover much more
        near = (time >= span[0] - 1) & (time <= span[-1] + 1)
        motions.insert(0, (run.truth.name, run.truth.colour, motion(time[near], run.truth.poses[near])))
    return [each for each in motions if each[2] is not None]


def add_ego_velocity(page, run, motions, extrinsics):
    predicted, how = None, ""
    if motions:
        at = run.scans["time"]
        if run.offset is not None:
            at = at - np.interp(at, run.offset["time"], run.offset["offset_s"])  # measured at stamp - t_O
        predicted, how = predicted_ego_velocity(run.scans, at, motions[0][2], extrinsics)
    if predicted is not None:
        page.heading("Ego-velocity residuals",
                     f"Radar minus what the {motions[0][0]} trajectory predicts, in the radar frame; {how}.")
    else:
        page.heading("Ego-velocity", "As measured, in the radar frame.")
    page.figure("ego_velocity", figures.draw_ego_velocity(run.scans, predicted))


def report(arguments):
    """Writes the page; its path."""
    run, true_offset = read_run(arguments.run, arguments.ground_truth), arguments.true_offset
    extrinsics = read_extrinsics(arguments.config) if arguments.config else None
    judge_poses, judge_offset = run.truth and run.estimates, true_offset is not None and run.offset is not None
    program = arguments.evaluate
    if (judge_poses or judge_offset) and not program:
        program = programs.find(["evaluate"], "--evaluate FILE") / "evaluate"
    folder = arguments.output or arguments.run / "report"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RioTError(f"{folder}: cannot be made ({error.strerror})") from None

    page = Page(folder, f"rio_t: {arguments.run.resolve().name}")
    add_summary(page, arguments.run)
    errors = add_accuracy(page, run, program, arguments.max_difference) if judge_poses else []
    if judge_offset:
        page.heading("Time offset against the truth")
        result = run_evaluate(program, "--time-offset", arguments.run / "time_offset.csv", "--true-offset",
                              repr(true_offset))
        page.table(offset_rows(result["time_offset"]))
    if run.estimates:
        add_trajectory(page, run, errors)
    else:
        page.note("No poses: the estimator never initialised.")
    motions = motions_of(run)
    if motions:
        page.heading("Velocity", "In the IMU frame, from differences of the poses.")
        page.figure("velocity", figures.draw_velocity(motions))
    if run.offset is not None:
        page.heading("Time offset of the radar", "A scan stamped s was measured at s minus the offset.")
        page.figure("time_offset", figures.draw_offset(run.offset, true_offset))
    if run.scans is not None:
        add_ego_velocity(page, run, motions, extrinsics)
    if run.biases is not None:
        page.heading("Biases of the IMU")
        page.figure("biases", figures.draw_biases(run.biases))
    return page.write()


def finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError("expected a finite number")
    return value


def main(words):
    parser = argparse.ArgumentParser(prog="report.py", description=description,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", metavar="RUN_DIR", type=pathlib.Path, help="output folder of rio_t_bag")
    parser.add_argument("--ground-truth", metavar="FILE", type=pathlib.Path, help="true trajectory, TUM format")
    parser.add_argument("--true-offset", metavar="S", type=finite, help="true time offset of the radar [s]")
    parser.add_argument("--max-difference", metavar="S", type=finite, default=0.01,
                        help="largest difference of the stamps of two poses that are compared [s] (0.01)")
    parser.add_argument("--config", metavar="FILE", type=pathlib.Path,
                        help="configuration of the run, for the radar's mounting")
    parser.add_argument("--output", metavar="DIR", type=pathlib.Path, help="where to write (RUN_DIR/report)")
    parser.add_argument("--evaluate", metavar="FILE", type=pathlib.Path, help="the program, if it is not found")
    try:
        print(report(parser.parse_args(words)))
    except (RioTError, OSError) as error:
        print(f"report.py: {error}", file=sys.stderr)
        return 1
    return 0
