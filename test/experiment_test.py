#!/usr/bin/env python3
"""The experiments from their command to their tables, on short simulated bags.

usage: experiment_test.py RESULTS.xml EXPERIMENT.PY PROGRAMS
"""
import csv
import pathlib
import subprocess
import sys
import tempfile
import traceback
import unittest
import unittest.mock
import xml.sax.saxutils

import numpy
import yaml

MODELS = {"imu", "constant_acceleration"}
SHORT = ["--seeds", "1", "--duration", "30"]


def run(*arguments):
    return subprocess.run([sys.executable, EXPERIMENT, *arguments, "--programs", PROGRAMS], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, universal_newlines=True, check=False)


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def rotations(vectors):
    """Exp of rotation vectors (n, 3), by Rodrigues: the product under test has only the logarithm."""
    result = []
    for vector in vectors:
        angle = numpy.linalg.norm(vector)
        x, y, z = vector / angle if angle > 0 else vector
        K = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        result.append(numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * K @ K)
    return numpy.array(result)


def quaternions(matrices):
    """x y z w of matrices whose angle is below 180 deg."""
    w = numpy.sqrt(1 + numpy.trace(matrices, axis1=1, axis2=2)) / 2
    v = numpy.stack([matrices[:, 2, 1] - matrices[:, 1, 2], matrices[:, 0, 2] - matrices[:, 2, 0],
                     matrices[:, 1, 0] - matrices[:, 0, 1]], -1) / (4 * w[:, None])
    return numpy.hstack([v, w[:, None]])


class MadeUp:
    """A known motion at 400 Hz, and an estimate ten times a second with known errors in a world of its own."""
    SIGMAS = numpy.array([0.1, 0.2, 0.4, 0.01, 0.03, 0.002, 0.05, 0.1, 0.3])
    TURN, SHIFT = 2.5, numpy.array([10.0, -20.0, 3.0])  # of the world of the estimate: heading [rad], origin [m]

    def __init__(self, seconds, attitude=(0.4, -0.3, 1.0)):
        time = numpy.arange(0, seconds + 2, 0.0025)
        self.truth = nees.Poses(time, self.position(time), quaternions(self.rotation(time, attitude)))
        self.time = numpy.arange(0.7013, seconds, 0.1)
        self.turn = rotations([numpy.array([0, 0, self.TURN])])[0]
        self.R = self.turn @ self.rotation(self.time, attitude)
        self.velocity = numpy.stack([2 * numpy.cos(self.time), -1.5 * numpy.sin(3 * self.time),
                                     0.4 * numpy.cos(2 * self.time)], -1) @ self.turn.T
        self.no_error = numpy.zeros((len(self.time), 9))

    @staticmethod
    def position(t):
        return numpy.stack([2 * numpy.sin(t), 0.5 * numpy.cos(3 * t), 0.2 * numpy.sin(2 * t)], -1)

    @staticmethod
    def rotation(t, attitude):
        return rotations(numpy.outer(1 + 0.3 * numpy.sin(t), attitude))

    def noise(self, seed=0):
        """Errors of the SIGMAS, nil at the first stamp, where the worlds are brought together."""
        errors = numpy.random.default_rng(seed).normal(size=self.no_error.shape) * self.SIGMAS
        errors[0] = 0
        return errors

    def result(self, errors, sigmas=SIGMAS, offsets=((5.0, 0.032, 0.001), )):
        estimate = nees.Poses(self.time, self.position(self.time) @ self.turn.T + self.SHIFT + errors[:, :3],
                              quaternions(rotations(errors[:, 3:6]) @ self.R))
        sigmas = numpy.broadcast_to(sigmas, errors.shape)
        return nees.consistency(estimate, self.velocity + errors[:, 6:], sigmas, numpy.array(offsets), self.truth, 0.03)


