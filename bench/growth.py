#!/usr/bin/env python3
"""How the cost of a scan grows: with the window, the points, the IMU's rate and the length of the bag.
Called by scripts/bench.sh growth, which builds first. On simulated bags of its own."""
import argparse
import json
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "src"))
from rio_t.errors import RioTError  # noqa: E402
from rio_t.programs import output_of  # noqa: E402

RUNS = 5  # of each case; for each stage the fastest counts, the others were disturbed
COLUMNS = (("reading, output", ("reading and the rest", "output", "pipeline")), ("decode", ("decode",)),
           ("ego-velocity", ("ego-velocity",)), ("factors", ("prediction", "factors")),
           ("solve", ("solve", "covariance")), ("marginalise", ("marginalise",)),
           ("navigation", ("navigation: anchor", "navigation: step")))


class Bench:
    def __init__(self, programs, folder):
        self.programs, self.folder = programs, folder

    def program(self, name):
        return os.path.join(self.programs, name)

    def bag(self, *options):
        """A simulated bag with these options of `simulate`; made once."""
        path = os.path.join(self.folder, "_".join(options).replace("-", "") + ".bag")
        if not os.path.exists(path):
            output_of(self.program("simulate"), "--motion", "difficult", "--seed", "5", "--time-offset", "0.02", "--out",
                      path, *options)
        return path

    def bag_of_points(self, points):
        """A simulated minute with so many points in every scan."""
        return self.bag("--duration", "60", "--points", str(points), "--points-max", str(points), "--points-sigma", "0")

    def cost(self, bag, *assignments):
        """Microseconds a scan, by stage and in sum; the window solve's quantiles."""
        words = (self.program("bag_benchmark"), bag, "irs", os.path.join(self.folder, "out"), *assignments)
        results = [json.loads(output_of(*words)) for _ in range(RUNS)]
        scans = results[0]["scans"]
        cost = {name: min(1e6 * sum(result["stages"][each]["seconds"] for each in of) / scans for result in results)
                for name, of in COLUMNS}
        cost["sum"] = sum(cost.values())
        cost["realtime_factor"] = 1e6 * results[0]["data_seconds"] / (cost["sum"] * scans)
        cost["solve_p99_ms"] = min(result["solve_ms"]["p99"] for result in results)
        return cost


def main():
    parser = argparse.ArgumentParser(prog="bench.sh growth")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--programs", required=True, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rio_t_growth_") as folder:
        bench = Bench(arguments.programs, folder)
        minute = ("--duration", "60")
        tables = (
            ("window [s]", [(w, bench.bag(*minute), (f"window={w}",)) for w in (0.5, 1.0, 2.0, 3.0, 5.0)]),
            ("points a scan", [(n, bench.bag_of_points(n), ()) for n in (20, 45, 100, 200, 500, 1000, 2000)]),
            ("IMU rate [Hz]", [(hz, bench.bag(*minute, "--imu-rate", str(hz)), ()) for hz in (100, 200, 409, 1000)]),
            ("bag length [s]", [(s, bench.bag("--duration", str(s)), ()) for s in (60, 120, 240, 480)]),
        )
        results = {}
        for title, cases in tables:
            names = [name for name, _ in COLUMNS]
            print(f"\n{title:16s}" + "".join(f"{name:>16s}" for name in names)
                  + "   us a scan   x real time   solve 99 % [ms]", flush=True)
            results[title] = []
            for value, bag, assignments in cases:
                cost = bench.cost(bag, *assignments)
                results[title].append({"value": value, **cost})
                print(f"{value:<16g}" + "".join(f"{cost[name]:16.1f}" for name in names)
                      + f"{cost['sum']:12.1f}{cost['realtime_factor']:14.0f}{cost['solve_p99_ms']:18.3f}", flush=True)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(results, file, indent=2)
            file.write("\n")


if __name__ == "__main__":
    try:
        main()
    except RioTError as error:
        sys.exit(f"growth.py: {error}")
