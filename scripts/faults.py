#!/usr/bin/env python3
"""The fault campaign: each case puts a fault into a bag (or does something to the live node), runs the real pipeline on
it, and checks what must happen. Prints a table; exit status 1 if a case fails.

The bags: a simulated walk of a minute, and the real bag, where $RIO_T_DATA_DIR (default ../shared/data) has it. With
--bag and --config the same faults go into a bag of yours instead; without ground truth the run on the bag as it is
stands for the truth. scripts/fault_campaign holds the faults (injection.py), the cases with what must happen (cases.py)
and the judges.
"""
import argparse
import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

# Everything else is imported once the arguments are known to be good.

SIMULATION = ["--motion", "medium", "--seed", "11", "--time-offset", "0.03", "--duration", "60", "--static-start", "5",
              "--static-end", "3", "--imu-rate", "200"]
REAL_BAG = "real/ti_mmwave_rospkg_demo.bag"
TIMEOUT = 300.0  # [s] for one run of the pipeline: longer, it hangs

_worker = {}  # of each process: bags that it has read


def say(text, **options):
    print(text, flush=True, **options)


class Bag:
    """A bag without fault, and what the pipeline makes of it."""

    def __init__(self, name, path, config, topics, truth):
        self.name, self.path, self.config, self.topics, self.truth = name, path, config, topics, truth


def topics_of(programs, config):
    """Kinds by topic, as the configuration names them."""
    import yaml
    done = subprocess.run([str(programs / "rio_t_bag"), "--print-config", "--config", config], stdout=subprocess.PIPE,
                          stderr=subprocess.PIPE, universal_newlines=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    values = yaml.safe_load(done.stdout)
    return {values["imu_topic"]: "imu", values["radar_topic"]: "radar", values["trigger_topic"]: "trigger"}


def run_pipeline(programs, bag, config, settings, folder):
    """(exit status, stderr); a run that hangs has the status None."""
    command = [str(programs / "rio_t_bag"), "--bag", str(bag), "--config", config, "--output-dir", str(folder)]
    for setting in settings:
        command += ["--set", setting]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True,
                              check=False, timeout=TIMEOUT)
    except subprocess.TimeoutExpired:
        return None, f"hangs: no end after {TIMEOUT:.0f} s"
    return done.returncode, done.stderr


def messages_of(bag):
    from fault_campaign import stream
    if bag.name not in _worker:
        _worker[bag.name] = stream.read(bag.path, bag.topics)
    return _worker[bag.name]


def run_case(programs, bag, name, folder, keep):
    """(what happened, [what is wrong]) of one case on one bag."""
    import numpy
    from fault_campaign import cases, injection, judge, stream
    case = next(c for c in cases.CASES if c.name == name)
    messages = messages_of(bag)
    folder.mkdir(parents=True, exist_ok=True)
    site = injection.Site(messages[0].record, case.when[0], case.when[1], numpy.random.RandomState(1))
    faulty = case.fault(messages, site)
    faulty_bag = folder / "faulty.bag"
    stream.write(faulty_bag, faulty)
    settings = bag_settings(bag, case)
    status, errors = run_pipeline(programs, faulty_bag, bag.config, settings, folder / "run")
    (folder / "stderr.txt").write_text(errors)
    if not keep:
        faulty_bag.unlink()

    usual_folder = folder.parent / ("usual_" + "_".join(s.replace("/", "") for s in settings))
    ensure_usual(programs, bag, settings, usual_folder)
    origin = 1e-9 * next(m for m in messages if m.kind == "imu").stamp
    truth = judge.read_truth(bag.truth) if bag.truth else judge.read_run(usual_folder)
    outcome = judge.read_outcome(folder / "run", status, errors, truth, origin, case.shift)
    outcome.reference = judge.errors_against(truth, judge.read_run(usual_folder), origin)
    outcome.last_imu = 1e-9 * [m for m in faulty if m.kind == "imu"][-1].stamp - case.shift
    outcome.has_truth = bag.truth is not None
    outcome.length = 1e-9 * (messages[-1].record - messages[0].record)
    begin, end = case.when
    return case.expect.judge(outcome, begin, min(end, 1e6))


def bag_settings(bag, case):
    return tuple(case.settings)


def ensure_usual(programs, bag, settings, folder):
    """The run without the fault, once for all cases with these settings."""
    if (folder / "summary.yaml").exists():
        return
    own = pathlib.Path(tempfile.mkdtemp(prefix="usual_", dir=folder.parent))
    status, errors = run_pipeline(programs, bag.path, bag.config, settings, own)
    if status != 0:
        raise RuntimeError(f"{bag.path} without a fault: {errors.strip()}")
    try:
        own.rename(folder)
    except OSError:  # another case was faster
        shutil.rmtree(own)


def guarded(programs, bag, name, folder, keep):
    started = time.monotonic()
    try:
        happened, wrong = run_case(programs, bag, name, folder, keep)
    except Exception as error:  # a case that cannot be judged has failed; the others go on
        happened, wrong = f"{type(error).__name__}: {error}", ["the case itself failed"]
    return happened, wrong, time.monotonic() - started


