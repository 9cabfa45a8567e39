"""The program: scripts/report.py."""
import argparse
import dataclasses
import math
import pathlib
import sys
import tempfile
from typing import Optional

import numpy as np
from scipy.spatial.transform import Rotation

from . import __doc__ as description
from . import figures
from .. import programs, run_folder, tum
from ..command_line import Parser
from ..errors import RioTError
from ..rig import radars_of, read_config
from .accuracy import ERRORS, accuracy_rows, offset_rows, run_evaluate
from .animation import write_animation
from .motion import configured_extrinsics, motion, predicted_ego_velocity, rises
from .page import Page

CAUSAL = "trajectory.txt"
ESTIMATES = ((figures.OPTIMIZED, "trajectory_optimized.txt"), (figures.ESTIMATE, CAUSAL))
# By the mode of the run: the names of the two trajectories, and their meaning.
NAMES = {
    "online": (("optimised", "online"), "online is what a live user gets, optimised what left the smoother's window"),
    "refine": (("optimised", "last pass"), "last pass is the causal output of the last pass, optimised what left the "
                                           "smoother's window"),
    "batch": (("batch, nodes", "batch"), "batch is the whole bag solved at once, nodes its states at the scans")}


@dataclasses.dataclass
class Track:
    """A trajectory under its name and colour; `time` in seconds of the run."""
    name: str
    colour: str
    file: pathlib.Path
    poses: tum.Trajectory
    time: Optional[np.ndarray] = None


@dataclasses.dataclass
class Radar:
    """What is drawn of a radar. Tables are None if their file is absent or has no row; they have a column `time` [s]."""
    name: str  # empty if there is only one
    offset: Optional[dict]
    scans: Optional[dict]
    extrinsics: Optional[dict]

    def title(self, text):
        return f"{text}: {self.name}" if self.name else text


@dataclasses.dataclass
class Run:
    """What is drawn. Tables as those of Radar."""
    origin: int     # [ns] where the seconds of the run begin
    estimates: list  # Tracks, that of trajectory.txt last
    truth: Optional[Track]
    radars: list
    biases: Optional[dict]
    landmarks: Optional[dict] = None  # map.csv
    summary: dict = dataclasses.field(default_factory=dict)  # empty if the run did not finish

    @property
    def mode(self):
        return self.summary.get("mode", "online")


def timed(table, origin):
    return {**table, "time": 1e-9 * (table["stamp"] - origin)}


def has_lines(file):
    """rio_t_bag leaves empty tables if a run is refused."""
    return file.is_file() and file.stat().st_size > 0


def read_run(folder, truth_file):
    if not folder.is_dir():
        raise RioTError(f"{folder}: no such folder; expected the output folder of rio_t_bag")
    if not (folder / "trajectory.txt").is_file():
        raise RioTError(f"{folder / 'trajectory.txt'}: missing; expected the output folder of rio_t_bag")
    if truth_file and not truth_file.is_file():
        raise RioTError(f"{truth_file}: no such file; expected a trajectory (TUM format)")
    summary = run_folder.read_yaml(folder / "summary.yaml") if (folder / "summary.yaml").is_file() else {}
    names, _ = NAMES[summary.get("mode", "online")]
    estimates = [Track(name, colour, folder / file, tum.read(folder / file))
                 for name, (colour, file) in zip(names, ESTIMATES) if (folder / file).is_file()]
    estimates = [track for track in estimates if len(track.poses)]
    truth = Track("ground truth", figures.TRUTH, truth_file, tum.read(truth_file)) if truth_file else None
    origin = min((int(track.poses.stamp[0]) for track in estimates), default=0) // 10**9 * 10**9
    for track in estimates + ([truth] if truth else []):
        track.time = track.poses.seconds(origin)

    def table(name, radar=""):
        if not has_lines(folder / run_folder.of_radar(name, radar)):
            return None
        content = timed(run_folder.read(folder, name, radar), origin)
        return content if len(content["time"]) else None

    radars = [Radar(name, table("time_offset.csv", name), table("ego_velocity.csv", name), table("extrinsics.csv", name))
              for name in run_folder.radars(folder)]
    landmarks = run_folder.read(folder, "map.csv") if has_lines(folder / "map.csv") else None
    return Run(origin, estimates, truth, radars, table("biases.csv"), landmarks, summary)


