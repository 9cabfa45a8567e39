"""What must happen in a faulty run. Each expectation describes itself in words, and reports what did not hold."""
import dataclasses
import re

import numpy

from .. import programs

RECOVERY = 5.0             # [s] after the end of a fault everything must be as without it
# Bound on the velocity error after the recovery: a factor on the error of the fault-free run, and an allowance [m/s].
# Without truth the fault-free run is the reference, and the two estimates differ by the noise of both.
RECOVERED, RECOVERED_WITHOUT_TRUTH = (1.5, 0.05), (1.5, 0.10)
# Largest error in standard deviations. Without truth it is twice as large: the calibration of the real bag is 3.5 degrees
# off, so an estimate with radar and one without contradict each other by more than their sigmas.
HONEST, HONEST_WITHOUT_TRUTH = 4.0, 8.0
SILENCE = 0.5              # [s] that the output may end before the IMU does


@dataclasses.dataclass
class Survives:
    """Runs to the end with a bounded error, says how sure it is, recovers, and counts what was wrong.

    velocity, position: bounds on the error [m/s, m] at any time, against the truth or the fault-free run.
    counted: patterns of names in summary.yaml (input_faults, scans_rejected), each of which must be there, and more often
        than in the fault-free run.
    grows: the stated uncertainty of the velocity at the end of the fault is at least that many times the one before.
    world_goes_on: false where the estimate starts again, so that positions are not comparable.
    """
    velocity: float
    position: float
    counted: tuple = ()
    grows: float = None
    world_goes_on: bool = True

    def words(self):
        text = f"error < {self.velocity:g} m/s"
        if self.world_goes_on:
            text += f", {self.position:g} m"
        if self.grows:
            text += f", sigma grows {self.grows:g} times"
        text += f", recovers in {RECOVERY:g} s"
        if self.counted:
            text += ", counts " + " ".join(self.counted)
        return text

    def judge(self, outcome, begin, end):
        """(what happened, [what of it is wrong])"""
        if outcome.status not in programs.HAS_RESULT:
            return f"exit status {outcome.status}: {first_line(outcome.messages)}", ["does not run"]
        wrong, happened = list(faults_of_result(outcome)), []
        errors = outcome.errors
        if errors is None:
            return "no output", wrong + ["no output"]
        after = errors.part(begin, numpy.inf)
        if len(after.time) == 0:
            return "no output after the fault", wrong + ["no output after the fault"]
        happened.append(f"{after.velocity.max():.2f} m/s")
        if after.velocity.max() > self.velocity:
            wrong.append(f"velocity error {after.velocity.max():.2f} m/s")
        if self.world_goes_on:
            happened.append(f"{after.position.max():.2f} m")
            if after.position.max() > self.position:
                wrong.append(f"position error {after.position.max():.2f} m")
            usual = outcome.reference.ratio.max() if outcome.reference is not None else 0.0
            happened.append(f"{errors.ratio.max():.1f} sigma")
            if errors.ratio.max() > max(HONEST if outcome.has_truth else HONEST_WITHOUT_TRUTH, 1.3 * usual):
                wrong.append(f"error of {errors.ratio.max():.1f} sigma (without the fault {usual:.1f})")
        if self.grows:
            before = errors.part(begin - 1.0, begin - 0.1).velocity_sigma
            worst = errors.part(begin, end + 0.3).velocity_sigma
            grown = worst.max() / before.mean() if len(before) and len(worst) else 0.0
            happened.append(f"sigma times {grown:.1f}")
            if grown < self.grows:
                wrong.append(f"sigma grew {grown:.1f} times only")
        if end + RECOVERY < outcome.length:
            recovered = velocity_rms(errors.part(end + RECOVERY, numpy.inf))
            usual = velocity_rms(outcome.reference.part(end + RECOVERY, numpy.inf)) if outcome.reference is not None else 0.0
            happened.append(f"then {recovered:.3f} m/s")
            factor, allowance = RECOVERED if outcome.has_truth else RECOVERED_WITHOUT_TRUTH
            if not recovered <= factor * usual + allowance:
                wrong.append(f"not recovered: {recovered:.3f} m/s, without the fault {usual:.3f}")
        counts = outcome.counted()
        for pattern in self.counted:
            found = {name: n for name, n in counts.items() if re.fullmatch(pattern, name)}
            if not found:
                wrong.append(f"{pattern} not counted ({', '.join(counts) or 'nothing'})")
            happened.append(" ".join(f"{name} {n}" for name, n in found.items()))
        return ", ".join(h for h in happened if h), wrong


@dataclasses.dataclass
class Refuses:
    """Ends with exit status 1 and one line that says what is wrong and what was expected."""
    message: str

    def words(self):
        return f"exit status 1, says \"{self.message}\""

    def judge(self, outcome, begin, end):
        line = first_line(outcome.messages)
        wrong = []
        if outcome.status != 1:
            wrong.append(f"exit status {outcome.status}")
        if not re.search(self.message, outcome.messages):
            wrong.append("does not say so")
        return line or f"exit status {outcome.status}", wrong


@dataclasses.dataclass
class RefusesOrReports:
    """Rest alone cannot tell that the input is wrong: the run is refused, or it reports the divergence that follows and
    says how uncertain it is."""
    message: str
    counted: str = "diverged"

    def words(self):
        return f"exit status 1 with \"{self.message}\", or counts {self.counted}"

    def judge(self, outcome, begin, end):
        if outcome.status not in programs.HAS_RESULT:
            return Refuses(self.message).judge(outcome, begin, end)
        wrong = list(faults_of_result(outcome))
        count = outcome.counted().get(self.counted, 0)
        if not count:
            wrong.append("an estimate from such input, without a word")
        return f"{self.counted} {count}", wrong


def velocity_rms(errors):
    return numpy.sqrt(numpy.mean(numpy.square(errors.velocity))) if len(errors.time) else numpy.nan


def first_line(text):
    """The line that says what went wrong; the likely causes follow it."""
    return text.strip().partition("\n")[0]


def faults_of_result(outcome):
    """Faults that no run with a result may have."""
    if outcome.not_a_number:
        yield "nan or inf in " + ", ".join(outcome.not_a_number)
    summary = outcome.summary
    accounted = summary.get("scans_used", 0) + sum((summary.get("scans_rejected") or {}).values())
    if accounted != summary.get("scans_total"):
        yield f"{summary.get('scans_total')} scans came, {accounted} accounted for"
    silent = outcome.last_imu - outcome.run.time[-1] if outcome.run is not None else 0.0
    if silent > SILENCE:
        yield f"output ends {silent:.1f} s before the IMU"
