"""Seeds x motions, each run with sensors of its own drawn at random: where is the estimate sure and wrong?"""
import random

from .. import nees
from .consistency import COLUMNS, remark_of, results_of
from .laboratory import grouped
from .page import Page, Table, fixed, median

LARGEST = 4.0  # NEES per degree of freedom: errors of twice the sigma on average
# Options of `simulate`, and the values they may take: what cheap and good sensors have, on calm and rough platforms.
VALUES = {
    "imu-rate": (100, 200, 409, 800),
    "accel-noise": (0.0008, 0.0024, 0.01),
    "gyro-noise": (0.0001, 0.0002, 0.0008),
    "vibration": (0, 0, 0.3, 1),
    "vibration-gyro": (0, 0, 0.01, 0.05),
    "static-start": (0, 3, 5, 8),
    "static-end": (0, 2, 5),
    "radar-rate": (5, 10, 15, 20, 30, 50),
    "azimuth-noise-deg": (0.5, 2, 5),
    "elevation-noise-deg": (1, 4, 8),
    "fov-azimuth-deg": (30, 60, 80),
    "fov-elevation-deg": (10, 20, 45),
    "doppler-noise": (0.01, 0.03, 0.1),
    "doppler-step": (0, 0.04, 0.125, 0.25, 0.49),
    "ghosts": (0, 0.03, 0.1),
    "moving": (0, 0.1, 0.3),
    "crowd": (1, 2),
    "dropouts": (0, 0, 0.05, 0.3),
    "latency": (0.01, 0.06, 0.2),
    "latency-sigma": (0, 0.005, 0.02),
    "points": (5, 10, 20, 43, 80, 150),
    "imu-dropouts": (0, 0, 0.1, 0.33)}


def draw(motion, seed):
    """The words for `simulate`: the same for the same motion and seed."""
    dice = random.Random(f"{motion} {seed}")
    drawn = {name: dice.choice(values) for name, values in VALUES.items()}
    drawn["points-sigma"], drawn["points-max"] = 0.25 * drawn["points"], 2 * drawn["points"]
    if motion == "start_in_motion":  # it has no rest at the start
        del drawn["static-start"]
    return [word for name, value in drawn.items() for word in (f"--{name}", f"{value:g}")]


def is_wrong(figures):
    return any(figures.nees[part] > LARGEST for part in nees.PARTS)


def row_of_run(source, result):
    key = [source.name, source.seed]
    if isinstance(result, str):
        return key + [""] * (len(COLUMNS) + 2) + [result, " ".join(source.words)]
    run, figures = result
    return key + [fixed(figures.nees[part], 2) for part in nees.PARTS] + [
        fixed(100.0 * run.figure("ate_m") / run.figure("path_length_m"), 2), run.summary["verdict"], remark_of(run),
        " ".join(source.words)]


def row_of_motion(motion, results):
    good = [result for result in results if not isinstance(result, str)]
    wrong = [run for run, figures in good if is_wrong(figures)]
    return [motion, len(good), len(results) - len(good)] + [
        fixed(median([figures.nees[part] for _, figures in good]), 2) for part in nees.PARTS] + [
        len(wrong), sum(run.summary["verdict"] == "good" for run in wrong)]


def run(lab, sources, _):
    for source in sources:
        source.words = draw(source.motion, source.seed)
    results = results_of(lab, sources)
    groups = grouped(sources, [source.name for source in sources], results)
    page = Page("Platforms: sensors drawn at random")
    page.notes.append("NEES per degree of freedom, as in the experiment consistency; a run is sure and wrong if one of "
                      f"them is above {LARGEST:g}, which `!` marks")
    page.notes.append("a run fails if the odometry never starts")
    rows = [row_of_motion(motion, of) for motion, of in groups.items()]
    page.tables.append(Table("platforms", "Median of the runs", [
        "motion", "runs", "failed", *COLUMNS, "sure and wrong", "of these with verdict good"], rows))
    single = [row_of_run(source, result) for source, result in zip(sources, results)]
    marks = {(i, j) for i, row in enumerate(single) for j in range(2, 2 + len(COLUMNS))
             if row[j] != "" and float(row[j]) > LARGEST}
    page.tables.append(Table("platforms_runs", "Each run", [
        "motion", "seed", *COLUMNS, "ATE [% of the way]", "verdict", "remark, or why there is no result",
        "simulate"], single, marks))
    page.conclusion = (f"{sum(row[-2] for row in rows)} of {sum(row[1] for row in rows)} runs are sure and wrong, "
                       f"{sum(row[-1] for row in rows)} of them with the verdict good")
    return page
