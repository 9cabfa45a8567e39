"""Tables of errors against the truth, as the program `evaluate` gives them."""
import yaml

from .. import programs
from ..errors import RioTError

ACCURACY = (
    ("ATE: position, origin aligned, rmse [m]", "ape_origin_m", "rmse", ".4f"),
    ("ATE: position, origin aligned, largest [m]", "ape_origin_m", "max", ".4f"),
    ("orientation, origin aligned, rmse [deg]", "ape_origin_deg", "rmse", ".3f"),
    ("position, yaw and position aligned, rmse [m]", "ape_yaw_m", "rmse", ".4f"),
    ("position, SE3 aligned, rmse [m]", "ape_se3_m", "rmse", ".4f"),
    ("t_rel: RPE over 1 m, rmse [m/m]", "rpe_1m_m", "rmse", ".4f"),
    ("r_rel: RPE over 1 m, rmse [deg/m]", "rpe_1m_deg", "rmse", ".3f"),
    ("RPE over 1 s, rmse [m]", "rpe_1s_m", "rmse", ".4f"),
    ("RPE over 1 s, rmse [deg]", "rpe_1s_deg", "rmse", ".3f"),
    ("path of the truth [m]", "drift", "path_m", ".2f"),
    ("error at the end [m]", "drift", "final_m", ".3f"),
    ("yaw error at the end [deg]", "drift", "final_yaw_deg", ".2f"),
    ("drift [m/m]", "drift", "per_metre", ".4f"),
)
ERRORS = "stamp,x,y,z,truth_x,truth_y,truth_z,angle_deg,yaw_deg"  # header of `evaluate --errors`


def run_evaluate(program, *arguments):
    evaluation = yaml.safe_load(programs.output_of(program, "--yaml", *arguments))
    if not isinstance(evaluation, dict):
        raise RioTError(f"{program}: expected the program evaluate")
    return evaluation


def accuracy_rows(evaluations):
    rows = [["matched poses"] + [str(e["matched_poses"]) for e in evaluations]]
    for label, key, field, form in ACCURACY:
        values = [e.get(key) for e in evaluations]
        rows.append([label] + ["\u2013" if value is None or value.get("pairs") == 0 else format(value[field], form)
                               for value in values])
    return rows


def offset_rows(e):
    rows = [
        ["truth [ms]", f"{1e3 * e['true_s']:.3f}"],
        ["last estimate minus truth [ms]", f"{1e3 * e['final_error_s']:.3f} (sigma {1e3 * e['final_sigma_s']:.3f})"],
        ["mean error [ms]", f"{1e3 * e['mean_error_s']:.3f}"],
        ["rmse [ms]", f"{1e3 * e['rmse_s']:.3f}"],
        ["largest error [ms]", f"{1e3 * e['max_error_s']:.3f}"],
        ["estimates", str(e["samples"])],
    ]
    if "share_1_sigma" in e:  # the offset was estimated
        rows += [
            ["within 1, 2, 3 sigma",
             ", ".join(f"{100 * e[f'share_{k}_sigma']:.1f} %" for k in (1, 2, 3)) + " (honest: 68.3, 95.4, 99.7)"],
            ["mean of (error / sigma)\u00b2", f"{e['mean_normalised_square']:.3f} (honest: 1)"],
        ]
    return rows
