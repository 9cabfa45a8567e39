#pragma once

#include <cstddef>
#include <vector>

#include "rio_t/odometry/health_monitor.h"

namespace rio_t {

/// Judges the estimate by the innovations of all radars. Where one radar agrees with the estimate, the
/// estimate is right, and a radar that contradicts it fails. Not thread-safe.
class RadarsHealth {
 public:
  /// `gate`: see HealthMonitor.
  RadarsHealth(const HealthOptions& options, double gate, std::size_t radars);

  HealthMonitor& of(std::size_t radar) { return monitors_.at(radar); }

  // All as in HealthMonitor.
  void setGate(double gate);
  void updated(Time time);
  void startedAt(Time time);
  Health judge(Time now, const NavigationState& state, double model_error_scale);
  Health health() const { return best().health(); }
  bool isContradicted() const { return best().isContradicted(); }
  bool wantsReinitialization(Time now) const { return best().wantsReinitialization(now); }
  void widen(NavigationState& state) const { best().widen(state); }

 private:
  const HealthMonitor& best() const { return monitors_[best_]; }

  std::vector<HealthMonitor> monitors_;
  std::size_t best_ = 0;  ///< a radar that is heard and does not contradict the estimate, if there is one
};

}  // namespace rio_t
