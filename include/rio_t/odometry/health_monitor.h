#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/sensors/innovation.h"

namespace rio_t {

/// Whether the estimate can be trusted.
enum class Health {
  kOk,
  kCoasting,  ///< no scan was used for `coasting_after`: the IMU alone carries the estimate
  kDiverged,  ///< radar and estimate contradict each other, or the velocity is unknown
};
std::string toString(Health health);  ///< "ok", "coasting", "diverged"

enum class OnDivergence {
  kReport,        ///< "report": report it and go on
  kReinitialize,  ///< "reinitialize": report it, and re-initialise in motion if it lasts
};

struct HealthOptions {
  OnDivergence on_divergence = OnDivergence::kReinitialize;
  /// [s] of divergence. For this long the IMU alone is better than a radar that contradicts it, e.g. in front
  /// of a bus that passes.
  double reinitialize_after = 5.0;
  /// [s] of scans that are judged. A crowd may fill the view for 2 s; a divergence must show within 5 s.
  double window = 4.0;
  /// Mean over the window of min(1, d' S^-1 d / gate^2): the share of scans that contradict the prediction.
  double max_contradiction = 0.65;
  double max_velocity_sigma = 1.0;  ///< [m/s] of an axis of I
  double coasting_after = 1.0;      ///< [s]
};

/// Judges the estimate by the innovations of one radar (docs/method.md, section 12). Not thread-safe.
class HealthMonitor {
 public:
  /// `gate` [sigma]: a scan this far from the prediction contradicts it fully; 0 stands for 4.
  HealthMonitor(const HealthOptions& options, double gate);
  void setGate(double gate);  ///< for the scans to come

  /// Takes a scan whose points agree on a velocity without the prediction.
  void addInnovation(const Innovation& innovation);
  /// Takes a scan whose points do not agree, or agree only with the prediction. It contradicts nothing, and
  /// it does not end a divergence.
  void addUndecided(Time stamp) {
    if (!diverged_at_) add({stamp, 0.0, std::nullopt});
  }
  /// Call it when the window was updated at `time`.
  void updated(Time time) { last_update_ = time; }
  /// Call it if the time offset stepped before the scan `stamp`. One step explains the contradictions before
  /// it, so they no longer count. Three steps within 20 s are a divergence: no offset steps so often.
  void offsetStepped(Time stamp);
  /// Call it if the estimate was initialised or re-initialised at `time`. After a divergence the next scans
  /// must agree before it is trusted.
  void startedAt(Time time);

  /// Judges the published `state` at `now`. `model_error_scale` is that of ModelErrorScale: if the models are
  /// wrong by five of their sigmas for a whole window, the input does not match the options.
  Health judge(Time now, const NavigationState& state, double model_error_scale = 1.0);
  Health health() const { return health_; }
  /// Whether the scans contradict the estimate, so that it must not predict them. False if only the velocity
  /// is unknown, since the covariance shows that.
  bool isContradicted() const { return is_contradicted_; }
  /// Whether a scan came within the window before `now`.
  bool hears(Time now) const;
  /// Whether the divergence has lasted long enough for a re-initialisation.
  bool wantsReinitialization(Time now) const;

  /// Adds the mean squared innovation to the covariance, only while diverged (docs/method.md, eq. 49).
  void widen(NavigationState& state) const;

 private:
  struct Entry {
    Time stamp;
    double contradiction = 0.0;    ///< 0..1
    std::optional<double> square;  ///< d'd [m^2/s^2]; none if the scan has no velocity
  };
  void add(const Entry& entry);
  /// Mean over the window; none before it is full.
  std::optional<double> contradiction() const;

  HealthOptions options_;  // read-only after construction
  double gate_ = 0.0;
  std::deque<Entry> entries_;
  Time last_update_;
  std::deque<Time> steps_;           ///< of the offset, within 20 s of the last
  std::optional<Time> diverged_at_;  ///< start of the divergence, or the last start after it
  Time contradicted_since_;
  std::optional<Time> latest_;  ///< stamp of the newest entry, also after the entries were cleared
  std::optional<Time> misfit_since_;
  double mean_square_ = 0.0;  ///< of d, by the latest scans that had a velocity [m^2/s^2]
  Health health_ = Health::kOk;
  bool is_contradicted_ = false;
};

/// Judges the estimate by the innovations of all radars. If one radar agrees with the estimate, the estimate
/// is right, and a radar that contradicts it is faulty. Not thread-safe.
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
