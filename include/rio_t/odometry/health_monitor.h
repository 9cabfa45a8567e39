#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "rio_t/core/sliding_queue.h"
#include "rio_t/core/time.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

/// Whether the estimate can be trusted.
enum class Health {
  kOk,
  kCoasting,  ///< no scan was used for `coasting_after`: the IMU alone carries the estimate
  kDiverged,  ///< radar and estimate contradict each other, or the velocity is not known any more
};
std::string toString(Health health);  ///< "ok", "coasting", "diverged"

enum class OnDivergence {
  kReport,        ///< "report": say so, and go on
  kReinitialize,  ///< "reinitialize": say so, and find the state anew in motion where it lasts
};

struct HealthOptions {
  OnDivergence on_divergence = OnDivergence::kReinitialize;
  /// [s] of divergence. For so long the IMU alone is worth more than a radar that contradicts it, e.g. in
  /// front of a bus that passes.
  double reinitialize_after = 5.0;
  double window = 2.0;  ///< [s] of scans that are judged
  /// Mean over the window of min(1, d' S^-1 d / gate^2): the share of scans that contradict the prediction.
  double max_contradiction = 0.65;
  double max_velocity_sigma = 1.0;  ///< [m/s] of an axis of I
  double coasting_after = 1.0;      ///< [s]
};

/// Judges the estimate by its innovations (docs/method.md, section 12). Not thread-safe.
class HealthMonitor {
 public:
  /// `gate` [sigma]: where a scan contradicts the prediction in full; 0: 4.
  HealthMonitor(const HealthOptions& options, double gate);

  /// Of a scan that by itself has a velocity most of its points agree on.
  void addInnovation(const Innovation& innovation);
  /// A scan the points of which do not agree, or side with the prediction: it contradicts nothing. It does not
  /// end a divergence either.
  void addUndecided(Time stamp) {
    if (!diverged_at_) add({stamp, 0.0, std::nullopt});
  }
  /// The window was updated at `time`.
  void updated(Time time) { last_update_ = time; }
  /// The time offset was found to have stepped, which explains what contradicted so far; once in a while. Three
  /// steps in a row are a divergence: it is something else that the offset cannot explain.
  void offsetStepped(Time stamp);
  /// The state at `time` was found anew. Once diverged, the next scans must agree before it is trusted.
  void startedAt(Time time);

  /// Judges at `now`; `state` is what is published.
  Health judge(Time now, const NavigationState& state);
  Health health() const { return health_; }
  /// Whether the state should be found anew.
  bool wantsReinitialization(Time now) const;

  /// While diverged, adds what the scans contradict to the covariance: their speed to the velocity, over the
  /// time since it began to the position, over gravity times a second to the attitude. Else does nothing.
  void widen(NavigationState& state) const;

 private:
  struct Entry {
    Time stamp;
    double contradiction = 0.0;    ///< 0..1
    std::optional<double> square;  ///< d'd [m^2/s^2]; none where the scan has no velocity
  };
  void add(const Entry& entry);
  /// Mean over the window; none before it is full.
  std::optional<double> contradiction() const;

  HealthOptions options_;  // read-only after construction
  double gate_;            // read-only after construction
  SlidingQueue<Entry> entries_;
  Time last_update_;
  SlidingQueue<Time> steps_;  ///< of the offset, those near the last
  std::optional<Time> diverged_at_;  ///< since when the scans contradict, or since the last start after that
  Time contradicted_since_;
  Time latest_;  ///< stamp of the newest entry, also after the entries were cleared
  double mean_square_ = 0.0;  ///< of d, by the latest scans that had a velocity [m^2/s^2]
  Health health_ = Health::kOk;
};

}  // namespace rio_t
