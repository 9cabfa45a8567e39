#include <yaml-cpp/yaml.h>

#include "../text.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {
namespace {

/// `values`: a vector of Eigen or of the standard library.
template <typename Values>
std::vector<std::string> fixedList(const Values& values, int decimals) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < static_cast<std::size_t>(values.size()); ++i)
    texts.push_back(fixedText(values[i], decimals));
  return texts;
}

/// The lines of summary.yaml, in order.
class SummaryLines {
 public:
  SummaryLines() { yaml_ << YAML::BeginMap; }
  template <typename T>
  void add(const std::string& key, const T& value) {
    yaml_ << YAML::Key << key << YAML::Value << YAML::Flow << value;
  }
  void beginMap(const std::string& key) { add(key, YAML::BeginMap); }
  void endMap() { yaml_ << YAML::EndMap; }
  void addChecks(const std::vector<Check>& checks) {
    yaml_ << YAML::Key << "checks" << YAML::Value << YAML::BeginSeq;
    for (const Check& check : checks) {
      yaml_ << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << check.name;
      yaml_ << YAML::Key << "value" << YAML::Value << fixedText(check.value, 4);
      yaml_ << YAML::Key << (check.at_least ? "at_least" : "at_most") << YAML::Value
            << fixedText(check.limit, 4);
      yaml_ << YAML::Key << "good" << YAML::Value << check.good() << YAML::EndMap;
    }
    yaml_ << YAML::EndSeq;
  }
  void addCauses(const std::vector<Cause>& causes) {
    yaml_ << YAML::Key << "causes" << YAML::Value;
    if (causes.empty()) yaml_ << YAML::Flow;
    yaml_ << YAML::BeginSeq;
    for (const Cause& cause : causes) {
      yaml_ << YAML::BeginMap << YAML::Key << "name" << YAML::Value << cause.name;
      yaml_ << YAML::Key << "share" << YAML::Value << fixedText(cause.share, 3);
      yaml_ << YAML::Key << "text" << YAML::Value << YAML::DoubleQuoted << cause.text;
      yaml_ << YAML::Key << "remedy" << YAML::Value << YAML::DoubleQuoted << cause.remedy << YAML::EndMap;
    }
    yaml_ << YAML::EndSeq;
  }
  std::string text() {
    yaml_ << YAML::EndMap;
    return std::string(yaml_.c_str()) + "\n";
  }

 private:
  YAML::Emitter yaml_;
};

void addEstimates(SummaryLines& lines, const RadarSummary& radar) {
  const std::string suffix = suffixOf(radar.name);
  lines.add("final_offset_s" + suffix, fixedText(radar.final_offset_s, 9));
  lines.add("final_offset_sigma_s" + suffix, fixedText(radar.final_offset_sigma_s, 9));
  const CalibrationErrors& errors = radar.errors;  // of what is not estimated
  if (errors.turn) {                               // about the axes of the IMU [rad]
    lines.add("mounting_turn" + suffix, fixedList(errors.turn->error, 6));
    lines.add("mounting_turn_sigma" + suffix, fixedList(errors.turn->sigma(), 6));
  }
  if (errors.lever_arm) {  // along the axes of the IMU [m]
    lines.add("lever_arm_error" + suffix, fixedList(errors.lever_arm->error, 4));
    lines.add("lever_arm_error_sigma" + suffix, fixedList(errors.lever_arm->sigma(), 4));
  }
  lines.add("doppler_scale_error" + suffix, fixedText(errors.scale.error, 4));
  lines.add("doppler_scale_error_sigma" + suffix, fixedText(errors.scale.sigma(), 4));
  if (errors.offset) {
    lines.add("offset_error_s" + suffix, fixedText(errors.offset->error, 9));
    lines.add("offset_error_sigma_s" + suffix, fixedText(errors.offset->sigma(), 9));
  }
  if (!radar.extrinsics) return;
  const ExtrinsicsSummary& extrinsics = *radar.extrinsics;
  lines.add("configured_extrinsics_translation" + suffix, fixedList(extrinsics.configured.l_I, 9));
  lines.add("configured_extrinsics_rotation_xyzw" + suffix,
            fixedList(extrinsics.configured.q_IR.coeffs(), 9));
  lines.add("final_extrinsics_translation" + suffix, fixedList(extrinsics.T_IR.l_I, 9));
  lines.add("final_extrinsics_translation_sigma" + suffix, fixedList(extrinsics.translationSigma(), 9));
  lines.add("final_extrinsics_rotation_xyzw" + suffix, fixedList(extrinsics.T_IR.q_IR.coeffs(), 9));
  lines.add("final_extrinsics_rotation_sigma" + suffix, fixedList(extrinsics.rotationSigma(), 9));
}

