#include "rio_t/ros/bag/run_output.h"

#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "rio_t/factors/state_block.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

constexpr std::size_t kBufferSize = 1 << 18;
constexpr double kNavigationPeriod = 0.0999;  // [s] between lines of navigation.csv

void appendDigits(std::string* text, std::uint64_t value, int at_least) {
  char digits[24];
  int count = 0;
  do {
    digits[count++] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0 || count < at_least);
  while (count > 0) text->push_back(digits[--count]);
}

void appendVector(std::string* line, const Eigen::Vector3d& v, int decimals) {
  for (int i = 0; i < 3; ++i) {
    line->push_back(',');
    appendFixed(line, v[i], decimals);
  }
}

std::string fixedText(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text;
}

std::vector<std::string> fixedTexts(const std::vector<double>& values, int decimals) {
  std::vector<std::string> texts;
  texts.reserve(values.size());
  for (const double value : values) texts.push_back(fixedText(value, decimals));
  return texts;
}

std::string summaryText(const RunSummary& summary) {
  YAML::Emitter yaml;
  const auto line = [&](const char* key, const auto& value) {
    yaml << YAML::Key << key << YAML::Value << YAML::Flow << value;
  };
  yaml << YAML::BeginMap;
  line("mode", summary.mode);
  line("imu_count", summary.imu_count);
  line("scans_total", summary.scans_total);
  line("scans_used", summary.scans_used);
  line("scans_rejected", summary.scans_rejected);
  line("input_faults", summary.input_faults);
  line("solver_terminations", summary.solver_terminations);
  line("initialized_from", summary.initialized_from.empty() ? "none" : summary.initialized_from);
  line("health_at_end", summary.health_at_end);
  line("divergences", summary.divergences);
  line("reinitializations", summary.reinitializations);
  line("path_length_m", fixedText(summary.path_length_m, 6));
  line("end_to_start_2d_m", fixedText(summary.end_to_start_2d_m, 6));
  line("end_to_start_3d_m", fixedText(summary.end_to_start_3d_m, 6));
  line("final_offset_s", fixedText(summary.final_offset_s, 9));
  line("final_offset_sigma_s", fixedText(summary.final_offset_sigma_s, 9));
  line("imu_noise", YAML::BeginMap);
  line("accel", fixedText(summary.imu_noise.accel_density, 6));
  line("gyro", fixedText(summary.imu_noise.gyro_density, 6));
  yaml << YAML::EndMap;
  line("radar_noise", YAML::BeginMap);  // standard deviations [m/s, rad, rad]
  line("doppler", fixedText(std::sqrt(summary.radar_noise.doppler), 4));
  line("azimuth", fixedText(std::sqrt(summary.radar_noise.azimuth), 4));
  line("elevation", fixedText(std::sqrt(summary.radar_noise.elevation), 4));
  yaml << YAML::EndMap;
  line("radar_doppler_step", fixedText(summary.radar_doppler_step.value, 6));  // [m/s]
  line("radar_doppler_step_from", toString(summary.radar_doppler_step.source));
  line("radar_points_per_scan", YAML::BeginMap);
  line("p10", summary.radar_points_per_scan[0]);
  line("p50", summary.radar_points_per_scan[1]);
  line("p90", summary.radar_points_per_scan[2]);
  yaml << YAML::EndMap;
  if (!summary.pass_offsets_s.empty()) {
    line("pass_offsets_s", fixedTexts(summary.pass_offsets_s, 9));
    line("pass_offset_sigmas_s", fixedTexts(summary.pass_offset_sigmas_s, 9));
  }
  if (summary.batch) {
    line("batch_iterations", summary.batch->iterations);
    line("batch_placements", summary.batch->placements);
    line("batch_converged", summary.batch->converged);
    line("scans_readmitted", summary.batch->scans_readmitted);
  }
  if (summary.truth) {
    line("ate_m", fixedText(summary.truth->ate_m, 9));
    if (summary.truth->t_rel) line("t_rel", fixedText(*summary.truth->t_rel, 9));
    if (summary.truth->r_rel_deg) line("r_rel_deg", fixedText(*summary.truth->r_rel_deg, 9));
  }
  line("saved", RunOutput::fileNames());
  // All above is the same in every run; these are not.
  line("estimation_seconds", fixedText(summary.estimation_seconds, 6));
  line("realtime_factor", fixedText(summary.realtime_factor, 3));
  yaml << YAML::EndMap;
  return std::string(yaml.c_str()) + "\n";
}

}  // namespace

void appendFixed(std::string* text, double value, int decimals) {
  if (!std::isfinite(value)) {
    *text += std::isnan(value) ? ".nan" : value > 0.0 ? ".inf" : "-.inf";
    return;
  }
  double scale = 1.0;
  for (int i = 0; i < decimals; ++i) scale *= 10.0;
  const double scaled = std::round(std::abs(value) * scale);
  if (scaled > 9e18) {  // beyond 64 bits
    std::ostringstream stream;
    stream.imbue(std::locale::classic());
    stream.precision(decimals);
    stream << std::fixed << value;
    *text += stream.str();
    return;
  }
  const auto whole = static_cast<std::uint64_t>(scaled);
  const auto divisor = static_cast<std::uint64_t>(scale);
  if (value < 0.0 && whole != 0) text->push_back('-');
  appendDigits(text, whole / divisor, 1);
  if (decimals == 0) return;
  text->push_back('.');
  appendDigits(text, whole % divisor, decimals);
}

