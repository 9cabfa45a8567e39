#include "run_log.h"

#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

/// Returns the estimates of a radar before its first scan, which are the configured values.
RadarEstimate before(const SmootherOptions& smoother, const CalibrationPrior& configured) {
  RadarEstimate radar;
  radar.final_offset_s = configured.time_offset_initial;
  if (smoother.estimate_time_offset) radar.final_offset_sigma_s = configured.time_offset_sigma;
  if (smoother.estimate_extrinsics == EstimateExtrinsics::kNone) return radar;
  radar.extrinsics.emplace();
  radar.extrinsics->configured = radar.extrinsics->T_IR = configured.T_IR;
  radar.extrinsics->covariance =
      extrinsicsCovariance(extrinsicsSigmas(smoother, configured).cwiseAbs2().asDiagonal().toDenseMatrix(),
                           smoother.estimate_extrinsics);
  return radar;
}

}  // namespace

RunLog::RunLog(const Config& config, RunOutput* output, const std::vector<double>& subtracted,
               bool keeps_trajectory)
    : output_(output),
      offset_shared_(config.odometry.smoother.time_offset_shared),
      keeps_trajectory_(keeps_trajectory) {
  for (std::size_t k = 0; k < subtracted.size(); ++k) {
    Radar& radar = radars_.emplace_back(
        Radar{before(config.odometry.smoother, config.odometry.ofRadar(k)), subtracted[k]});
    radar.estimate.final_offset_s += radar.subtracted;
  }
}

void RunLog::addState(const NavigationState& state) {
  if (output_ != nullptr) output_->addState(state);
  if (!first_p_W_) first_p_W_ = state.p_W;
  last_p_W_ = state.p_W;
  if (keeps_trajectory_) trajectory_.push_back({state.time, state.p_W, state.q_WI});
}

void RunLog::addResult(ScanResult& result) {
  Radar& radar = radars_.at(result.scan.radar);
  if (radar.subtracted != 0.0) {
    result.scan.stamp = result.scan.stamp + radar.subtracted;
    if (result.updated) result.time_offset += radar.subtracted;
  }
  if (output_ != nullptr) output_->addResult(result);
  for (const StampedPose& pose : result.left_window) {
    if (newest_optimized_ && newest_optimized_->time < pose.time)
      path_length_m_ += (pose.p_W - newest_optimized_->p_W).norm();
    newest_optimized_ = pose;
  }
  // The step across a restart of the IMU's clock is no part of the path.
  if (starts_again_ && !result.left_window.empty()) {
    newest_optimized_.reset();
    starts_again_ = false;
  }
  if (!result.updated) return;
  for (Radar& each : radars_) {
    if (&each != &radar && !offset_shared_) continue;
    each.estimate.final_offset_s = result.time_offset;
    each.estimate.final_offset_sigma_s = result.time_offset_sigma;
  }
  if (!radar.estimate.extrinsics) return;
  radar.estimate.extrinsics->T_IR = result.T_IR;
  radar.estimate.extrinsics->covariance = result.T_IR_covariance;
}

void RunLog::fill(RunSummary* summary) const {
  for (std::size_t k = 0; k < radars_.size(); ++k)
    static_cast<RadarEstimate&>(summary->radars.at(k)) = radars_[k].estimate;
  summary->path_length_m = path_length_m_;
  if (!first_p_W_) return;
  const Eigen::Vector3d moved = last_p_W_ - *first_p_W_;
  summary->end_to_start_2d_m = moved.head<2>().norm();
  summary->end_to_start_3d_m = moved.norm();
}

}  // namespace rio_t