void addMeasured(SummaryLines& lines, const RadarSummary& radar) {
  const std::string suffix = suffixOf(radar.name);
  lines.beginMap("radar_noise" + suffix);  // standard deviations [m/s, rad, rad]
  lines.add("doppler", fixedText(std::sqrt(radar.knowledge.noise.doppler), 4));
  lines.add("azimuth", fixedText(std::sqrt(radar.knowledge.noise.azimuth), 4));
  lines.add("elevation", fixedText(std::sqrt(radar.knowledge.noise.elevation), 4));
  lines.endMap();
  lines.add("radar_doppler_step" + suffix, fixedText(radar.knowledge.doppler_step.value, 6));  // [m/s]
  lines.add("radar_doppler_step_from" + suffix, toString(radar.knowledge.doppler_step.source));
  lines.add("radar_doppler_span" + suffix, fixedText(radar.knowledge.doppler_span.value, 6));  // [m/s]
  lines.add("radar_doppler_span_from" + suffix, toString(radar.knowledge.doppler_span.source));
  lines.beginMap("radar_points_per_scan" + suffix);
  lines.add("p10", radar.points_per_scan[0]);
  lines.add("p50", radar.points_per_scan[1]);
  lines.add("p90", radar.points_per_scan[2]);
  lines.endMap();
}

void addBarometer(SummaryLines& lines, const BarometerCounts& barometer) {
  const auto used = static_cast<double>(barometer.used);
  lines.beginMap("barometer");
  lines.add("pressures", barometer.pressures);
  lines.add("means_used", barometer.used);
  lines.add("means_rejected", barometer.rejected);
  lines.add("steps", barometer.steps);
  lines.add("innovation_rms_m",
            fixedText(used > 0.0 ? std::sqrt(barometer.innovation_square / used) : 0.0, 6));
  lines.add("final_bias_m", fixedText(barometer.bias, 6));
  lines.add("final_bias_sigma_m", fixedText(barometer.bias_sigma, 6));
  lines.endMap();
}

void addGroundVehicle(SummaryLines& lines, const GroundVehicleCounts& vehicle) {
  lines.beginMap("ground_vehicle");
  lines.add("terms_used", vehicle.used);
  lines.add("terms_left_out", vehicle.left_out);
  lines.add("final_rotation_xyzw", fixedList(vehicle.rotation.coeffs(), 9));
  lines.add("final_rotation_sigma", fixedList(vehicle.rotation_sigma, 9));
  lines.add("contradicted", vehicle.contradicted_at.has_value());
  if (vehicle.contradicted_at) lines.add("contradicted_after_s", fixedText(*vehicle.contradicted_at, 3));
  lines.endMap();
}

void addLandmarks(SummaryLines& lines, const LandmarkCounts& landmarks) {
  lines.beginMap("landmarks");
  lines.add("scans", landmarks.scans);
  lines.add("scans_trusted", landmarks.scans_trusted);
  lines.add("most_in_map", landmarks.most_in_map);
  lines.endMap();
}

}  // namespace

