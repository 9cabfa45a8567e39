#include "rio_t/ros/diagnosis/run_evidence.h"

#include <algorithm>
#include <cmath>

#include "rio_t/odometry/body_odometry.h"
#include "rio_t/radar/doppler_grid.h"

namespace rio_t {

std::uint64_t countOf(const Counts& counts, const std::string& name) {
  const auto found = counts.find(name);
  return found == counts.end() ? 0 : found->second;
}

EvidenceCollector::EvidenceCollector(const Config& config)
    : coasting_after_(config.odometry.health.coasting_after),
      max_bridged_gap_(config.odometry.imu_input_check.max_bridged_gap),
      max_imu_gap_(config.odometry.max_imu_gap) {
  for (const Config& radar : configsOfRadars(config)) {
    filters_.emplace_back(radar.odometry.radar.ego_velocity);
    evidence_.radars.emplace_back().name = radar.radar_name;
    last_used_.emplace_back();
  }
  if (config.odometry.landmarks.enabled) evidence_.landmarks.emplace();
  if (config.odometry.platform != Platform::kGroundVehicle) return;
  GroundVehicleCounts& vehicle = evidence_.ground_vehicle.emplace();
  vehicle.rotation = config.odometry.ground_vehicle.T_IV.q_IR;
  vehicle.rotation_sigma.setConstant(config.odometry.ground_vehicle.rotation_sigma);
}

void EvidenceCollector::add(const ScanResult& result) {
  if (evidence_.ground_vehicle) evidence_.ground_vehicle->add(result);
  if (evidence_.landmarks) evidence_.landmarks->add(result);
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses
  RadarSummary& radar = evidence_.radars.at(result.scan.radar);
  ++radar.scans_total;
  const PointFilter& filter = filters_[result.scan.radar];
  std::array<std::uint64_t, kPointVerdicts> of_scan = {};
  for (const RadarPoint& point : result.scan.points) {
    ++radar.points;
    radar.snr_sum_db += point.snr_db;
    if (point.doppler != 0.0) ++radar.points_with_doppler;
    ++of_scan[static_cast<std::size_t>(filter.judge(point))];
  }
  addPoints(of_scan, &radar);
  const double ahead = newest_imu_ ? result.scan.stamp - *newest_imu_ : 0.0;
  const bool is_before_start = result.rejected_because == "before_initialization";
  if (is_before_start || result.rejected_because == "stamp_ahead_of_imu")
    radar.seconds_ahead_of_imu = std::max(radar.seconds_ahead_of_imu, ahead);
  if (is_before_start) {
    ++radar.scans_before_start;
    if (ahead > 0.0) ++radar.scans_ahead_at_start;  // a scan that is only a little ahead would have waited
    if (oldest_imu_ && result.scan.stamp < *oldest_imu_ && ++radar.scans_before_imu == 1)
      radar.seconds_before_imu = *oldest_imu_ - result.scan.stamp;
    ++radar.scans_rejected[result.rejected_because];
    ++radar.velocity_status[toString(result.ego_velocity.status)];
    return;
  }
  // At rest, a radar that drops static points gives no scan to use, but it is not silent. A late scan counts
  // from now on.
  if (result.used || result.at_rest)
    last_used_[result.scan.radar] = std::max(result.scan.stamp, newest_state_.value_or(result.scan.stamp));
  ++evidence_.scans_judged;
  if (result.health == Health::kDiverged) ++evidence_.scans_diverged;
  if (result.is_contradicted) ++evidence_.scans_contradicted;
  if (result.used) {
    ++radar.scans_used;
  } else {
    ++radar.scans_rejected[result.rejected_because];
  }
  if (!result.updated) return;
  if (result.state.v_W.norm() > DopplerGrid::kLargestUsualStep) ++radar.scans_fast;
  radar.turn = turnBetween(result.configured_T_IR, result.T_IR);
  radar.errors = result.errors;
  evidence_.heading_sigma = sigmasOf(bodyOdometry(result.state, 0.0).pose_covariance)[5];
  ++evidence_.solver_terminations[toString(result.solver_termination)];
}

void EvidenceCollector::addPoints(const std::array<std::uint64_t, kPointVerdicts>& of_scan,
                                  RadarSummary* radar) {
  constexpr std::uint64_t kEnough = 3;  // as EgoVelocityStatus::kTooFewPoints
  std::uint64_t all = 0;
  for (std::size_t k = 0; k < kPointVerdicts; ++k) {
    all += of_scan[k];
    radar->points_by_verdict[k] += of_scan[k];
  }
  if (all == 0) ++radar->scans_empty;
  const auto kept = static_cast<std::size_t>(PointVerdict::kKept);
  static_assert(static_cast<std::size_t>(PointVerdict::kKept) == 0);
  if (all < kEnough || of_scan[kept] >= kEnough) return;
  const auto most = std::max_element(of_scan.begin() + 1, of_scan.end());
  ++radar->scans_emptied[static_cast<std::size_t>(most - of_scan.begin())];
}

void EvidenceCollector::addState(Time time) {
  const double step = newest_state_ ? time - *newest_state_ : 0.0;
  newest_state_ = time;
  if (step <= 0.0 || step > max_bridged_gap_) {  // the first one, or the clock jumped
    std::fill(last_used_.begin(), last_used_.end(), time);
    return;
  }
  evidence_.run_seconds += step;
  for (std::size_t k = 0; k < last_used_.size(); ++k)
    if (time - last_used_[k] > coasting_after_) evidence_.radars[k].silent_seconds += step;
  const double silence = time - *std::max_element(last_used_.begin(), last_used_.end());
  if (silence <= coasting_after_) return;
  evidence_.silent_seconds += step;
  if (silence <= evidence_.silence_end - evidence_.silence_begin) return;
  evidence_.silence_begin = evidence_.run_seconds - silence;
  evidence_.silence_end = evidence_.run_seconds;
}

void EvidenceCollector::addDropped(std::size_t radar, const std::string& reason, std::uint64_t count) {
  evidence_.radars.at(radar).scans_total += count;
  evidence_.radars.at(radar).scans_rejected[reason] += count;
}

RunEvidence EvidenceCollector::evidence(const RadarInertialOdometry& odometry,
                                        const std::optional<RadarInertialOdometry::Start>& start) const {
  RunEvidence all = evidence_;
  all.initialized = odometry.initialized();
  if (start) all.initialized_from = start->from;
  if (!all.initialized) all.waiting_for = odometry.waitingFor();
  all.input_faults = odometry.faults();
  // These two judge the estimate, not the input.
  all.divergences = countOf(all.input_faults, "diverged");
  all.reinitializations = countOf(all.input_faults, "reinitialized");
  all.input_faults.erase("diverged");
  all.input_faults.erase("reinitialized");
  all.health = odometry.health();
  all.imu_noise = odometry.imuNoiseOfRun();
  return all;
}

void BarometerCounts::add(const ScanResult& result) {
  for (const BarometerAnswer& mean : result.barometer) {
    last = mean;
    if (!mean.rejected_because.empty()) {
      ++rejected[mean.rejected_because];
      continue;
    }
    ++used;
    bias = mean.bias;
    bias_sigma = mean.bias_sigma;
    if (mean.stepped) {
      ++steps;
    } else {
      innovation_square += mean.innovation * mean.innovation;
    }
  }
}

void GroundVehicleCounts::add(const ScanResult& result) {
  if (!result.ground_vehicle) return;
  last = result.ground_vehicle;
  ++(last->used ? used : left_out);
  if (!first_judged) first_judged = last->time;
  if (last->is_contradicted) contradicted_at = last->time - *first_judged;
  rotation = last->q_IV;
  rotation_sigma = last->q_IV_sigma;
}

void LandmarkCounts::add(const ScanResult& result) {
  if (!result.landmarks) return;
  ++scans;
  is_trusted = result.landmarks->is_trusted;
  if (is_trusted) ++scans_trusted;
  in_map = result.landmarks->map.size();
  most_in_map = std::max(most_in_map, in_map);
}

}  // namespace rio_t
