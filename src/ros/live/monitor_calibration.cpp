// LiveMonitor: time offset and extrinsics of a radar.
#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cmath>
#include <sstream>
#include <string>

#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/core/sigmas.h"
#include "rio_t/ros/diagnosis/diagnosis.h"
#include "rio_t/ros/live/monitor.h"

namespace rio_t {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// [s] A radar that gave no estimate for so long shows nothing now. The slowest radars come once a second. A
/// scan then waits up to 0.5 s for its trigger, and 0.11 s for the IMU. The rest is for transport and solver.
constexpr double kRecent = 2.0;
/// The sigma of what the motion shows is below this share of the configured one.
constexpr double kObserved = 0.5;

std::string listOf(const Eigen::VectorXd& numbers) {
  std::ostringstream text;
  text << numbers.transpose().format({6, Eigen::DontAlignCols, ", ", ", ", "", "", "[", "]"});
  return text.str();
}

/// "turn about x, y", or nothing if no number is above the bound.
std::string axesAbove(const Eigen::Vector3d& numbers, double bound, const std::string& what) {
  std::string axes;
  for (int axis = 0; axis < 3; ++axis) {
    if (numbers[axis] <= bound) continue;
    axes += (axes.empty() ? what : ", ") + std::string(1, "xyz"[axis]);
  }
  return axes;
}

}  // namespace

bool LiveMonitor::isRecent(const Radar& radar) const {
  if (!radar.last_update) return false;
  // While ~odom waits for tf there is no newest state.
  const Time now = newest_state_ ? newest_state_->time : last_update_->result.state.time;
  return now - radar.last_update->result.state.time < kRecent;
}

void LiveMonitor::describeTimeOffset(Status& status, std::size_t radar) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Radar& of = radars_.at(radar);
  if (!of.last_update) {
    status.summary(DiagnosticStatus::OK, "not estimated yet");
    return;
  }
  const ScanResult& result = of.last_update->result;
  const bool observable = of.last_update->offset_observable && isRecent(of);
  status.add("offset_ms", 1e3 * result.time_offset);
  status.add("sigma_ms", 1e3 * result.time_offset_sigma);
  status.add("observable", observable ? "true" : "false");
  const double bound = config_.odometry.smoother.max_time_offset;
  if (!config_.odometry.smoother.estimate_time_offset) {
    status.summary(DiagnosticStatus::OK, "held: estimate_time_offset is false");
  } else if (std::abs(result.time_offset) > 0.99 * bound) {
    status.summary(DiagnosticStatus::WARN, "the offset is at its bound max_time_offset");
  } else if (!isRecent(of)) {
    status.summary(DiagnosticStatus::OK, "kept: no scan of " + called(of) + " is used now");
  } else {
    status.summary(DiagnosticStatus::OK,
                   observable ? "observed by the motion now" : "kept: not observable now");
  }
}

void LiveMonitor::describeExtrinsics(Status& status, std::size_t radar) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Radar& of = radars_.at(radar);
  if (!of.last_update) {
    status.summary(DiagnosticStatus::OK, "not estimated yet");
    return;
  }
  const ScanResult& result = of.last_update->result;
  const SmootherOptions& options = of.config.odometry.smoother;
  const Eigen::Matrix<double, 6, 1> sigma = sigmasOf(result.T_IR_covariance);
  const Eigen::Vector3d turn = turnBetween(result.configured_T_IR, result.T_IR);
  const Eigen::Vector3d turn_sigma = sigma.tail<3>();
  // As the parameters want them.
  status.add("extrinsics_rotation_xyzw", listOf(result.T_IR.q_IR.coeffs()));
  status.add("extrinsics_translation", listOf(result.T_IR.l_I));
  if (estimatesTurn(options.estimate_extrinsics)) {
    status.add("turn_from_configured_deg", listOf(turn / kDegree));
    status.add("turn_sigma_deg", listOf(turn_sigma / kDegree));
  }
  std::string kept = axesAbove(turn_sigma, kObserved * options.extrinsics_rotation_sigma, "turn about ");
  if (estimatesLeverArm(options.estimate_extrinsics)) {
    const Eigen::Vector3d lever_sigma = sigma.head<3>();
    status.add("lever_arm_from_configured_m", listOf(result.T_IR.l_I - result.configured_T_IR.l_I));
    status.add("lever_arm_sigma_m", listOf(lever_sigma));
    const std::string lever = axesAbove(
        lever_sigma, kObserved * of.config.odometry.radar.extrinsics_translation_sigma, "lever arm along ");
    if (!lever.empty()) appendItem(&kept, lever);
  }
  const std::string far =
      axesAbove(turn.cwiseAbs(), kFarMounting * options.extrinsics_rotation_sigma, "about ");
  if (!far.empty()) {
    status.summary(DiagnosticStatus::WARN,
                   "the estimated rotation of " + called(of) + " " + far +
                       " differs from the configured one by more than three sigmas, " +
                       fixedText(kFarMounting * options.extrinsics_rotation_sigma / kDegree, 0) + " degrees");
  } else if (!kept.empty()) {
    status.summary(DiagnosticStatus::OK, "kept: the motion has not shown the " + kept);
  } else {
    status.summary(DiagnosticStatus::OK, "observed by the motion");
  }
}

}  // namespace rio_t