std::string summaryText(const RunSummary& summary, const std::vector<std::string>& saved) {
  SummaryLines lines;
  lines.add("mode", summary.mode);
  lines.add("verdict", toString(summary.diagnosis.verdict));
  lines.addChecks(summary.diagnosis.checks);
  lines.addCauses(summary.diagnosis.causes);
  lines.add("imu_count", summary.imu_count);
  lines.add("scans_total", summary.scansTotal());
  lines.add("scans_used", summary.scansUsed());
  lines.add("scans_rejected", summary.scansRejected());
  for (const RadarSummary& radar : summary.radars) {
    if (radar.name.empty()) continue;  // the only one
    lines.add("scans_total_" + radar.name, radar.scans_total);
    lines.add("scans_used_" + radar.name, radar.scans_used);
    lines.add("scans_rejected_" + radar.name, radar.scans_rejected);
  }
  lines.add("input_faults", summary.input_faults);
  lines.add("solver_terminations", summary.solver_terminations);
  lines.add("initialized_from", toString(summary.initialized_from));
  lines.add("health_at_end", toString(summary.health));
  lines.add("divergences", summary.divergences);
  lines.add("reinitializations", summary.reinitializations);
  lines.add("scans_diverged", summary.scans_diverged);
  lines.add("path_length_m", fixedText(summary.path_length_m, 6));
  if (summary.imu_restarts.empty()) {
    lines.add("end_to_start_2d_m", fixedText(summary.end_to_start_2d_m, 6));
    lines.add("end_to_start_3d_m", fixedText(summary.end_to_start_3d_m, 6));
  }
  for (const RadarSummary& radar : summary.radars) addEstimates(lines, radar);
  lines.beginMap("imu_noise");
  lines.add("accel", fixedText(summary.imu_noise.accel_density, 6));
  lines.add("gyro", fixedText(summary.imu_noise.gyro_density, 6));
  lines.endMap();
  for (const RadarSummary& radar : summary.radars) addMeasured(lines, radar);
  for (const RadarSummary& radar : summary.radars) {
    if (radar.pass_offsets_s.empty()) continue;
    lines.add("pass_offsets_s" + suffixOf(radar.name), fixedList(radar.pass_offsets_s, 9));
  }
  if (summary.batch) {
    lines.add("batch_iterations", summary.batch->iterations);
    lines.add("batch_placements", summary.batch->placements);
    lines.add("batch_converged", summary.batch->converged);
  }
  if (summary.barometer) addBarometer(lines, *summary.barometer);
  if (summary.ground_vehicle) addGroundVehicle(lines, *summary.ground_vehicle);
  if (summary.landmarks) addLandmarks(lines, *summary.landmarks);
  if (summary.truth) {
    lines.add("ate_m", fixedText(summary.truth->ate_m, 9));
    if (summary.truth->t_rel) lines.add("t_rel", fixedText(*summary.truth->t_rel, 9));
    if (summary.truth->r_rel_deg) lines.add("r_rel_deg", fixedText(*summary.truth->r_rel_deg, 9));
  }
  lines.add("saved", saved);
  // All above is the same in every run; these are not.
  lines.add("estimation_seconds", fixedText(summary.estimation_seconds, 6));
  lines.add("realtime_factor", fixedText(summary.realtime_factor, 3));
  return lines.text();
}

std::uint64_t RunSummary::scansTotal() const {
  std::uint64_t total = 0;
  for (const RadarSummary& radar : radars) total += radar.scans_total;
  return total;
}

std::uint64_t RunSummary::scansUsed() const {
  std::uint64_t used = 0;
  for (const RadarSummary& radar : radars) used += radar.scans_used;
  return used;
}

Counts RunSummary::scansRejected() const {
  Counts rejected;
  for (const RadarSummary& radar : radars) {
    for (const auto& [reason, count] : radar.scans_rejected) rejected[reason] += count;
  }
  return rejected;
}

}  // namespace rio_t
