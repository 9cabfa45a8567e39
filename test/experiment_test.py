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
import xml.sax.saxutils

import yaml

MODELS = {"imu", "constant_acceleration"}
SHORT = ["--seeds", "1", "--duration", "30"]


def run(*arguments):
    return subprocess.run([sys.executable, EXPERIMENT, *arguments, "--programs", PROGRAMS], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, universal_newlines=True, check=False)


def table(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


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

    def stopTest(self, test):
        self.cases.setdefault(test.id().split(".")[-1], None)
        super().stopTest(test)

    def note(self, test, error):
        self.cases[test.id().split(".")[-1]] = "".join(traceback.format_exception(*error))

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
        cases = [f"<testcase classname=\"Experiment\" name={xml.sax.saxutils.quoteattr(name)}>" +
                 (f"<failure>{xml.sax.saxutils.escape(why)}</failure>" if why else "") + "</testcase>"
                 for name, why in self.cases.items()]
        failures = sum(why is not None for why in self.cases.values())
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"<testsuite name=\"experiment_test\" tests=\"{len(cases)}\" failures=\"{failures}\" "
                        f"errors=\"0\">{''.join(cases)}</testsuite>\n")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__.strip())
    RESULTS, EXPERIMENT, PROGRAMS = sys.argv[1:]
    suite = unittest.defaultTestLoader.loadTestsFromTestCase(Experiment)
    outcome = unittest.TextTestRunner(resultclass=JUnit).run(suite)
    outcome.write(pathlib.Path(RESULTS))
    sys.exit(not outcome.wasSuccessful())
