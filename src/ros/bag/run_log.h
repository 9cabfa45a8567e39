#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {

/// Writes what a run gives, and keeps the accounts.
class RunLog {
 public:
  /// `output` may be null. `taken_off` [s]: the stamps are earlier, and the offset smaller, by so much.
  RunLog(RunOutput* output, double taken_off) : output_(output), taken_off_(taken_off) {}

  void addState(const NavigationState& state);
  /// Puts what was taken off the stamps back on.
  void addResult(ScanResult& result);
  /// Sets what the log knows.
  void fill(RunSummary* summary) const;
  Trajectory takeTrajectory() { return std::move(trajectory_); }

 private:
  RunOutput* output_;
  double taken_off_;
  Trajectory trajectory_;
  std::uint64_t used_ = 0;
  std::map<std::string, std::uint64_t> rejected_;
  std::map<SolverTermination, std::uint64_t> terminations_;
  std::optional<StampedPose> newest_optimized_;
  double path_length_m_ = 0.0;
  double final_offset_s_ = 0.0;
  double final_offset_sigma_s_ = 0.0;
};

}  // namespace rio_t
