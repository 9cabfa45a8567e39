#include "run_log.h"

#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

/// The estimates of a radar before its first scan: what was told.
RadarSummary before(const std::string& name, const OdometryOptions& options) {
  const SmootherOptions& smoother = options.smoother;
  RadarSummary radar;
  radar.name = name;
  radar.final_offset_s = smoother.time_offset_initial;
  if (smoother.estimate_time_offset) radar.final_offset_sigma_s = smoother.time_offset_sigma;
  if (smoother.estimate_extrinsics == EstimateExtrinsics::kNone) return radar;
  radar.extrinsics.emplace();
  radar.extrinsics->told = radar.extrinsics->T_IR = options.T_IR;
  radar.extrinsics->rotation_sigma.setConstant(smoother.extrinsics_rotation_sigma);
  if (smoother.estimate_extrinsics == EstimateExtrinsics::kPose)
    radar.extrinsics->translation_sigma.setConstant(smoother.extrinsics_translation_sigma);
  const Eigen::VectorXd sigmas = calibrationSigmas(smoother);
  radar.extrinsics->covariance = sigmas.tail(sigmas.size() - 1).cwiseAbs2().asDiagonal();
  return radar;
}

}  // namespace

RunLog::RunLog(const Config& config, RunOutput* output, const std::vector<double>& taken_off)
    : output_(output),
      offset_shared_(config.odometry.smoother.time_offset_shared),
      estimate_extrinsics_(config.odometry.smoother.estimate_extrinsics) {
  if (config.odometry.use_barometer) barometer_.emplace();
  if (config.odometry.platform == Platform::kGroundVehicle) {
    ground_vehicle_.emplace();
    ground_vehicle_->rotation = config.odometry.ground_vehicle.T_IV.q_IR;
    ground_vehicle_->rotation_sigma.setConstant(config.odometry.ground_vehicle.rotation_sigma);
  }
  const std::vector<std::string> names = runFiles(config).radars;
  for (std::size_t k = 0; k < names.size(); ++k) {
    Radar& radar = radars_.emplace_back();
    radar.taken_off = taken_off.at(k);
    radar.summary = before(names[k], optionsOfRadar(config.odometry, k));
    radar.summary.final_offset_s += radar.taken_off;
  }
}

void RunLog::addState(const NavigationState& state) {
  if (output_ != nullptr) output_->addState(state);
  trajectory_.push_back({state.time, state.p_W, state.q_WI});
}

void RunLog::addResult(ScanResult& result) {
  Radar& radar = radars_.at(result.scan.radar);
  if (radar.taken_off != 0.0) {
    result.scan.stamp = result.scan.stamp + radar.taken_off;
    if (result.updated) result.time_offset += radar.taken_off;
  }
  if (output_ != nullptr) output_->addResult(result);
  for (const StampedPose& pose : result.left_window) {
    if (newest_optimized_) path_length_m_ += (pose.p_W - newest_optimized_->p_W).norm();
    newest_optimized_ = pose;
  }
  if (result.used) {
    ++radar.summary.scans_used;
  } else if (!result.rejected_because.empty()) {
    ++radar.summary.scans_rejected[result.rejected_because];
  }
  if (result.health == Health::kDiverged) ++scans_diverged_;
  if (barometer_) barometer_->add(result);
  if (ground_vehicle_) ground_vehicle_->add(result);
  if (!result.updated) return;
  ++terminations_[result.solver_termination];
  for (Radar& each : radars_) {
    if (&each != &radar && !offset_shared_) continue;
    each.summary.final_offset_s = result.time_offset;
    each.summary.final_offset_sigma_s = result.time_offset_sigma;
  }
  if (!radar.summary.extrinsics) return;
  const Eigen::Matrix<double, 6, 1> sigmas = result.T_IR_covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  radar.summary.extrinsics->T_IR = result.T_IR;
  radar.summary.extrinsics->translation_sigma = sigmas.head<3>();
  radar.summary.extrinsics->rotation_sigma = sigmas.tail<3>();
  radar.summary.extrinsics->covariance = tangentCovariance(result.T_IR_covariance, estimate_extrinsics_);
}

void RunLog::fill(RunSummary* summary) const {
  summary->radars.clear();
  for (const Radar& radar : radars_) summary->radars.push_back(radar.summary);
  for (const auto& [termination, count] : terminations_)
    summary->solver_terminations[toString(termination)] = count;
  summary->scans_diverged = scans_diverged_;
  summary->barometer = barometer_;
  summary->ground_vehicle = ground_vehicle_;
  if (ground_vehicle_ && ground_vehicle_->last) {
    summary->ground_vehicle->rotation = ground_vehicle_->last->q_IV;
    summary->ground_vehicle->rotation_sigma = ground_vehicle_->last->q_IV_sigma;
  }
  summary->path_length_m = path_length_m_;
  if (trajectory_.empty()) return;
  const Eigen::Vector3d moved = trajectory_.back().p_W - trajectory_.front().p_W;
  summary->end_to_start_2d_m = moved.head<2>().norm();
  summary->end_to_start_3d_m = moved.norm();
}

}  // namespace rio_t
