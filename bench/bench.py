#!/usr/bin/env python3
"""What it costs to play a bag: called by scripts/bench.sh, which builds first."""
import argparse
import hashlib
import json
import os
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "src"))
from rio_t.errors import RioTError  # noqa: E402
from rio_t.programs import usage_of  # noqa: E402


def fail(text):
    sys.exit("bench.py: " + text)


def play(programs, bag, config, assignments, folder):
    """One run of the product: CPU seconds, memory and speed, from the process itself and from its summary."""
    words = [os.path.join(programs, "rio_t_bag"), "--bag", bag, "--config", config, "--output-dir", folder]
    for assignment in assignments:
        words += ["--set", assignment]
    try:
        usage = usage_of(*words)
    except RioTError as error:
        fail(" ".join(words) + f"\n{error}")
    summary = {}
    with open(os.path.join(folder, "summary.yaml")) as lines:
        for line in lines:
            key, _, value = line.partition(":")
            if value.strip() and not line.startswith(" "):
                summary[key] = value.strip()
    cpu = usage.ru_utime + usage.ru_stime
    seconds = float(summary["estimation_seconds"])
    data = float(summary["realtime_factor"]) * seconds
    # With several radars each key ends with "_" and the name of one.
    offsets = {key: float(value) for key, value in summary.items()
               if key == "final_offset_s" or key.startswith("final_offset_s_")}
    return {"data_seconds": data, "cpu_seconds": cpu, "user_seconds": usage.ru_utime, "system_seconds": usage.ru_stime,
            "realtime_factor_cpu": data / cpu, "estimation_seconds": seconds, "realtime_factor": data / seconds,
            "peak_memory_mb": usage.ru_maxrss / 1024.0, "final_offsets": offsets,
            "ate_m": float(summary["ate_m"]) if "ate_m" in summary else None}


def stages(programs, bag, config, assignments, folder):
    words = [os.path.join(programs, "bag_benchmark"), bag, config, folder, *assignments]
    outcome = subprocess.run(words, capture_output=True, text=True, check=False)
    if outcome.returncode != 0:
        fail(outcome.stderr.strip())
    return json.loads(outcome.stdout)