void appendStamp(std::string* text, Time time) {
  const std::int64_t ns = time.nanoseconds();
  if (ns < 0) text->push_back('-');
  const auto size = static_cast<std::uint64_t>(ns < 0 ? -ns : ns);
  appendDigits(text, size / 1000000000, 1);
  text->push_back('.');
  appendDigits(text, size % 1000000000, 9);
}

void RunOutput::File::open(const std::string& path_in) {
  path = path_in;
  stream.open(path, std::ios::binary | std::ios::trunc);
  if (!stream) {
    const std::string reason = std::error_code(errno, std::generic_category()).message();
    throw std::runtime_error("output " + path + ": cannot be written (" + reason + ")");
  }
  buffer.reserve(kBufferSize + 1024);
}

void RunOutput::File::flush() {
  stream.write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
  stream.flush();
  buffer.clear();
  if (!stream) throw std::runtime_error("output " + path + ": writing failed (disk full?)");
}

void RunOutput::File::endLine() {
  buffer.push_back('\n');
  if (buffer.size() > kBufferSize) flush();
}

std::vector<std::string> RunOutput::fileNames() {
  return {"trajectory.txt",  "trajectory_optimized.txt", "navigation.csv",
          "time_offset.csv", "ego_velocity.csv",         "biases.csv",
          "summary.yaml"};
}

RunOutput::RunOutput(const std::string& folder) : folder_(folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw std::runtime_error("output folder " + folder + ": cannot be made (" +
                             (error ? error.message() : "a file of that name exists") + ")");
  }
  std::filesystem::remove(folder + "/summary.yaml", error);
  trajectory_.open(folder + "/trajectory.txt");
  optimized_.open(folder + "/trajectory_optimized.txt");
  navigation_.open(folder + "/navigation.csv");
  time_offset_.open(folder + "/time_offset.csv");
  ego_velocity_.open(folder + "/ego_velocity.csv");
  biases_.open(folder + "/biases.csv");
  navigation_.buffer =
      "stamp,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_rx,sigma_ry,sigma_rz,sigma_vx,sigma_vy,sigma_vz\n";
  time_offset_.buffer = "stamp,offset_s,sigma_s\n";
  ego_velocity_.buffer = "stamp,vx,vy,vz,sigma_x,sigma_y,sigma_z,inliers,points,status\n";
  biases_.buffer = "stamp,bgx,bgy,bgz,bax,bay,baz\n";
}

void RunOutput::addPose(File& file, Time time, const Eigen::Vector3d& p_W, const Eigen::Quaterniond& q_WI) {
  std::string* line = &file.buffer;
  appendStamp(line, time);
  for (const double x : {p_W.x(), p_W.y(), p_W.z(), q_WI.x(), q_WI.y(), q_WI.z(), q_WI.w()}) {
    line->push_back(' ');
    appendFixed(line, x, 9);
  }
  file.endLine();
}

void RunOutput::addState(const NavigationState& state) {
  addPose(trajectory_, state.time, state.p_W, state.q_WI);
  // Also where time runs back (a bag that loops): a line, then ten a second again.
  if (last_navigation_ && std::abs(state.time - *last_navigation_) < kNavigationPeriod) return;
  last_navigation_ = state.time;
  const auto sigmas = [](const auto& variances) {
    return Eigen::Vector3d(variances.cwiseMax(0.0).cwiseSqrt());
  };
  const Covariance6 pose = poseCovariance(state);
  std::string* line = &navigation_.buffer;
  appendStamp(line, state.time);
  appendVector(line, state.v_W, 6);
  appendVector(line, sigmas(pose.diagonal().head<3>()), 6);
  appendVector(line, sigmas(pose.diagonal().tail<3>()), 6);
  appendVector(line, sigmas(state.covariance.diagonal().segment<3>(StateBlock::kV)), 6);
  navigation_.endLine();
}

void RunOutput::addResult(const ScanResult& result) {
  for (const StampedPose& pose : result.left_window) addPose(optimized_, pose.time, pose.p_W, pose.q_WI);
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses

  std::string* line = &ego_velocity_.buffer;
  appendStamp(line, result.scan.stamp);
  appendVector(line, result.ego_velocity.v_R, 6);
  appendVector(line, result.ego_velocity.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), 6);
  *line += ',' + std::to_string(result.ego_velocity.inliers.size()) + ',' +
           std::to_string(result.ego_velocity.points.size()) + ',' +
           (result.used ? toString(result.ego_velocity.status) : result.rejected_because);
  ego_velocity_.endLine();
  if (!result.updated) return;

  line = &time_offset_.buffer;
  appendStamp(line, result.scan.stamp);
  line->push_back(',');
  appendFixed(line, result.time_offset, 9);
  line->push_back(',');
  appendFixed(line, result.time_offset_sigma, 9);
  time_offset_.endLine();

  line = &biases_.buffer;
  appendStamp(line, result.scan.stamp);
  appendVector(line, result.state.b_g, 9);
  appendVector(line, result.state.b_a, 9);
  biases_.endLine();
}

void RunOutput::finish(const RunSummary& summary) {
  for (File* file : {&trajectory_, &optimized_, &navigation_, &time_offset_, &ego_velocity_, &biases_})
    file->flush();
  File yaml;
  yaml.open(folder_ + "/summary.yaml");
  yaml.buffer = summaryText(summary);
  yaml.flush();
}

}  // namespace rio_t
