#include "rio_t/ros/live/offset_observability.h"

namespace rio_t {

void OffsetObservability::add(const ScanResult& result) {
  if (!result.updated) return;
  const NavigationState& state = result.state;
  const double dt = previous_ ? state.time - previous_->time : 0.0;
  if (dt > 0.0 && result.used) {
    const Eigen::Vector3d change =
        state.q_WI.conjugate() * state.v_W - previous_->q_WI.conjugate() * previous_->v_W;
    const double variance = result.ego_velocity.covariance.trace() / 3.0;
    if (variance > 0.0) samples_.push_back({state.time, change.squaredNorm() / (dt * dt * variance)});
  }
  if (!previous_ || dt > 0.0) previous_ = state;
  while (!samples_.empty() && previous_->time - samples_.front().time > kWindow) samples_.pop_front();
}

bool OffsetObservability::observable() const {
  double information = 0.0;
  for (const Sample& sample : samples_) information += sample.information;
  return information * kMaxSigma * kMaxSigma > 1.0;
}

}  // namespace rio_t