def middle(runs):
    """The run with the median of the CPU seconds, and the spread of all."""
    ordered = sorted(runs, key=lambda run: run["cpu_seconds"])
    result = dict(ordered[len(ordered) // 2])
    result["runs"] = len(runs)
    result["cpu_seconds_of_runs"] = [run["cpu_seconds"] for run in runs]
    return result


def programs_of(other, repository):
    """Folder of the programs of a build folder, or of a revision, which is built where it is not yet."""
    for folder in (other, os.path.join(other, "devel/lib/rio_t")):
        if os.path.isfile(os.path.join(folder, "rio_t_bag")):
            return os.path.abspath(folder)
    revision = subprocess.run(["git", "-C", repository, "rev-parse", "--verify", "--quiet", other + "^{commit}"],
                              capture_output=True, text=True, check=False).stdout.strip()
    if not revision:
        fail(f"--compare {other}: neither a build folder with devel/lib/rio_t/rio_t_bag nor a revision of git")
    cache = os.path.join(os.environ.get("XDG_CACHE_HOME", os.path.expanduser("~/.cache")), "rio_t_bench")
    name = hashlib.sha256(os.path.realpath(repository).encode()).hexdigest()[:8] + "-" + revision[:12]
    source = os.path.join(cache, name)
    programs = os.path.join(source, "build/devel/lib/rio_t")
    if os.path.isfile(os.path.join(programs, "rio_t_bag")):
        return programs
    print(f"Building {other} ({revision[:12]}) in {source} ...", file=sys.stderr)
    os.makedirs(source, exist_ok=True)
    archive = subprocess.Popen(["git", "-C", repository, "archive", revision], stdout=subprocess.PIPE)
    subprocess.run(["tar", "-x", "-C", source], stdin=archive.stdout, check=True)
    if archive.wait() != 0:
        fail(f"git archive {revision} failed")
    environment = {key: value for key, value in os.environ.items() if key != "RIO_T_BUILD_DIR"}
    built = subprocess.run([os.path.join(source, "scripts/build.sh")], env=environment, text=True,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
    if built.returncode != 0:
        fail("\n".join(built.stdout.splitlines()[-30:]) + f"\n{other} does not build, see above")
    return programs


def show(result):
    run, detail = result["product"], result["instrumented"]
    cpu = run["cpu_seconds_of_runs"]
    print(f"{result['bag']} ({result['config']}): {run['data_seconds']:.1f} s of data, {detail['scans']} scans, "
          f"{detail['imu_samples']} IMU samples")
    print(f"  CPU             {run['cpu_seconds']:.3f} s ({run['user_seconds']:.3f} user, {run['system_seconds']:.3f} system; "
          f"median of {run['runs']} runs, {min(cpu):.3f} to {max(cpu):.3f})")
    print(f"  times real time {run['realtime_factor_cpu']:.0f} by CPU of the whole process, "
          f"{run['realtime_factor']:.0f} by the clock while estimating")
    print(f"  peak memory     {run['peak_memory_mb']:.1f} MB")
    allocations = detail["allocations_per_scan"]
    print(f"  allocations     {allocations['estimator']:.0f} a scan in the estimator, "
          f"{allocations['whole_program']:.0f} in the whole program")
    solve = detail["solve_ms"]
    print(f"  window solve    {solve['p50']:.3f} ms median, {solve['p99']:.3f} ms 99 %, {solve['max']:.3f} ms worst, "
          f"of {solve['count']}, CPU time")
    total = detail["estimation_seconds"]
    print(f"  stages          (instrumented run, {total:.3f} s)    ms      %   us a call  allocations a call")
    for name, cost in sorted(detail["stages"].items(), key=lambda item: -item[1]["seconds"]):
        calls = cost["calls"]
        each = f"{1e6 * cost['seconds'] / calls:10.1f}  {cost['allocations'] / calls:10.1f}" if calls else ""
        print(f"    {name:40s} {1e3 * cost['seconds']:9.1f}  {100.0 * cost['seconds'] / total:5.1f}  {each}")


def show_ratios(ours, theirs, other):
    print(f"  before/after    against {other}, runs alternating; above 1: this one is better")
    rows = (("CPU seconds", "cpu_seconds"), ("estimation seconds", "estimation_seconds"), ("peak memory", "peak_memory_mb"))
    ratios = {}
    for name, key in rows:
        pairs = [b[key] / a[key] for a, b in zip(ours, theirs)]
        ratios[key] = {"median": statistics.median(pairs), "min": min(pairs), "max": max(pairs)}
        before, after = (statistics.median(run[key] for run in runs) for runs in (theirs, ours))
        print(f"    {name:20s} {before:9.3f} -> {after:9.3f}   ratio {ratios[key]['median']:.2f} "
              f"({min(pairs):.2f} to {max(pairs):.2f})")
    a, b = ours[0], theirs[0]
    for key in sorted(a["final_offsets"].keys() & b["final_offsets"].keys()):
        name = "final offset" + key[len("final_offset_s"):].replace("_", " ", 1)
        print(f"    {name:20s} {1e3 * b['final_offsets'][key]:9.3f} -> {1e3 * a['final_offsets'][key]:9.3f} ms")
    if a["ate_m"] is not None and b["ate_m"] is not None:
        print(f"    {'ATE':20s} {b['ate_m']:9.4f} -> {a['ate_m']:9.4f} m   ({100.0 * (a['ate_m'] / b['ate_m'] - 1.0):+.2f} %)")
    return ratios


def main():
    parser = argparse.ArgumentParser(prog="bench.sh", description="what it costs to play a bag")
    parser.add_argument("bag")
    parser.add_argument("config", help="irs, ti_mmwave or a YAML file")
    parser.add_argument("--runs", type=int, default=7, help="of the product, the median counts [7]")
    parser.add_argument("--json", metavar="FILE", help="write the results there")
    parser.add_argument("--compare", metavar="OTHER", help="a build folder or a revision of git")
    parser.add_argument("--set", action="append", default=[], metavar="key=value", help="a parameter; may be repeated")
    parser.add_argument("--programs", required=True, help=argparse.SUPPRESS)
    parser.add_argument("--repository", required=True, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.runs < 1:
        fail("--runs: expected at least 1")
    other = programs_of(arguments.compare, arguments.repository) if arguments.compare else None

    case = (arguments.bag, arguments.config, arguments.set)
    with tempfile.TemporaryDirectory(prefix="rio_t_bench_") as folder:
        play(arguments.programs, *case, folder)  # not counted: the bag comes into the page cache
        ours, theirs = [], []
        for _ in range(arguments.runs):
            ours.append(play(arguments.programs, *case, folder))
            if other:
                theirs.append(play(other, *case, folder))
        detail = stages(arguments.programs, *case, folder)
    result = {"bag": arguments.bag, "config": arguments.config, "set": arguments.set,
              "product": middle(ours), "instrumented": detail}
    show(result)
    if other:
        result["compare"] = {"other": arguments.compare, "product": middle(theirs),
                             "ratios": show_ratios(ours, theirs, arguments.compare)}
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(result, file, indent=2)
            file.write("\n")


if __name__ == "__main__":
    main()
