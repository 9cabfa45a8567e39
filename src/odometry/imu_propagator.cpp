#include "rio_t/odometry/imu_propagator.h"

#include <algorithm>
#include <iterator>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

/// [s] How far back the history reaches at most, if no anchor comes.
constexpr double kHistory = 30.0;
/// [sigma] A velocity that the IMU gained since rest and that its noise does not explain (chi-squared, 3
/// degrees of freedom: once in 70,000 times, two hours of rest at 10 scans a second).
constexpr double kMoves = 5.0;

}  // namespace

void ImuPropagator::add(const ImuMeasurement& imu) {
  if (state_) propagate(history_.empty() ? imu : history_.back(), imu);
  history_.push_back(imu);
  dropBefore(imu.time - kHistory);
}

void ImuPropagator::dropBefore(Time time) {
  while (history_.size() > 1 && history_[1].time <= time) history_.pop_front();
}

std::optional<NavigationState> ImuPropagator::state() const {
  const bool vibrates =
      !history_.empty() && history_.back().accel_noise > noise_.accel_density * noise_.accel_density;
  if (!state_ || !rest_ || !vibrates) return state_;
  constexpr int kV = StateBlock::kV;
  const Eigen::Matrix3d noise =
      state_->covariance.block<3, 3>(kV, kV) - rest_->covariance.block<3, 3>(kV, kV);
  const double variance = noise.trace() / 3.0;
  if (state_->v_W.squaredNorm() > kMoves * kMoves * variance) return state_;
  NavigationState held = *state_;
  held.v_W.setZero();
  held.p_W = rest_->p_W;
  return held;
}

void ImuPropagator::anchor(const NavigationState& state, bool at_rest) {
  if (state_ && !history_.empty() && state.time < history_.front().time) return;
  state_ = state;
  samples_ = {};
  rest_ = at_rest ? state_ : std::nullopt;
  const auto later = std::upper_bound(history_.begin(), history_.end(), state.time,
                                      [](Time time, const ImuMeasurement& imu) { return time < imu.time; });
  for (auto imu = later; imu != history_.end(); ++imu) {
    // If no sample at the anchor's time is kept, the first sample stands for it.
    propagate(imu == history_.begin() ? *imu : *std::prev(imu), *imu);
  }
}

void ImuPropagator::propagate(const ImuMeasurement& from, const ImuMeasurement& to) {
  NavigationState& x = *state_;
  const double dt = to.time - x.time;
  if (dt <= 0.0) return;
  // If the state lies between two samples, the signal is interpolated at its time.
  const double span = to.time - from.time;
  const double share = span > 0.0 ? std::min(1.0, dt / span) : 1.0;
  const Eigen::Vector3d gyro =
      to.angular_velocity - 0.5 * share * (to.angular_velocity - from.angular_velocity);
  const Eigen::Vector3d accel = to.acceleration - 0.5 * share * (to.acceleration - from.acceleration);
  const Eigen::Vector3d omega = gyro - x.b_g;
  const Eigen::Vector3d a = accel - x.b_a;

  const Eigen::Quaterniond half = so3::exp(0.5 * dt * omega);
  const Eigen::Vector3d a_W = (x.q_WI * half) * a + g_W_;

  samples_.add(x.q_WI, dt, omega, a, noise_.gyroVariance(to), noise_.accelVariance(to),
               to.unseen_velocity_variance);
  x.p_W += dt * x.v_W + 0.5 * dt * dt * a_W;
  x.v_W += dt * a_W;
  x.q_WI = (x.q_WI * half * half).normalized();
  x.angular_velocity = to.angular_velocity - x.b_g;
  x.time = to.time;
  if (!samples_.isWhole()) return;
  const auto addWalk = [&x, T = samples_.dt](int first, double density) {
    x.covariance.diagonal().segment<3>(first).array() += density * density * T;
  };
  propagateCovariance(samples_, x.covariance);
  addWalk(StateBlock::kBg, noise_.gyro_random_walk);
  addWalk(StateBlock::kBa, noise_.accel_random_walk);
}

}  // namespace rio_t
