#include "rio_t/odometry/radars_health.h"

namespace rio_t {

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
  // A radar that is silent says nothing, neither good nor bad.
  const auto isBetter = [&](const HealthMonitor& a, const HealthMonitor& b) {
    if (a.hears(now) != b.hears(now)) return a.hears(now);
    return !a.isContradicted() && b.isContradicted();
  };
  for (std::size_t k = 0; k < monitors_.size(); ++k)
    if (isBetter(monitors_[k], best())) best_ = k;
  return health();
}

}  // namespace rio_t
