#include "rio_t/odometry/innovation_gate.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace rio_t {
namespace {

constexpr double kUnanimousTime = 0.5;  // [s] of scans that are unanimous: one may be chance

}  // namespace

Eigen::Matrix3d InnovationGate::covariance(const VelocityPrior& prior, const EgoVelocity& measured) const {
  const double model_error = options_.innovation_model_error;
  return prior.covariance + measured.covariance + model_error * model_error * Eigen::Matrix3d::Identity();
}

bool InnovationGate::rejects(Time stamp, const VelocityPrior& prior, const EgoVelocity& measured,
                             bool tilt_is_known) {
  const double gate = options_.innovation_gate;
  const Eigen::Vector3d d = measured.v_R - prior.v_R;
  if (gate == 0.0 || d.dot(covariance(prior, measured).ldlt().solve(d)) <= gate * gate) return false;
  if (!tilt_is_known || std::abs(stamp - last_used_) > options_.innovation_gate_timeout) return false;
  const bool is_unanimous =
      static_cast<double>(measured.inliers.size()) > kUnanimous * static_cast<double>(measured.points_used);
  if (!is_unanimous) {
    unanimous_since_.reset();
  } else if (!unanimous_since_) {
    unanimous_since_ = stamp;
  }
  return !unanimous_since_ || std::abs(stamp - *unanimous_since_) < kUnanimousTime;
}

void InnovationGate::used(Time stamp) {
  last_used_ = stamp;
  unanimous_since_.reset();
}

}  // namespace rio_t
