#include "rio_t/odometry/health_monitor.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

constexpr double kDefaultGate = 4.0;     // [sigma]
constexpr std::size_t kMinScans = 8;     // fewer prove nothing
constexpr double kMinSpan = 0.7;         // share of the window that they must cover
constexpr std::size_t kMaxScans = 1000;  // bounds the memory
constexpr double kStepsApart = 20.0;     // [s] an earlier next step of the offset explains no contradiction
constexpr std::size_t kFalseSteps = 3;   // within kStepsApart they are a divergence: a driver restarts once
constexpr double kMaxSpeed = 200.0;      // [m/s] no platform with such a radar
/// The bound on the scale of the squares. Turned axes give 50 and more. The worst good platform, a kart with
/// sparse radars, gives 16 for a second and then less than 10.
constexpr double kMaxModelErrorScale = 25.0;
constexpr double kAboutGravity = 10;  // [m/s^2] a tilt error x changes the velocity by x g each second

/// Variance of the velocity in I [m^2/s^2]. A heading that an IMU gap lost makes v_W uncertain for good. It
/// is no divergence. An error delta of the state gives the velocity error R_IW (delta_v + A delta_theta).
Eigen::Vector3d bodyVelocityVariance(const NavigationState& state) {
  using S = StateBlock;
  const Eigen::Matrix3d R_WI = state.q_WI.toRotationMatrix();
  const Eigen::Matrix3d A = so3::hat(state.v_W) * R_WI;
  const auto P_vt = state.covariance.block<3, 3>(S::kV, S::kTheta);
  const Eigen::Matrix3d AP = A * state.covariance.block<3, 3>(S::kTheta, S::kTheta);
  const Eigen::Matrix3d cross = P_vt * A.transpose();
  const Eigen::Matrix3d sum =
      state.covariance.block<3, 3>(S::kV, S::kV) + cross + cross.transpose() + AP * A.transpose();
  return (R_WI.transpose() * sum * R_WI).diagonal();
}

}  // namespace

std::string toString(Health health) {
  constexpr const char* kNames[] = {"ok", "coasting", "diverged"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Health::kDiverged) + 1);
  return kNames[static_cast<std::size_t>(health)];
}

HealthMonitor::HealthMonitor(const HealthOptions& options, double gate) : options_(options) { setGate(gate); }

void HealthMonitor::setGate(double gate) { gate_ = gate > 0.0 ? gate : kDefaultGate; }

void HealthMonitor::addInnovation(const Innovation& innovation) {
  add({innovation.stamp, std::min(1.0, innovation.squaredSigmas() / (gate_ * gate_)),
       innovation.d.squaredNorm()});
}

void HealthMonitor::add(const Entry& entry) {
  entries_.push_back(entry);
  while (entries_.size() > kMaxScans || std::abs(entry.stamp - entries_.front().stamp) > options_.window)
    entries_.pop_front();
  latest_ = entry.stamp;
  double sum = 0.0;
  double count = 0.0;
  for (const Entry& each : entries_) {
    if (!each.square) continue;
    sum += *each.square;
    count += 1.0;
  }
  if (count > 0.0) mean_square_ = sum / count;
}

std::optional<double> HealthMonitor::contradiction() const {
  if (entries_.size() < kMinScans) return std::nullopt;
  const bool spans_window = entries_.back().stamp - entries_.front().stamp >= kMinSpan * options_.window;
  if (!spans_window && entries_.size() < kMaxScans) return std::nullopt;
  double sum = 0.0;
  for (const Entry& entry : entries_) sum += entry.contradiction;
  return sum / static_cast<double>(entries_.size());
}

void HealthMonitor::offsetStepped(Time stamp) {
  // A divergence causes false steps, one after the other. They must not hide the divergence.
  if (steps_.empty() || std::abs(stamp - steps_.back()) > kStepsApart) entries_.clear();
  steps_.push_back(stamp);
  while (std::abs(stamp - steps_.front()) > kStepsApart) steps_.pop_front();
}