def simulated_bag(programs, folder):
    path, truth = folder / "simulated.bag", folder / "simulated.truth.txt"
    done = subprocess.run([str(programs / "simulate"), *SIMULATION, "--out", str(path), "--ground-truth", str(truth)],
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, universal_newlines=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stdout.strip())
    return Bag("simulated", path, "irs", topics_of(programs, "irs"), truth)


def bags_for(arguments, folder):
    if arguments.bag:
        return [Bag("given", pathlib.Path(arguments.bag).resolve(), arguments.config,
                    topics_of(arguments.programs, arguments.config), None)]
    bags = [simulated_bag(arguments.programs, folder)]
    real = pathlib.Path(os.environ.get("RIO_T_DATA_DIR", "../shared/data")) / REAL_BAG
    if real.exists():
        bags.append(Bag("real", real.resolve(), "ti_mmwave", topics_of(arguments.programs, "ti_mmwave"), None))
    else:
        say(f"No real bag at {real}: simulated data only (RIO_T_DATA_DIR names the folder).")
    return bags


def columns_of(row, widths):
    return "  ".join(text.ljust(width) for text, width in zip(row, widths)).rstrip()


def print_result(case, bag, must, happened, wrong):
    say(columns_of((case, bag, "FAIL" if wrong else "pass", happened), (24, 10, 4, 0)))
    if wrong:
        say(" " * 42 + "must: " + must)
        say(" " * 42 + "but: " + "; ".join(wrong))


def write_table(path, rows):
    cell = lambda text: text.replace("|", "\\|").replace("\n", " ")
    lines = ["| case | bag | what must happen | what happened | |", "| --- | --- | --- | --- | --- |"]
    for case, bag, must, happened, wrong in rows:
        result = "**FAIL**: " + "; ".join(wrong) if wrong else "pass"
        lines.append("| " + " | ".join(cell(c) for c in (case, bag, must, happened, result)) + " |")
    path.write_text("\n".join(lines) + "\n")


def parse():
    parser = argparse.ArgumentParser(prog="faults.sh", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="the cases and what must happen in each")
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="this case; may be repeated")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="cases at a time [%(default)s]")
    parser.add_argument("--bag", help="put the faults into this bag instead")
    parser.add_argument("--config", default="irs", help="its configuration [%(default)s]")
    parser.add_argument("--no-live", action="store_true", help="leave out the cases of the live node")
    parser.add_argument("--output", metavar="DIR", help="keep bags, runs and table.md here")
    parser.add_argument("--programs", type=pathlib.Path, help=argparse.SUPPRESS)  # set by faults.sh
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)   # arguments only
    arguments = parser.parse_args()
    if arguments.jobs < 1:
        parser.error("--jobs: expected at least 1")
    if arguments.bag and not os.path.isfile(arguments.bag):
        parser.error(f"--bag: no such file: {arguments.bag}")
    return parser, arguments


def main():
    parser, arguments = parse()
    if arguments.check and not (arguments.list or arguments.only):
        return 0
    from fault_campaign import cases, live
    known = [c.name for c in cases.CASES] + [c.name for c in live.CASES]
    for name in arguments.only:
        if name not in known:
            parser.error(f"--only: no case {name}; --list names them")
    if arguments.list:
        for case in cases.CASES + live.CASES:
            say(f"{case.name:26}{case.expect.words() if hasattr(case, 'expect') else case.must}")
        return 0
    if arguments.check:
        return 0

    started = time.monotonic()
    scratch = pathlib.Path(arguments.output).resolve() if arguments.output else pathlib.Path(
        tempfile.mkdtemp(prefix="rio_t_faults_"))
    scratch.mkdir(parents=True, exist_ok=True)
    wanted = lambda case: not arguments.only or case.name in arguments.only
    rows = []
    try:
        bags = bags_for(arguments, scratch)
        with concurrent.futures.ProcessPoolExecutor(arguments.jobs) as pool:
            tasks = []
            for bag in bags:
                for case in filter(wanted, cases.CASES):
                    if bag.name != "given" and bag.name not in case.bags:
                        continue
                    tasks.append((case, bag, pool.submit(guarded, arguments.programs, bag, case.name,
                                                         scratch / bag.name / case.name, bool(arguments.output))))
            for case, bag, task in tasks:
                happened, wrong, _ = task.result()
                rows.append((case.name, bag.name, case.expect.words(), happened, wrong))
                print_result(*rows[-1])
        # One after the other: each has a roscore and real time to itself.
        if not arguments.no_live and not arguments.bag:
            for case in filter(wanted, live.CASES):
                happened, wrong = live.run(case, bags[0], scratch / "live")
                rows.append((case.name, "live", case.must, happened, wrong))
                print_result(*rows[-1])
        write_table(scratch / "table.md", rows)
    finally:
        live.stop_ros()
        if not arguments.output:
            shutil.rmtree(scratch, ignore_errors=True)
    failed = sum(1 for row in rows if row[4])
    say(f"{len(rows) - failed} of {len(rows)} cases pass, {time.monotonic() - started:.0f} s"
        + (f"; table in {scratch / 'table.md'}" if arguments.output else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (RuntimeError, OSError) as fault:
        sys.exit(f"faults.sh: {fault}")
    except KeyboardInterrupt:
        sys.exit("faults.sh: interrupted")
