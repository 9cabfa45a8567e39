"""Velocities from poses, and what they predict of the radar; for curves only."""
import numpy as np
from scipy.spatial.transform import Rotation

from ..errors import RioTError
from ..geometry import interpolate, interpolate_rotations
from ..run_folder import of_radar

USED = ("moving", "zero_velocity")  # status of a used scan that has a velocity of its own
POINTS_ONLY = "points_only"         # of a used scan that has none


def motion(t, trajectory):
    """Central differences over at least 50 ms: times, v_I, omega_I, one row each. None if too short or sparse."""
    p, q = trajectory.position, trajectory.quaternion
    if len(t) < 3 or t[-1] - t[0] < 0.3:
        return None
    step = max(0.025, float(np.median(np.diff(t))))
    at = t[(t > t[0] + step) & (t < t[-1] - step)]
    if len(at) == 0:
        return None
    v_W = (interpolate(at + step, t, p) - interpolate(at - step, t, p)) / (2 * step)
    turn = interpolate_rotations(at - step, t, q).inv() * interpolate_rotations(at + step, t, q)
    return at, interpolate_rotations(at, t, q).apply(v_W, inverse=True), turn.as_rotvec() / (2 * step)


def extrinsics_in(content, path, prefix="", radar=""):
    """Position of the radar in the IMU frame and R_IR, of the keys that begin with `prefix`."""
    keys = [of_radar(f"{prefix}extrinsics_{what}", radar) for what in ("translation", "rotation_xyzw")]
    try:
        lever, rotation = (np.array(content[key], dtype=float) for key in keys)
        return lever.reshape(3), Rotation.from_quat(rotation.reshape(4))
    except (KeyError, TypeError, ValueError):
        raise RioTError(f"{path}: expected {keys[0]} (3 numbers) and {keys[1]} (4 numbers)") from None


def predicted_ego_velocity(scans, at, reference, extrinsics, source):
    """Velocity of the radar in its frame that `reference` predicts at the times `at` of the scans, n x 3, NaN outside;
    and how. None if there are too few scans for it. `source`: where the extrinsics are from."""
    t, v_I, omega_I = reference
    inside = (at >= t[0]) & (at <= t[-1])
    v, w = interpolate(at, t, v_I), interpolate(at, t, omega_I)
    if extrinsics is not None:
        lever, R_IR = extrinsics
        predicted, how = R_IR.apply(v + np.cross(w, lever), inverse=True), f"mounting {source}"
    else:
        # Any mounting is linear in velocity and turn rate. Fitted to the data, largest misfits left out.
        regressors = np.concatenate([v, w], axis=1)
        measured = np.stack([scans["v" + k] for k in "xyz"], -1)
        use = inside & np.isin(scans["status"], USED) & np.all(np.isfinite(measured), axis=1)
        if np.count_nonzero(use) < 20:
            return None, ""
        for _ in range(5):
            fit = np.linalg.lstsq(regressors[use], measured[use], rcond=1e-3)[0]
            misfit = np.linalg.norm(measured - regressors @ fit, axis=1)
            use = use & (misfit <= 4 * np.median(misfit[use]) + 1e-9)
        predicted, how = regressors @ fit, "mounting fitted to the data; give --config for the true one"
    predicted[~inside] = np.nan
    return predicted, how