class Nees(unittest.TestCase):
    def test_honest_sigmas_give_one(self):
        data = MadeUp(400)
        figures = data.result(data.noise()).nees
        for part in ("position", "z", "velocity", "tilt", "yaw"):
            self.assertAlmostEqual(figures[part], 1.0, delta=0.08, msg=part)

    def test_sigmas_half_of_the_errors_give_four(self):
        data = MadeUp(400)
        figures = data.result(data.noise(1), 0.5 * MadeUp.SIGMAS).nees
        for part in ("position", "z", "velocity", "tilt", "yaw"):
            self.assertAlmostEqual(figures[part], 4.0, delta=0.32, msg=part)

    def test_place_and_heading_of_the_start_are_no_error(self):
        data = MadeUp(20)
        result = data.result(data.no_error)
        # What is left is the interpolation of the truth.
        self.assertLess(numpy.abs(result.ratios * MadeUp.SIGMAS).max(), 3e-5)
        self.assertGreaterEqual(result.time[0], data.time[0] + 1.0)

    def test_roll_and_pitch_of_the_start_stay_errors(self):
        data = MadeUp(20)
        errors = data.no_error.copy()
        errors[:, 3:5] = 0.01, -0.03
        figures = data.result(errors).nees
        self.assertAlmostEqual(figures["tilt"], 1.0, delta=0.01)
        self.assertLess(figures["position"], 1e-3)

    def test_yaw_is_about_the_vertical_of_the_world(self):
        data = MadeUp(20, attitude=(1.5, 0.0, 0.0))  # lies on its side: its z axis is horizontal
        errors = data.no_error.copy()
        errors[1:, 5] = 0.02
        figures = data.result(errors, numpy.full(9, 0.01)).nees
        self.assertAlmostEqual(figures["yaw"], 4.0, delta=0.01)
        self.assertLess(figures["tilt"], 1e-6)

    def test_each_axis_has_its_own_sigma(self):
        data = MadeUp(20)
        for column, part, share in ((0, "position", 3), (2, "z", 1), (3, "tilt", 2), (5, "yaw", 1), (7, "velocity", 3)):
            errors = data.no_error.copy()
            errors[1:, column] = 3 * MadeUp.SIGMAS[column]
            self.assertAlmostEqual(data.result(errors).nees[part], 9 / share, delta=0.01, msg=part)

    def test_offset_counts_where_it_is_estimated(self):
        data = MadeUp(20)
        offsets = [(1.0, 0.5, 0.001), (3.0, 0.03, 0.0), (5.0, 0.032, 0.001), (6.0, 0.026, 0.001)]
        result = data.result(data.no_error, offsets=offsets)
        self.assertAlmostEqual(result.nees["offset"], (2**2 + 4**2) / 2)
        self.assertAlmostEqual(result.offset_quantile(1.0), 4.0)
        nothing = data.result(data.no_error, offsets=[(3.0, 0.03, 0.0)])
        self.assertTrue(numpy.isnan(nothing.nees["offset"]) and numpy.isnan(nothing.offset_quantile(0.95)))

    def test_what_cannot_be_judged_is_told(self):
        data = MadeUp(20)
        for change, expected in ((dict(sigmas=numpy.zeros(9)), "sigma"), (dict(late=True), "does not reach")):
            with self.subTest(expected), numpy.errstate(all="ignore"):
                if change.pop("late", False):
                    data.truth = nees.Poses(data.truth.time[:400], data.truth.position[:400],
                                            data.truth.quaternion[:400])
                with self.assertRaisesRegex(nees.NeesError, expected):
                    data.result(data.no_error, **change)