CHECKS = {  # name in summary.yaml: for people
    "started": "the estimate started",
    "scans_used_share": "share of the scans after the start that were used",
    "scans_before_start_share": "share of the scans that came before the estimate started",
    "silent_time_share": "share of the time after the start without a used scan",
    "points_kept_share": "share of the points that the filter kept",
    "scans_diverged_share": "share of the scans with a diverged estimate",
    "windows_at_offset_bound_share": "share of the windows with the offset at max_time_offset",
    "windows_not_converged_share": "share of the windows that stopped before they converged",
    "mounting_turned_sigmas": "turn of mounting or vehicle frame from the configured one, in sigmas",
    "held_lever_arm_error_sigmas": "error of a lever arm that is not estimated, in sigmas",
    "doppler_scaled_sigmas": "error of the scale of the Doppler, in sigmas",
    "held_offset_error_sigmas": "error of a time offset that is not estimated, in sigmas",
    "imu_faults_share": "share of the IMU samples with a fault",
    "healthy_at_end": "the estimate is healthy at the end"}
VERDICTS = {
    "good": "This run is good: nothing speaks against it.",
    "doubtful": "This run is doubtful. Look at what is red, and at the likely causes.",
    "bad": "This run is bad: do not trust the estimate."}


def add_verdict(page, summary):
    """Whether the run is good: the verdict of rio_t_bag with its numbers, and what to change."""
    page.heading("Is this run good?")
    if not summary:
        return page.verdict("bad", "The run did not finish.")
    verdict = summary.get("verdict")
    if verdict not in VERDICTS:
        return page.note("This run is of an older version, which gave no verdict.")
    page.verdict(verdict, VERDICTS[verdict])
    page.checks([(CHECKS.get(check["name"], check["name"]), float(check["value"]),
                  " ".join(f"{bound.replace('_', ' ')} {check[bound]:g}" for bound in ("at_least", "at_most")
                           if bound in check), check["good"]) for check in summary.get("checks", [])])
    causes = summary.get("causes") or []
    if causes:
        page.note("The most likely causes, and what to change:")
        page.table([[f"{k}.", cause["text"] + " " + cause["remedy"]] for k, cause in enumerate(causes, 1)])
    return None


def add_summary(page, summary):
    page.heading("Summary")
    if summary:
        page.table([[key, value] for key, value in summary.items() if key not in ("saved", "checks", "causes")])
    else:
        page.note("No summary.yaml: the run did not finish.")


def add_accuracy(page, run, program, max_difference):
    """Errors over time: (name, colour, table of `evaluate --errors`)."""
    if run_folder.starts_again(run.summary):
        page.heading("Accuracy", "Not judged: the estimate starts again where the clock of the IMU jumped. Run each part by "
                                 "itself (bag_start, bag_duration).")
        return []
    page.heading("Accuracy", f"Against {run.truth.file.name}; {NAMES[run.mode][1]}. Definitions as in evo.")
    evaluations, errors = [], []
    for track in run.estimates:
        with tempfile.TemporaryDirectory() as scratch:
            table = pathlib.Path(scratch) / "errors.csv"
            try:
                result = run_evaluate(program, run.truth.file, track.file, "--errors", table, "--max-difference",
                                      max_difference)
            except RioTError as error:
                if track.file.name == CAUSAL:
                    raise
                page.note(str(error))  # few poses: a sparse truth may match none of them
                continue
            evaluations.append(result["estimates"][0])
            errors.append((track.name, track.colour, timed(run_folder.read_table(table, ERRORS), run.origin)))
    page.table(accuracy_rows(evaluations), [""] + [name for name, _, _ in errors])
    return errors


def add_trajectory(page, run, errors):
    page.heading("Trajectory", "Without the landmarks: they are in the world of the estimate, not in that of the truth."
                 if errors and run.landmarks is not None else "")
    if errors:
        def positions(table, prefix=""):
            return np.stack([table[prefix + k] for k in "xyz"], -1)
        tracks = [(run.truth.name, run.truth.colour, positions(errors[-1][2], "truth_"))]
        tracks += [(name, colour, positions(table)) for name, colour, table in errors]
    else:
        tracks = [(track.name, track.colour, track.poses.position) for track in run.estimates]
    page.figure("trajectory", figures.draw_trajectory(tracks, None if errors else run.landmarks))
    if errors:
        page.heading("Error over time", "Aligned at the first pose.")
        page.figure("errors", figures.draw_errors(errors))


def motions_of(run):
    """(name, colour, result of motion()): of the truth near the run, and of the best estimate that is dense enough. Empty
    if a clock of the run went back."""
    if not all(rises(track.time) for track in run.estimates):
        return []
    motions = [(track.name, track.colour, motion(track.time, track.poses)) for track in run.estimates]
    motions = [each for each in motions if each[2] is not None][:1]
    if run.truth and run.estimates:
        time, span = run.truth.time, run.estimates[-1].time  # the truth may cover much more
        near = (time >= span[0] - 1) & (time <= span[-1] + 1)
        motions.insert(0, (run.truth.name, run.truth.colour, motion(time[near], run.truth.poses[near])))
    return [each for each in motions if each[2] is not None]


