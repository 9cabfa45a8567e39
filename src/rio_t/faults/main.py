"""The program: scripts/faults.py."""
import argparse
import concurrent.futures
import dataclasses
import os
import pathlib
import shutil
import sys
import tempfile
import time

from . import __doc__ as description
from ..errors import RioTError

# Everything else is imported once the arguments are known to be good.


def say(text):
    print(text, flush=True)


def print_result(case, bag, must, happened, wrong):
    say(f"{case:24}  {bag:10}  {'FAIL' if wrong else 'pass'}  {happened}".rstrip())
    if wrong:
        say(" " * 42 + "must: " + must)
        say(" " * 42 + "but: " + "; ".join(wrong))


def write_table(path, rows):
    lines = ["| case | bag | what must happen | what happened | |", "| --- | --- | --- | --- | --- |"]
    for *cells, wrong in rows:
        cells.append("**FAIL**: " + "; ".join(wrong) if wrong else "pass")
        lines.append("| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |")
    path.write_text("\n".join(lines) + "\n")


def parse(words):
    parser = argparse.ArgumentParser(prog="faults.sh", description=description,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="list the cases and what must happen in each")
    parser.add_argument("--only", action="append", default=[], metavar="NAME", help="run only this case; may be repeated")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="cases at a time [%(default)s]")
    parser.add_argument("--bag", help="put the faults into this bag instead")
    parser.add_argument("--config", default="irs", help="configuration of that bag [%(default)s]")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
                        help="a parameter of every run on a bag, e.g. solver=ceres; may be repeated")
    parser.add_argument("--no-live", action="store_true", help="leave out the cases of the live node")
    parser.add_argument("--output-dir", metavar="DIR", help="keep bags, runs and table.md here")
    parser.add_argument("--programs", type=pathlib.Path, help=argparse.SUPPRESS)  # set by faults.sh
    parser.add_argument("--check", action="store_true", help=argparse.SUPPRESS)   # arguments only
    arguments = parser.parse_args(words)
    if arguments.jobs < 1:
        parser.error("--jobs: expected at least 1")
    if arguments.bag and not os.path.isfile(arguments.bag):
        parser.error(f"--bag: no such file: {arguments.bag}")
    return parser, arguments


def use_for_temporary_files(folder):
    tempfile.tempdir = folder


def run(arguments, bag_cases, live_cases, scratch):
    """Rows of the table: case, bag, what must happen, what happened, [what is wrong]."""
    from .. import programs
    from . import campaign, live
    folder = programs.find(("rio_t_bag", "simulate"), "--programs DIR", arguments.programs)
    bags, rows = campaign.bags_for(folder, scratch, arguments.bag, arguments.config), []
    bags = [dataclasses.replace(bag, settings=tuple(arguments.settings)) for bag in bags]

    def add(*row):
        rows.append(row)
        print_result(*row)

    # The processes of a pool end without what genpy has for the end: its folders would stay.
    with tempfile.TemporaryDirectory(dir=scratch) as temporary, concurrent.futures.ProcessPoolExecutor(
            arguments.jobs, initializer=use_for_temporary_files, initargs=(temporary,)) as pool:
        tasks = [(case, bag, pool.submit(campaign.run_case, folder, bag, case.name, scratch / bag.name / case.name,
                                         bool(arguments.output_dir)))
                 for bag in bags for case in bag_cases if bag.name == "given" or bag.name in case.bags]
        try:
            for case, bag, task in tasks:
                add(case.name, bag.name, case.must, *task.result())
        except BaseException:
            for _, _, task in tasks:
                task.cancel()
            raise
    # One after the other: each has a roscore and real time to itself.
    if live_cases:
        with live.session() as tester:
            for case in live_cases:
                add(case.name, "live", case.must, *live.run(case, tester, bags[0], scratch / "live"))
    return rows


def run_campaign(arguments, bag_cases, live_cases):
    started = time.monotonic()
    scratch = pathlib.Path(arguments.output_dir or tempfile.mkdtemp(prefix="rio_t_faults_")).resolve()
    scratch.mkdir(parents=True, exist_ok=True)
    for old in scratch.glob("*/usual_*"):  # of other settings, another bag or another build
        shutil.rmtree(old)
    try:
        rows = run(arguments, bag_cases, live_cases, scratch)
        write_table(scratch / "table.md", rows)
    finally:
        if not arguments.output_dir:
            shutil.rmtree(scratch, ignore_errors=True)
    failed = sum(1 for row in rows if row[-1])
    say(f"{len(rows) - failed} of {len(rows)} cases pass, {time.monotonic() - started:.0f} s"
        + (f"; table in {scratch / 'table.md'}" if arguments.output_dir else ""))
    return 1 if failed or not rows else 0


def main(words):
    parser, arguments = parse(words)
    if arguments.check and not (arguments.list or arguments.only):
        return 0
    from . import cases, live
    known = [case.name for case in cases.CASES + live.CASES]
    for name in arguments.only:
        if name not in known:
            parser.error(f"--only: no case {name}; --list names them")
    if arguments.list:
        for case in cases.CASES + live.CASES:
            say(f"{case.name:26}{case.must}")
        return 0
    bag_cases, live_cases = ([case for case in of if not arguments.only or case.name in arguments.only]
                             for of in (cases.CASES, [] if arguments.no_live or arguments.bag else live.CASES))
    if not bag_cases and not live_cases:
        parser.error(f"no case is left: {' and '.join(arguments.only)} run live, and "
                     f"{'--no-live' if arguments.no_live else '--bag'} leaves out the cases of the live node")
    if arguments.check:
        return 0
    try:
        return run_campaign(arguments, bag_cases, live_cases)
    except (RioTError, OSError) as fault:
        sys.exit(f"faults.sh: {fault}")
    except KeyboardInterrupt:
        sys.exit("faults.sh: interrupted")