void HealthMonitor::startedAt(Time time) {
  entries_.clear();
  steps_.clear();
  last_update_ = time;
  if (diverged_at_) diverged_at_ = time;
}

bool HealthMonitor::hears(Time now) const { return latest_ && std::abs(now - *latest_) <= options_.window; }

bool HealthMonitor::wantsReinitialization(Time now) const {
  return options_.on_divergence == OnDivergence::kReinitialize && diverged_at_ &&
         now - *diverged_at_ > options_.reinitialize_after;
}

Health HealthMonitor::judge(Time now, const NavigationState& state, double model_error_scale) {
  if (!diverged_at_ && steps_.size() >= kFalseSteps) {
    diverged_at_ = now;
    contradicted_since_ = steps_.front();
    steps_.clear();
    entries_.clear();  // a whole window must agree before it is trusted again
  }
  if (const std::optional<double> share = contradiction()) {
    if (!diverged_at_ && *share > options_.max_contradiction) {
      diverged_at_ = now;
      contradicted_since_ = entries_.front().stamp;
    } else if (diverged_at_ && *share < 0.5 * options_.max_contradiction) {
      diverged_at_.reset();
      steps_.clear();  // the divergence caused them
    }
  }
  const double variance = bodyVelocityVariance(state).maxCoeff();
  const double max_sigma = options_.max_velocity_sigma;
  // Both are false for NaN.
  const bool possible =
      state.p_W.allFinite() && state.v_W.allFinite() && state.v_W.norm() < kMaxSpeed && variance >= 0.0;
  const bool known = variance < max_sigma * max_sigma;
  if (model_error_scale < kMaxModelErrorScale) misfit_since_.reset();
  if (model_error_scale >= kMaxModelErrorScale && !misfit_since_) misfit_since_ = now;
  const bool fits = !misfit_since_ || now - *misfit_since_ < options_.window;
  is_contradicted_ = diverged_at_ || !possible || !fits;
  health_ = is_contradicted_ || !known                     ? Health::kDiverged
            : now - last_update_ > options_.coasting_after ? Health::kCoasting
                                                           : Health::kOk;
  return health_;
}

void HealthMonitor::widen(NavigationState& state) const {
  if (!diverged_at_ || mean_square_ == 0.0) return;
  const double square = mean_square_;
  const double seconds = std::max(1.0, *latest_ - contradicted_since_);
  const auto add = [&](int first, double variance) {
    state.covariance.diagonal().segment<3>(first).array() += variance;
  };
  add(StateBlock::kV, square);
  add(StateBlock::kP, square * seconds * seconds);
  add(StateBlock::kTheta, square / (kAboutGravity * kAboutGravity));
}

RadarsHealth::RadarsHealth(const HealthOptions& options, double gate, std::size_t radars)
    : monitors_(radars, HealthMonitor(options, gate)) {}

void RadarsHealth::updated(Time time) {
  for (HealthMonitor& monitor : monitors_) monitor.updated(time);
}

void RadarsHealth::setGate(double gate) {
  for (HealthMonitor& monitor : monitors_) monitor.setGate(gate);
}

void RadarsHealth::startedAt(Time time) {
  for (HealthMonitor& monitor : monitors_) monitor.startedAt(time);
}

Health RadarsHealth::judge(Time now, const NavigationState& state, double model_error_scale) {
  for (HealthMonitor& monitor : monitors_) monitor.judge(now, state, model_error_scale);
  // A silent radar neither confirms nor contradicts the estimate.
  const auto isBetter = [&](const HealthMonitor& a, const HealthMonitor& b) {
    if (a.hears(now) != b.hears(now)) return a.hears(now);
    return !a.isContradicted() && b.isContradicted();
  };
  for (std::size_t k = 0; k < monitors_.size(); ++k)
    if (isBetter(monitors_[k], best())) best_ = k;
  return health();
}

}  // namespace rio_t