def last_extrinsics(table):
    """Position of the radar in the IMU frame and R_IR, at the end of the run."""
    def last(*names):
        return np.array([table[name][-1] for name in names])
    return last("x", "y", "z"), Rotation.from_quat(last("qx", "qy", "qz", "qw"))


def add_extrinsics(page, radar, folder):
    """The estimate over time, and how far it went from the mounting configured."""
    path = folder / "summary.yaml"
    if path.is_file():
        configured = configured_extrinsics(run_folder.read_yaml(path), path, radar.name)
        note = ""
    else:  # the run did not finish: only its first estimate is left of what was configured
        configured = last_extrinsics({name: column[:1] for name, column in radar.extrinsics.items()})
        note = "Without summary.yaml: from its first estimate."
    page.heading(radar.title("Extrinsics"), "How far the radar is from where the configuration puts it, about and along "
                                            "the axes of the IMU, with a band of 1 sigma. " + note)
    lever, rotation = last_extrinsics(radar.extrinsics)
    turn = np.degrees((rotation * configured[1].inv()).as_rotvec())
    sigma = {name: radar.extrinsics["sigma_" + name][-1] for name in ("x", "y", "z", "rx", "ry", "rz")}
    rows = [[f"turn about {axis} [deg]", f"{turn[i]:.3f}", f"{np.degrees(sigma['r' + axis]):.3f}"]
            for i, axis in enumerate("xyz")]
    rows += [[f"lever arm along {axis} [mm]", f"{1e3 * (lever[i] - configured[0][i]):.1f}", f"{1e3 * sigma[axis]:.1f}"]
             for i, axis in enumerate("xyz") if sigma[axis] > 0]
    page.table(rows, ["last estimate minus the configured value", "", "sigma"])
    page.figure(run_folder.of_radar("extrinsics", radar.name), figures.draw_extrinsics(radar.extrinsics, configured))


def configured_mountings(arguments, radars):
    """Those of --config, by the name of the radar in the run."""
    if not arguments.config:
        return {}
    folder = programs.find(["rio_t_bag"], "--evaluate FILE beside it", arguments.evaluate and arguments.evaluate.parent)
    mountings = {name: (lever, rotation)
                 for name, lever, rotation in radars_of(read_config(folder, arguments.config))}
    if len(mountings) == len(radars) == 1:  # a run has no name for its only radar, the configuration may have one
        return dict(zip((radar.name for radar in radars), mountings.values()))
    return mountings


def mounting(radar, configured):
    """Position of the radar in the IMU frame and R_IR, None if not known, and where that is from."""
    if radar.extrinsics is not None:
        return last_extrinsics(radar.extrinsics), "as estimated at the end"
    if radar.name not in configured:
        return None, "fitted to the data; give --config for the true one"
    lever, rotation = configured[radar.name]
    if lever is None:
        return None, "fitted to the data, since the configuration takes it from tf"
    return (lever, rotation), "from the configuration"


def add_ego_velocity(page, radar, motions, extrinsics, source):
    predicted, how = None, ""
    if motions:
        at = radar.scans["time"]
        if radar.offset is not None:
            at = at - np.interp(at, radar.offset["time"], radar.offset["offset_s"])  # measured at stamp - t_O
        predicted, how = predicted_ego_velocity(radar.scans, at, motions[0][2], extrinsics, source)
    if predicted is not None:
        page.heading(radar.title("Ego-velocity residuals"),
                     f"Radar minus what the {motions[0][0]} trajectory predicts, in the radar frame; {how}.")
    else:
        page.heading(radar.title("Ego-velocity"), "As measured, in the radar frame.")
    page.figure(run_folder.of_radar("ego_velocity", radar.name), figures.draw_ego_velocity(radar.scans, predicted))


def true_offsets_of(radars, given):
    """By the name of the radar, from the pairs (name, seconds) of --true-offset."""
    names = [radar.name for radar in radars]
    for name, _ in given:
        if name not in names:
            expected = f"NAME=S with a name of {', '.join(names)}" if names != [""] else "S, since there is one radar"
            raise RioTError(f"--true-offset: expected {expected}, got {f'the name {name}' if name else 'no name'}")
    return dict(given)


