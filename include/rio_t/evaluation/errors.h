#pragma once

#include <cstddef>
#include <vector>

#include "rio_t/evaluation/trajectory.h"

/// Trajectory errors as evo (github.com/MichaelGrupp/evo) defines them, so that the figures can be compared
/// with published ones. See Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012.
namespace rio_t {

/// How the estimate is moved onto the truth before poses are compared.
enum class Alignment {
  kNone,
  kOrigin,  ///< the first matched poses coincide
  kYaw,     ///< least squares over positions, rotation about the vertical of W only (4 degrees of freedom)
  kSe3,     ///< least squares over positions (Umeyama 1991, without scale)
};

struct Statistics {
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double max = 0.0;
};

/// Rigid motion from the world of the estimate (E) to the world of the truth (T).
struct RigidTransform {
  Eigen::Quaterniond q_TE = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t_T = Eigen::Vector3d::Zero();
};

/// Transform that aligns the estimate to the truth. Throws std::invalid_argument if there are too few
/// matches: kOrigin needs one, kYaw two with horizontal distance, kSe3 three that are not on a line.
RigidTransform alignment(const Trajectory& truth, const Trajectory& estimate,
                         const std::vector<Match>& matches, Alignment kind);

/// Error of one matched pose after alignment.
struct PoseError {
  Time time;                ///< of the estimate
  Eigen::Vector3d p_T;      ///< estimate, moved into the world of the truth [m]
  Eigen::Vector3d truth_T;  ///< [m]
  double angle_deg = 0.0;   ///< between the orientations, in [0, 180]
  double yaw_deg = 0.0;     ///< heading of the estimate minus that of the truth, in [-180, 180]
};

/// Throws std::invalid_argument if no poses match, or too few for the alignment.
std::vector<PoseError> poseErrors(const Trajectory& truth, const Trajectory& estimate, Alignment kind,
                                  double max_difference = kDefaultMaxDifference);

/// ATE (evo's APE): distance of positions [m] and angle between orientations [deg] after alignment.
struct AbsoluteError {
  Statistics translation_m;
  Statistics rotation_deg;
  std::size_t matched_poses = 0;
};

/// Throws as poseErrors does.
AbsoluteError absoluteError(const Trajectory& truth, const Trajectory& estimate, Alignment kind,
                            double max_difference = kDefaultMaxDifference);

enum class DeltaUnit { kMetres, kSeconds };

struct RelativeErrorOptions {
  double delta = 1.0;  ///< length of a piece, > 0 [m or s]; metres are travelled by the estimate
  DeltaUnit unit = DeltaUnit::kMetres;
  /// false (evo's convention): each piece ends with the first pose at or beyond `delta`, and the next piece
  /// begins there. The first piece begins where the path first reaches `delta`. true: a piece begins at every
  /// pose and ends at the pose nearest to `delta` further on, if that is within a tenth of `delta`.
  bool all_pairs = false;
};

/// RPE: error of the motion between two poses, translation [m] and rotation [deg] per piece. No alignment.
struct RelativeError {
  Statistics translation_m;
  Statistics rotation_deg;
  std::size_t pairs = 0;  ///< zero when the estimate is shorter than a piece; the statistics are zero then
};

/// Throws std::invalid_argument if no poses match or `delta` is not positive.
/// With the defaults, the rmse are t_rel [m/m] and r_rel [deg/m] of the RIO-T paper.
RelativeError relativeError(const Trajectory& truth, const Trajectory& estimate,
                            const RelativeErrorOptions& options = RelativeErrorOptions{},
                            double max_difference = kDefaultMaxDifference);

/// Error of the last matched pose after alignment of the first, in total and per metre of the true path.
struct Drift {
  double path_m = 0.0;  ///< length of the truth's path between the first and last match
  double final_m = 0.0;
  double final_horizontal_m = 0.0;
  double final_yaw_deg = 0.0;  ///< estimate minus truth, in [-180, 180]
  double per_metre = 0.0;      ///< final_m / path_m; zero if the truth does not move
};

/// Throws std::invalid_argument if no poses match.
Drift drift(const Trajectory& truth, const Trajectory& estimate,
            double max_difference = kDefaultMaxDifference);

}  // namespace rio_t
