#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {

/// Writes the estimates of a run, and keeps the newest for the summary.
class RunLog {
 public:
  /// `subtracted` [s]: what was subtracted from the stamps of each radar, and so from its offset.
  /// `keeps_trajectory`: for takeTrajectory(), 90 MB an hour.
  RunLog(const Config& config, RunOutput* output, const std::vector<double>& subtracted,
         bool keeps_trajectory);

  void addState(const NavigationState& state);
  /// Call it if the clock of the IMU jumped: the next optimised poses are the last from before the jump.
  void startAgain() { starts_again_ = true; }
  /// Adds to stamp and offset of the result what was subtracted.
  void addResult(ScanResult& result);
  /// Sets the estimates in the summary.
  void fill(RunSummary* summary) const;
  /// The poses at the IMU samples; empty if they are not kept.
  Trajectory takeTrajectory() { return std::move(trajectory_); }

 private:
  struct Radar {
    RadarEstimate estimate;
    double subtracted = 0.0;
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