def report(arguments):
    """Writes the page; its path."""
    run = read_run(arguments.run, arguments.ground_truth)
    true_offsets = true_offsets_of(run.radars, arguments.true_offset)
    configured = configured_mountings(arguments, run.radars)
    mountings = {radar.name: mounting(radar, configured) for radar in run.radars}
    judge_poses = run.truth and run.estimates
    judge_offset = any(radar.name in true_offsets and radar.offset is not None for radar in run.radars)
    program = arguments.evaluate
    if (judge_poses or judge_offset) and not program:
        program = programs.find(["evaluate"], "--evaluate FILE") / "evaluate"
    folder = arguments.output_dir or arguments.run / "report"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RioTError(f"{folder}: cannot be made ({error.strerror})") from None

    page = Page(folder, f"rio_t: {arguments.run.resolve().name}")
    add_verdict(page, run.summary)
    add_summary(page, run.summary)
    errors = add_accuracy(page, run, program, arguments.max_difference) if judge_poses else []
    for radar in run.radars:
        if radar.name not in true_offsets or radar.offset is None:
            continue
        page.heading(radar.title("Time offset against the truth"))
        table = arguments.run / run_folder.of_radar("time_offset.csv", radar.name)
        result = run_evaluate(program, "--time-offset", table, "--true-offset", repr(true_offsets[radar.name]))
        page.table(offset_rows(result["time_offset"]))
    if run.estimates:
        add_trajectory(page, run, errors)
    else:
        page.note("No poses: the estimator never initialised.")
    motions = motions_of(run)
    if motions:
        page.heading("Velocity", "In the IMU frame, from differences of the poses.")
        page.figure("velocity", figures.draw_velocity(motions))
    for radar in run.radars:
        if radar.offset is not None:
            page.heading(radar.title("Time offset of the radar"), "A scan stamped s was measured at s minus the offset.")
            page.figure(run_folder.of_radar("time_offset", radar.name),
                        figures.draw_offset(radar.offset, true_offsets.get(radar.name)))
        if radar.extrinsics is not None:
            add_extrinsics(page, radar, arguments.run)
        if radar.scans is not None:
            add_ego_velocity(page, radar, motions, *mountings[radar.name])
    if run.biases is not None:
        page.heading("Biases of the IMU")
        page.figure("biases", figures.draw_biases(run.biases))
    path = page.write()
    if arguments.animation:
        radar = run.radars[0]
        write_animation(arguments.animation, run.estimates[-1] if run.estimates else None, radar.offset,
                        true_offsets.get(radar.name))
    return path


def program_path(text):
    """pathlib drops "./", and a name without a folder is looked up in PATH."""
    return pathlib.Path(text).resolve()


def finite(text):
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError("expected a finite number")
    return value


def named_offset(text):
    """`S` or `NAME=S`: the name, empty if none, and the seconds."""
    name, equals, value = text.rpartition("=")
    if equals and not name:
        raise argparse.ArgumentTypeError("expected S or NAME=S")
    return name, finite(value)


EXAMPLES = """Examples:
  rosrun rio_t report.py out
  rosrun rio_t report.py out --ground-truth truth.txt --true-offset 0.1 --animation run.gif
"""


def main(words):
    parser = Parser(prog="report.py", description=description, epilog=EXAMPLES)
    parser.add_argument("run", metavar="RUN_DIR", type=pathlib.Path, help="output folder of rio_t_bag")
    parser.add_argument("--ground-truth", metavar="FILE", type=pathlib.Path, help="true trajectory, TUM format")
    parser.add_argument("--true-offset", metavar="[NAME=]S", type=named_offset, action="append", default=[],
                        help="true time offset of the radar [s]; with several radars, give it once for each, with its name")
    parser.add_argument("--max-difference", metavar="S", type=finite, default=0.01,
                        help="largest difference of the stamps of two poses that are compared [s] (0.01)")
    parser.add_argument("--config", metavar="NAME_OR_PATH",
                        help="configuration of the run, as for rio_t_bag, for the radar's mounting")
    parser.add_argument("--output-dir", metavar="DIR", type=pathlib.Path, help="where to write (RUN_DIR/report)")
    parser.add_argument("--animation", metavar="FILE.gif", type=pathlib.Path,
                        help="also draw path and time offset of the first radar as a moving picture")
    parser.add_argument("--evaluate", metavar="FILE", type=program_path,
                        help="the program evaluate, if it is not found; rio_t_bag is beside it")
    try:
        print(report(parser.parse_args(words)))
    except (RioTError, OSError) as error:
        print(f"report.py: {error}", file=sys.stderr)
        return 1
    return 0