class Experiment(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def succeed(self, *arguments):
        done = run(*arguments, "--output", str(self.folder))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([p.name for p in self.folder.iterdir() if p.name.startswith(".")], [], "scratch left behind")
        return done

    def test_shifts_of_the_stamps_come_back(self):
        self.succeed("shifts", "--shifts", "0,5", "--time-offset", "0.02", *SHORT)
        steps = {row["model"]: row for row in table(self.folder / "shifts_steps.csv")}
        self.assertEqual(set(steps), MODELS)
        # 0.1 ms for 2.5 ms is what is asked; the same data shifted give nearly the same noise.
        self.assertAlmostEqual(float(steps["imu"]["mean step [ms]"]), 5.0, delta=0.2)
        # The paper's model falls short, but not below half.
        self.assertGreater(float(steps["constant_acceleration"]["mean step [ms]"]), 2.5)
        rows = [row for row in table(self.folder / "shifts.csv") if row["model"] == "imu"]
        self.assertEqual([row["shift [ms]"] for row in rows], ["0", "5"])
        for row in rows:
            truth = 20.0 + float(row["shift [ms]"])
            self.assertAlmostEqual(float(row["error [ms]"]), float(row["estimate [ms]"]) - truth, delta=0.0015)
            self.assertLess(abs(float(row["error [ms]"])), 4 * float(row["sigma [ms]"]))
            self.assertLess(float(row["sigma [ms]"]), 3.0)
            self.assertLess(abs(float(row["batch [ms]"]) - truth), 4 * float(row["batch sigma [ms]"]))
        self.assertAlmostEqual(float(steps["imu"]["mean batch step [ms]"]), 5.0, delta=0.2)
        arrival = {row["model"]: row for row in table(self.folder / "shifts_arrival.csv")}
        # The simulated radar delivers 60 ms after the trigger.
        self.assertAlmostEqual(float(arrival["imu"]["stamps apart [ms]"]), 60.0, delta=2.0)
        self.assertAlmostEqual(float(arrival["imu"]["error [ms]"]), 0.0, delta=0.5)
        page = (self.folder / "shifts.md").read_text()
        for fact in ("seeds 1 to 1", "true offset 20 ms", "experiment.sh shifts --shifts 0,5", "shifts.png"):
            self.assertIn(fact, page)
        self.assertGreater((self.folder / "shifts.png").stat().st_size, 10000)

    def test_passes_come_to_the_delay(self):
        self.succeed("delay", *SHORT)
        rows = {(row["sequence"], row["model"]): row for row in table(self.folder / "delay.csv")}
        passes = [float(rows["difficult", "imu"][f"pass {i} [ms]"]) for i in (1, 2, 3)]
        self.assertLess(abs(passes[2] - 100.0), 2.0)
        # The paper's model needs its passes: the first misses what is asked of the third, each comes nearer.
        paper = [float(rows["difficult", "constant_acceleration"][f"pass {i} [ms]"]) for i in (1, 2, 3)]
        self.assertLess(paper[0], 98.0)
        self.assertLess(paper[0], paper[1])
        self.assertLess(abs(paper[2] - 100.0), abs(paper[0] - 100.0))
        self.assertGreater((self.folder / "delay.png").stat().st_size, 10000)

    def test_monte_carlo_counts_its_runs(self):
        self.succeed("montecarlo", "--motion", "difficult", "--time-offset", "0.03", "--seeds", "2", "--duration", "25")
        rows = {row["method"]: row for row in table(self.folder / "montecarlo.csv")}
        self.assertEqual(set(rows), {"LC-RIO"} | {f"RIO-T {model}" for model in MODELS})
        single = table(self.folder / "montecarlo_runs.csv")
        self.assertEqual(sorted({row["seed"] for row in single}), ["1", "2"])
        imu = [row for row in single if row["method"] == "RIO-T imu"]
        sizes = [abs(float(row["offset error [ms]"])) for row in imu]
        self.assertAlmostEqual(float(rows["RIO-T imu"]["mean size [ms]"]), sum(sizes) / 2, delta=0.0011)
        inside = sum(size <= 1.96 * float(row["sigma [ms]"]) for size, row in zip(sizes, imu))
        self.assertEqual(rows["RIO-T imu"]["covered [%]"], f"{50 * inside}")
        self.assertEqual(rows["RIO-T imu"]["runs"], "2")
        self.assertEqual(rows["LC-RIO"]["covered [%]"], "", "LC-RIO states no offset")

    def test_consistency_means_its_runs(self):
        done = self.succeed("consistency", "--motion", "difficult", "--motion", "drone", "--seeds", "2", "--duration",
                            "30", "--simulate", "--points 30", "--set", "time_offset_model=imu")
        parts = ("position", "z", "velocity", "tilt", "yaw", "offset")
        rows, medians, single = [table(self.folder / f"consistency{name}.csv") for name in ("", "_median", "_runs")]
        self.assertEqual([row["motion"] for row in rows], ["difficult", "drone"])
        outside = 0
        for row, middle in zip(rows, medians):
            self.assertEqual((row["runs"], row["failed"], row["true offset [ms]"]), ("2", "0", "30.00"))
            runs = [run for run in single if run["motion"] == row["motion"]]
            self.assertEqual([run["seed"] for run in runs], ["1", "2"])
            for part in parts:
                figure = float(row[f"{part} NEES"])
                self.assertAlmostEqual(figure, sum(float(run[f"{part} NEES"]) for run in runs) / 2, delta=0.006)
                self.assertEqual(row[f"{part} NEES"], middle[f"{part} NEES"])  # of two runs
                # Wide: it is only asked that nothing is in another frame or unit.
                self.assertTrue(0.003 < figure < 30, (part, figure))
                outside += not 0.5 <= figure <= 2
            self.assertLess(float(row["size [ms]"]), 5.0)
            self.assertGreaterEqual(float(runs[0]["largest"]), float(runs[0]["offset error/sigma, 95 % of time"]))
        page = (self.folder / "consistency.md").read_text()
        first = page[page.index("## Mean"):page.index("## Median")]
        self.assertEqual(first.count(" !"), outside)
        last = f"{outside} of 12 means and {outside} of 12 medians of NEES are outside 0.5 to 2"
        self.assertEqual(done.stdout.splitlines()[-1], last)
        for fact in (last, "simulated with --points 30", "consistency.png"):
            self.assertIn(fact, page)

    def test_options_reach_the_simulator(self):
        offsets = {}
        for points in ("20", "60"):
            self.succeed("consistency", "--motion", "easy", "--seeds", "1", "--duration", "25",
                         f"--simulate=--points {points}")
            offsets[points] = float(table(self.folder / "consistency_runs.csv")[0]["sigma at end [ms]"])
        self.assertGreater(offsets["20"], offsets["60"])

    def test_a_run_without_result_is_counted(self):
        import experiment
        data = MadeUp(20)
        good = (experiment.Run(31.0, 0.5, {"ate_m": 0.1, "health_at_end": "diverged"}, [], []), data.result(data.noise()))
        lab = unittest.mock.Mock(map=lambda work: [good, "it broke", good])
        page = experiment.consistency(lab, [experiment.Source("easy", seed, "easy", 30.0) for seed in (1, 2, 3)], None)
        self.assertEqual(page.tables[0].rows[0][:4], ["easy", "30.00", 2, 1])
        self.assertEqual([row[-1] for row in page.tables[2].rows],
                         ["health at the end: diverged", "it broke", "health at the end: diverged"])
        self.assertEqual({len(row) for row in page.tables[2].rows}, {len(page.tables[2].columns)})

    def test_small_errors_are_numbers_to_yaml(self):
        offsets = self.folder / "time_offset.csv"
        offsets.write_text("stamp,offset_s,sigma_s\n1.0,0.00001,0.001\n2.0,0.00001,0.001\n")
        command = [f"{PROGRAMS}/evaluate", "--yaml", "--time-offset", str(offsets), "--true-offset", "-2e-5"]
        done = subprocess.run(command, stdout=subprocess.PIPE, universal_newlines=True, check=True)
        result = yaml.safe_load(done.stdout)["time_offset"]
        self.assertEqual(result["true_s"], -2e-5)
        self.assertAlmostEqual(result["final_error_s"], 3e-5, delta=1e-12)

    def test_faults_are_one_line(self):
        for arguments, expected in (
                (["shifts", "--bag", "absent.bag"], "absent.bag: no such file"),
                (["shifts", "--set", "time_offset_model=imu"], "sets time_offset_model itself"),
                (["shifts", "--shifts", "5,5"], "--shifts"),
                (["montecarlo", "--seeds", "0"], "--seeds"),
                (["consistency", "--bag", EXPERIMENT], "consistency draws its bags itself"),
                (["consistency", "--set", "mode=batch"], "sets mode itself"),
                (["shifts", "--bag", EXPERIMENT, "--simulate", "--noise-free"], "--simulate: for simulated bags only"),
                (["shifts", "--simulate", "--seed 3"], "sets --seed itself"),
                (["shifts", "--simulate", "--points '3"], "no closing quotation"),
                (["consistency", "--motion", "easy", "--simulate", "--pionts 3"], "--pionts"),
                (["consistency", "--motion", "easy", "--seeds", "1", "--set", "wimdow=1"], "wimdow"),
                # It ends less than 1 s after its start.
                (["consistency", "--motion", "easy", "--seeds", "1", "--duration", "5.5", "--simulate",
                  "--static-start 0 --static-end 0"], "no pose later than 1 s"),
                (["dance"], "dance"),
                (["table1", "--seeds", "1", "--motion", "dance"], "'dance' is not known"),
                (["table1", *SHORT, "--motion", "easy", "--set", "wimdow=1"], "wimdow")):
            with self.subTest(arguments):
                done = run(*arguments, "--output", str(self.folder))
                self.assertEqual(done.returncode, 1)
                self.assertIn(expected, done.stderr)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertEqual(done.stdout, "")


class JUnit(unittest.TextTestResult):
    """Keeps what the count of all tests reads."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.cases = {}

    @staticmethod
    def name(test):
        return tuple(test.id().split(".")[-2:])

    def stopTest(self, test):
        self.cases.setdefault(self.name(test), None)
        super().stopTest(test)

    def note(self, test, error):
        self.cases[self.name(test)] = "".join(traceback.format_exception(*error))

    def addFailure(self, test, err):
        self.note(test, err)
        super().addFailure(test, err)

    def addError(self, test, err):
        self.note(test, err)
        super().addError(test, err)

    def addSubTest(self, test, subtest, err):
        if err is not None:
            self.note(test, err)
        super().addSubTest(test, subtest, err)

    def write(self, path):
        cases = [f"<testcase classname=\"{group}\" name={xml.sax.saxutils.quoteattr(name)}>" +
                 (f"<failure>{xml.sax.saxutils.escape(why)}</failure>" if why else "") + "</testcase>"
                 for (group, name), why in self.cases.items()]
        failures = sum(why is not None for why in self.cases.values())
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"<testsuite name=\"experiment_test\" tests=\"{len(cases)}\" failures=\"{failures}\" "
                        f"errors=\"0\">{''.join(cases)}</testsuite>\n")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__.strip())
    RESULTS, EXPERIMENT, PROGRAMS = sys.argv[1:]
    sys.path.insert(0, str(pathlib.Path(EXPERIMENT).parent))
    import nees
    loader = unittest.defaultTestLoader
    suite = unittest.TestSuite(loader.loadTestsFromTestCase(case) for case in (Nees, Experiment))
    outcome = unittest.TextTestRunner(resultclass=JUnit).run(suite)
    outcome.write(pathlib.Path(RESULTS))
    sys.exit(not outcome.wasSuccessful())
