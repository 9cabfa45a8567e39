"""The normalised errors of an estimate with known errors."""
import numpy
import pytest
from scipy.spatial.transform import Rotation

from rio_t import nees
from rio_t.errors import RioTError
from rio_t.run_folder import Navigation
from rio_t.tum import Trajectory

MOTION_PARTS = ("position", "z", "velocity", "tilt", "yaw")


def trajectory(time, position, rotation):
    return Trajectory(numpy.round(1e9 * time).astype(numpy.int64), position, rotation.as_quat())


def offsets_of(rows):
    stamps, offsets, sigmas = numpy.array(rows).T
    return {"stamp": (1e9 * stamps).astype(numpy.int64), "offset_s": offsets, "sigma_s": sigmas}


class MadeUp:
    """A known motion at 400 Hz, and an estimate ten times a second with known errors in a world of its own."""
    SIGMAS = numpy.array([0.1, 0.2, 0.4, 0.01, 0.03, 0.002, 0.05, 0.1, 0.3])
    TURN, SHIFT = Rotation.from_euler("z", 2.5), numpy.array([10.0, -20.0, 3.0])  # of the world of the estimate

    def __init__(self, seconds, attitude=(0.4, -0.3, 1.0)):
        time = numpy.arange(0, seconds + 2, 0.0025)
        self.truth = trajectory(time, self.position(time), self.rotation(time, attitude))
        self.time = numpy.arange(0.7013, seconds, 0.1)
        self.R = self.TURN * self.rotation(self.time, attitude)
        self.velocity = self.TURN.apply(numpy.stack([2 * numpy.cos(self.time), -1.5 * numpy.sin(3 * self.time),
                                                     0.4 * numpy.cos(2 * self.time)], -1))
        self.no_error = numpy.zeros((len(self.time), 9))

    @staticmethod
    def position(t):
        return numpy.stack([2 * numpy.sin(t), 0.5 * numpy.cos(3 * t), 0.2 * numpy.sin(2 * t)], -1)

    @staticmethod
    def rotation(t, attitude):
        return Rotation.from_rotvec(numpy.outer(1 + 0.3 * numpy.sin(t), attitude))

    def noise(self, seed=0):
        """Errors of the SIGMAS, nil at the first stamp, where the worlds are brought together."""
        errors = numpy.random.default_rng(seed).normal(size=self.no_error.shape) * self.SIGMAS
        errors[0] = 0
        return errors

    def result(self, errors, sigmas=SIGMAS, offsets=((5.0, 0.032, 0.001), )):
        estimate = trajectory(self.time, self.TURN.apply(self.position(self.time)) + self.SHIFT + errors[:, :3],
                              Rotation.from_rotvec(errors[:, 3:6]) * self.R)
        navigation = Navigation(estimate, self.velocity + errors[:, 6:], numpy.broadcast_to(sigmas, errors.shape))
        return nees.consistency(navigation, offsets_of(offsets), self.truth, 0.03)


def test_honest_sigmas_give_one():
    data = MadeUp(400)
    figures = data.result(data.noise()).nees
    for part in MOTION_PARTS:
        assert figures[part] == pytest.approx(1.0, abs=0.08), part


def test_sigmas_half_of_the_errors_give_four():
    data = MadeUp(400)
    figures = data.result(data.noise(1), 0.5 * MadeUp.SIGMAS).nees
    for part in MOTION_PARTS:
        assert figures[part] == pytest.approx(4.0, abs=0.32), part


def test_place_and_heading_of_the_start_are_no_error():
    data = MadeUp(20)
    result = data.result(data.no_error)
    # What is left is the interpolation of the truth.
    assert numpy.abs(result.ratios * MadeUp.SIGMAS).max() < 3e-5
    assert len(result.ratios) == len(data.time) - 10, "the first second counts"


def test_roll_and_pitch_of_the_start_stay_errors():
    data = MadeUp(20)
    errors = data.no_error.copy()
    errors[:, 3:5] = 0.01, -0.03
    figures = data.result(errors).nees
    assert figures["tilt"] == pytest.approx(1.0, abs=0.01)
    assert figures["position"] < 1e-3


def test_yaw_is_about_the_vertical_of_the_world():
    data = MadeUp(20, attitude=(1.5, 0.0, 0.0))  # lies on its side: its z axis is horizontal
    errors = data.no_error.copy()
    errors[1:, 5] = 0.02
    figures = data.result(errors, numpy.full(9, 0.01)).nees
    assert figures["yaw"] == pytest.approx(4.0, abs=0.01)
    assert figures["tilt"] < 1e-6


@pytest.mark.parametrize("column, part, share", [(0, "position", 3), (2, "z", 1), (3, "tilt", 2), (5, "yaw", 1),
                                                 (7, "velocity", 3)])
def test_each_axis_has_its_own_sigma(column, part, share):
    data = MadeUp(20)
    errors = data.no_error.copy()
    errors[1:, column] = 3 * MadeUp.SIGMAS[column]
    assert data.result(errors).nees[part] == pytest.approx(9 / share, abs=0.01)


def test_offset_counts_where_it_is_estimated():
    data = MadeUp(20)
    offsets = [(1.0, 0.5, 0.001), (3.0, 0.03, 0.0), (5.0, 0.032, 0.001), (6.0, 0.026, 0.001)]
    result = data.result(data.no_error, offsets=offsets)
    assert result.nees["offset"] == pytest.approx((2**2 + 4**2) / 2)
    assert result.offset_quantile(1.0) == pytest.approx(4.0)
    nothing = data.result(data.no_error, offsets=[(3.0, 0.03, 0.0)])
    assert numpy.isnan(nothing.nees["offset"]) and numpy.isnan(nothing.offset_quantile(0.95))


def test_a_sigma_of_zero_is_told():
    data = MadeUp(20)
    with numpy.errstate(all="ignore"), pytest.raises(RioTError, match="sigma"):
        data.result(data.no_error, sigmas=numpy.zeros(9))


def test_a_truth_that_ends_early_is_told():
    data = MadeUp(20)
    data.truth = data.truth[:400]
    with pytest.raises(RioTError, match="does not reach"):
        data.result(data.no_error)


def test_a_real_run_is_read(simulated_run):
    figures = nees.read_consistency(simulated_run / "run", simulated_run / "truth.txt", 0.03).nees
    assert set(figures) == set(nees.PARTS)
    # Wide: it is only asked that nothing is in another frame or unit.
    assert all(0.003 < figure < 30 for figure in figures.values()), figures
