"""Velocities from poses, and what they predict of the radar; for curves only."""
import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import RioTError
from ..geometry import interpolate, interpolate_rotations
from ..run_folder import of_radar

MOVING = "moving"
USED = (MOVING, "zero_velocity")    # status of a used scan that has a velocity of its own
POINTS_ONLY = "points_only"         # of a used scan that has none


# [s] A central difference over h to either side loses (2 pi f h)^2 / 6 of a motion of frequency f. At 1 Hz, as of an arm
# or a vehicle, this is 8 %. Poses at 10 Hz pass, with a tenth for their jitter.
LONGEST_STEP = 0.11
LONGEST_GAP = 2 * LONGEST_STEP  # one pose is missing


def rises(t):
    """Whether the times rise. If a clock went back, a time no longer names one pose."""
    return bool(np.all(np.diff(t) > 0))


def motion(t, trajectory):
    """Central differences over at least 50 ms: times, v_I, omega_I, one row each, NaN at gaps. None if too short or
    sparse, or if the times do not increase."""
    p, q = trajectory.position, trajectory.quaternion
    if len(t) < 3 or t[-1] - t[0] < 0.3 or not rises(t):
        return None
    step = max(0.025, float(np.median(np.diff(t))))
    at = t[(t > t[0] + step) & (t < t[-1] - step)]
    if len(at) == 0 or step > LONGEST_STEP:
        return None
    v_W = (interpolate(at + step, t, p) - interpolate(at - step, t, p)) / (2 * step)
    turn = interpolate_rotations(at - step, t, q).inv() * interpolate_rotations(at + step, t, q)
    v_I, omega_I = interpolate_rotations(at, t, q).apply(v_W, inverse=True), turn.as_rotvec() / (2 * step)
    gaps_before = np.concatenate([[0], np.cumsum(np.diff(t) > LONGEST_GAP)])
    first, last = np.searchsorted(t, at - step, "right") - 1, np.searchsorted(t, at + step)
    across = gaps_before[last] > gaps_before[first]
    v_I[across], omega_I[across] = np.nan, np.nan
    return at, v_I, omega_I


def configured_extrinsics(summary, path, radar):
    """Position of the radar in the IMU frame and R_IR, as the summary of the run in `path` names them."""
    keys = [of_radar(f"configured_extrinsics_{what}", radar) for what in ("translation", "rotation_xyzw")]
    try:
        lever, rotation = (np.array(summary[key], dtype=float) for key in keys)
        return lever.reshape(3), Rotation.from_quat(rotation.reshape(4))
    except (KeyError, TypeError, ValueError):
        raise RioTError(f"{path}: expected {keys[0]} (3 numbers) and {keys[1]} (4 numbers)") from None


def predicted_ego_velocity(scans, at, reference, extrinsics, source):
    """Velocity of the radar in its frame that `reference` predicts at the times `at` of the scans, n x 3, NaN outside
    and at gaps; and how. None if there are too few scans for it. `source`: where the extrinsics are from; they are fitted
    if None."""
    t, v_I, omega_I = reference
    v, w = interpolate(at, t, v_I), interpolate(at, t, omega_I)
    inside = (at >= t[0]) & (at <= t[-1]) & np.all(np.isfinite(v), axis=1)
    if extrinsics is not None:
        lever, R_IR = extrinsics
        predicted = R_IR.apply(v + np.cross(w, lever), inverse=True)
    else:
        # Any mounting is linear in velocity and turn rate. Fitted to the data, largest misfits left out. Scans at rest fit
        # every mounting: among many of them, those in motion would be the largest misfits.
        regressors = np.concatenate([v, w], axis=1)
        measured = np.stack([scans["v" + k] for k in "xyz"], -1)
        use = inside & (scans["status"] == MOVING) & np.all(np.isfinite(measured), axis=1)
        if np.count_nonzero(use) < 20:
            return None, ""
        for _ in range(5):
            fit = np.linalg.lstsq(regressors[use], measured[use], rcond=1e-3)[0]
            misfit = np.linalg.norm(measured - regressors @ fit, axis=1)
            use = use & (misfit <= 4 * np.median(misfit[use]) + 1e-9)
        predicted = regressors @ fit
    predicted[~inside] = np.nan
    return predicted, f"mounting {source}"
