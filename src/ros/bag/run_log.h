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
  /// `keeps_trajectory`: for takeTrajectory(), 90 MB an hour.
  RunLog(const Config& config, RunOutput* output, const std::vector<double>& taken_off,
         bool keeps_trajectory);

  void addState(const NavigationState& state);
  /// The clock of the IMU jumped: the next optimised poses are the last ones from before.
  void startAgain() { starts_again_ = true; }
  /// Puts what was taken off the stamps back on.
  void addResult(ScanResult& result);
  /// Sets what the log knows.
  void fill(RunSummary* summary) const;
  /// The poses at the IMU samples; empty if they are not kept.
  Trajectory takeTrajectory() { return std::move(trajectory_); }

 private:
  struct Radar {
    RadarEstimate estimate;
    double taken_off = 0.0;
  };

  RunOutput* output_;
  bool offset_shared_;
  bool keeps_trajectory_;
  std::vector<Radar> radars_;
  Trajectory trajectory_;
  std::optional<Eigen::Vector3d> first_p_W_;
  Eigen::Vector3d last_p_W_ = Eigen::Vector3d::Zero();
  std::optional<StampedPose> newest_optimized_;  // none after a restart
  bool starts_again_ = false;
  double path_length_m_ = 0.0;
};

}  // namespace rio_t
