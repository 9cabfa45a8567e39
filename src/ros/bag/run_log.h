#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {

/// Writes the estimates of a run, and keeps the newest of them for its summary.
class RunLog {
 public:
  /// `taken_off` [s], by radar: the stamps are earlier, and the offset smaller, by so much.
  RunLog(const Config& config, RunOutput* output, const std::vector<double>& taken_off);

  void addState(const NavigationState& state);
  /// Puts what was taken off the stamps back on.
  void addResult(ScanResult& result);
  /// Sets what the log knows.
  void fill(RunSummary* summary) const;
  Trajectory takeTrajectory() { return std::move(trajectory_); }

 private:
  struct Radar {
    RadarEstimate estimate;
    double taken_off = 0.0;
  };

  RunOutput* output_;
  bool offset_shared_;
  double max_bridged_gap_;  // [s]
  std::vector<Radar> radars_;
  Trajectory trajectory_;
  std::optional<BarometerCounts> barometer_;           // if there is one
  std::optional<GroundVehicleCounts> ground_vehicle_;  // if the platform is one
  std::optional<StampedPose> newest_optimized_;
  double path_length_m_ = 0.0;
};

}  // namespace rio_t
