#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rio_t/inspection/mounting_search.h"

namespace rio_t {

/// cost(x) = x' H x - 2 b' x + c. The size is dynamic, since that compiles in a tenth of the time.
struct Quadratic {
  explicit Quadratic(Eigen::Index size)
      : H(Eigen::MatrixXd::Zero(size, size)), b(Eigen::VectorXd::Zero(size)) {}

  Eigen::MatrixXd H;
  Eigen::VectorXd b;
  double c = 0.0;
};

/// Eliminates the last `count` unknowns: the cost of the others is then that with the best values of these.
Quadratic withoutLast(const Quadratic& cost, Eigen::Index count);

/// A velocity with its weight in a robust loss.
struct WeightedVelocity {
  const RadarVelocity* velocity = nullptr;
  double weight = 1.0;
};
using VelocityWindow = std::vector<WeightedVelocity>;

/// The search fits the mounting to these windows of velocities and to the track of the IMU.
struct MountingProblem {
  const InertialTrack& track;
  const MountingSearchOptions& options;
  std::vector<VelocityWindow> windows;
};

/// Returns the windows with motion. The IMU covers their velocities for any offset up to `reach` [s].
std::vector<VelocityWindow> windowsOf(const std::vector<RadarVelocity>& velocities,
                                      const InertialTrack& track, double reach);

/// The unknowns of a mounting: the columns of M (v_I = M v_R, M a rotation times the sign of the Doppler),
/// then the lever arm l_I.
constexpr Eigen::Index kMountingM = 9, kMountingL = 3;

Eigen::VectorXd columnsOf(const Eigen::Matrix3d& M);

/// The cost of a mounting at an offset [s], in sigma^2. `M`: an estimate of M, which turns the covariances
/// of the velocities into G; without one, each velocity has its mean variance on all axes.
Quadratic mountingCost(double offset, const std::optional<Eigen::Matrix3d>& M,
                       const MountingProblem& problem);

/// Sets the weights of the velocities for a mounting, by a Cauchy loss. Returns how badly the velocities fit:
/// the mean square [sigma^2] per axis, computed from the median; at least 1.
double reweigh(double offset, const Eigen::Matrix3d& M, const Eigen::Vector3d& l_I, MountingProblem* problem);

}  // namespace rio_t
