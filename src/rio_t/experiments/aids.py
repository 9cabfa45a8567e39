"""What the platform cannot do and how high it is: each aid alone and together, over motions and seeds, with cost."""
import numpy

from .. import tum
from .laboratory import grouped, one_run_or_fault, truth_of
from .page import Page, Table, fixed, mean

GROUND, PRESSURE = {"platform": "ground_vehicle"}, {"barometer_topic": "/sensor_platform/baro"}
LANDMARKS = {"landmarks": "true"}
# Name, parameters. A new aid is one more line, and one for it together with the others.
AIDS = {
    "none": {},
    "ground vehicle": GROUND,
    "barometer": PRESSURE,
    "landmarks": LANDMARKS,
    "all": {**GROUND, **PRESSURE, **LANDMARKS}}
ON_WHEELS = ("ground_vehicle", "kart")


def height_errors(folder, bag):
    """Of the causal trajectory against the truth, both from their starts [m]."""
    estimate, truth = tum.read(folder / "trajectory.txt"), tum.read(truth_of(bag))
    at = estimate.seconds(truth.stamp[0])
    true = numpy.interp(at, truth.seconds(truth.stamp[0]), truth.position[:, 2])
    height = estimate.position[:, 2]
    return (height - height[0]) - (true - true[0])


def rms(values):
    return float(numpy.sqrt(numpy.mean(numpy.square(values))))


def is_contradicted(run):
    return run.summary.get("ground_vehicle", {}).get("contradicted", False)


def row_of_run(source, aid, result):
    key = [source.name, source.seed, aid]
    if isinstance(result, str):
        return key + [""] * 5 + [result]
    run, errors = result
    return key + [fixed(run.figure("ate_m"), 4), fixed(rms(errors), 4), fixed(abs(errors[-1]), 4),
                  fixed(run.cpu, 2), "contradicted" if is_contradicted(run) else "", ""]


def cost(results, plain):
    """CPU of the results over that of the plain ones, of the bags of which both ran. None without such a bag."""
    pairs = [(a[0].cpu, b[0].cpu) for a, b in zip(results, plain) if not isinstance(a, str) and not isinstance(b, str)]
    return sum(cpu for cpu, _ in pairs) / sum(cpu for _, cpu in pairs) if pairs else None


def row_of_group(motion, aid, results, plain):
    good = [result for result in results if not isinstance(result, str)]
    runs = [run for run, _ in good]
    return [motion, aid, len(good), len(results) - len(good), fixed(mean([run.figure("ate_m") for run in runs]), 3),
            fixed(mean([rms(errors) for _, errors in good]), 3),
            fixed(mean([abs(errors[-1]) for _, errors in good]), 3),
            fixed(cost(results, plain), 2), sum(map(is_contradicted, runs))]


def run(lab, sources, _):
    keys = [(source, aid) for source in sources for aid in AIDS]
    results = lab.map([(source, 1, one_run_or_fault(AIDS[aid], height_errors)) for source, aid in keys])
    groups = grouped([source for source, _ in keys], [(source.name, aid) for source, aid in keys], results)
    page = Page("Aids: what the platform cannot do, how high it is")
    page.notes.append("height: of the causal trajectory, from the start; cost: CPU of rio_t_bag over that without aids "
                      "on the same bags")
    page.notes.append(f"only {' and '.join(ON_WHEELS)} are ground vehicles: the others must say that the motion "
                      "contradicts it")
    page.tables.append(Table("aids", "Mean of the runs", [
        "motion", "aid", "runs", "failed", "ATE [m]", "height rms [m]", "height at the end [m]", "cost",
        "contradicted"], [row_of_group(*key, of, groups[key[0], "none"]) for key, of in groups.items()]))
    page.tables.append(Table("aids_runs", "Each run", [
        "motion", "seed", "aid", "ATE [m]", "height rms [m]", "height at the end [m]", "CPU [s]", "platform",
        "why there is no result"], [row_of_run(*key, result) for key, result in zip(keys, results)]))
    return page
