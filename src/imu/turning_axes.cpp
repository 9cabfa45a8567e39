#include "rio_t/imu/turning_axes.h"

#include <Eigen/Eigenvalues>

namespace rio_t {
namespace {

/// [sigma] An axis turns if the rms of its means exceeds this. A window has two or three independent means,
/// and noise alone does not reach it with these.
constexpr double kTurning = 3.0;

}  // namespace

Eigen::Matrix3d TurningAxes::projection() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares_);
  Eigen::Matrix3d turning = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i)
    if (axes.eigenvalues()[i] > kTurning * kTurning * noise_)
      turning += axes.eigenvectors().col(i) * axes.eigenvectors().col(i).transpose();
  return turning;
}

}  // namespace rio_t
