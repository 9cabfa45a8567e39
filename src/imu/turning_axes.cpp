#include "rio_t/imu/turning_axes.h"

#include <Eigen/Eigenvalues>

namespace rio_t {
namespace {

/// Noise alone does not reach so many of its sigmas as rms over a window, which has two or three independent
/// means.
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
