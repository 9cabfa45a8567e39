#include "rio_t/ros/bag/run_output.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <locale>
#include <regex>
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

std::vector<std::string> fixedTexts(const Eigen::Vector3d& v, int decimals) {
  return fixedTexts(std::vector<double>{v.x(), v.y(), v.z()}, decimals);
}

std::vector<std::string> fixedTexts(const Eigen::Quaterniond& q, int decimals) {
  return fixedTexts(std::vector<double>{q.x(), q.y(), q.z(), q.w()}, decimals);
}

/// "_left"; empty if there is but one radar.
std::string suffixOf(const std::string& radar) { return radar.empty() ? "" : "_" + radar; }

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
      yaml_ << YAML::Key << (check.at_least ? "at_least" : "at_most") << YAML::Value << fixedText(check.limit, 4);
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
  if (!radar.extrinsics) return;
  const ExtrinsicsSummary& extrinsics = *radar.extrinsics;
  lines.add("told_extrinsics_translation" + suffix, fixedTexts(extrinsics.told.l_I, 9));
  lines.add("told_extrinsics_rotation_xyzw" + suffix, fixedTexts(extrinsics.told.q_IR, 9));
  lines.add("final_extrinsics_translation" + suffix, fixedTexts(extrinsics.T_IR.l_I, 9));
  lines.add("final_extrinsics_translation_sigma" + suffix, fixedTexts(extrinsics.translation_sigma, 9));
  lines.add("final_extrinsics_rotation_xyzw" + suffix, fixedTexts(extrinsics.T_IR.q_IR, 9));
  lines.add("final_extrinsics_rotation_sigma" + suffix, fixedTexts(extrinsics.rotation_sigma, 9));
}

void addMeasured(SummaryLines& lines, const RadarSummary& radar) {
  const std::string suffix = suffixOf(radar.name);
  lines.beginMap("radar_noise" + suffix);  // standard deviations [m/s, rad, rad]
  lines.add("doppler", fixedText(std::sqrt(radar.noise.doppler), 4));
  lines.add("azimuth", fixedText(std::sqrt(radar.noise.azimuth), 4));
  lines.add("elevation", fixedText(std::sqrt(radar.noise.elevation), 4));
  lines.endMap();
  lines.add("radar_doppler_step" + suffix, fixedText(radar.doppler_step.value, 6));  // [m/s]
  lines.add("radar_doppler_step_from" + suffix, toString(radar.doppler_step.source));
  lines.beginMap("radar_points_per_scan" + suffix);
  lines.add("p10", radar.points_per_scan[0]);
  lines.add("p50", radar.points_per_scan[1]);
  lines.add("p90", radar.points_per_scan[2]);
  lines.endMap();
}

void addBarometer(SummaryLines& lines, const BarometerSummary& barometer) {
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

void addGroundVehicle(SummaryLines& lines, const GroundVehicleSummary& vehicle) {
  lines.beginMap("ground_vehicle");
  lines.add("terms_used", vehicle.used);
  lines.add("terms_left_out", vehicle.left_out);
  lines.add("final_rotation_xyzw", fixedTexts(vehicle.rotation, 9));
  lines.add("final_rotation_sigma", fixedTexts(vehicle.rotation_sigma, 9));
  lines.add("contradicted", vehicle.contradicted_at.has_value());
  if (vehicle.contradicted_at) lines.add("contradicted_after_s", fixedText(*vehicle.contradicted_at, 3));
  lines.endMap();
}

std::string summaryText(const RunSummary& summary, const std::vector<std::string>& saved) {
  SummaryLines lines;
  const auto line = [&](const char* key, const auto& value) { lines.add(key, value); };
  line("mode", summary.mode);
  line("verdict", toString(summary.diagnosis.verdict));
  lines.addChecks(summary.diagnosis.checks);
  lines.addCauses(summary.diagnosis.causes);
  line("imu_count", summary.imu_count);
  line("scans_total", summary.scansTotal());
  line("scans_used", summary.scansUsed());
  line("scans_rejected", summary.scansRejected());
  for (const RadarSummary& radar : summary.radars) {
    if (radar.name.empty()) continue;  // the only one
    lines.add("scans_total_" + radar.name, radar.scans_total);
    lines.add("scans_used_" + radar.name, radar.scans_used);
    lines.add("scans_rejected_" + radar.name, radar.scans_rejected);
  }
  line("input_faults", summary.input_faults);
  line("solver_terminations", summary.solver_terminations);
  line("initialized_from", summary.initialized_from.empty() ? "none" : summary.initialized_from);
  line("health_at_end", summary.health_at_end);
  line("divergences", summary.divergences);
  line("reinitializations", summary.reinitializations);
  line("scans_diverged", summary.scans_diverged);
  line("path_length_m", fixedText(summary.path_length_m, 6));
  line("end_to_start_2d_m", fixedText(summary.end_to_start_2d_m, 6));
  line("end_to_start_3d_m", fixedText(summary.end_to_start_3d_m, 6));
  for (const RadarSummary& radar : summary.radars) addEstimates(lines, radar);
  lines.beginMap("imu_noise");
  line("accel", fixedText(summary.imu_noise.accel_density, 6));
  line("gyro", fixedText(summary.imu_noise.gyro_density, 6));
  lines.endMap();
  for (const RadarSummary& radar : summary.radars) addMeasured(lines, radar);
  for (const RadarSummary& radar : summary.radars) {
    if (radar.pass_offsets_s.empty()) continue;
    lines.add("pass_offsets_s" + suffixOf(radar.name), fixedTexts(radar.pass_offsets_s, 9));
    lines.add("pass_offset_sigmas_s" + suffixOf(radar.name), fixedTexts(radar.pass_offset_sigmas_s, 9));
  }
  if (summary.batch) {
    line("batch_iterations", summary.batch->iterations);
    line("batch_placements", summary.batch->placements);
    line("batch_converged", summary.batch->converged);
    line("scans_readmitted", summary.batch->scans_readmitted);
  }
  if (summary.barometer) addBarometer(lines, *summary.barometer);
  if (summary.ground_vehicle) addGroundVehicle(lines, *summary.ground_vehicle);
  if (summary.truth) {
    line("ate_m", fixedText(summary.truth->ate_m, 9));
    if (summary.truth->t_rel) line("t_rel", fixedText(*summary.truth->t_rel, 9));
    if (summary.truth->r_rel_deg) line("r_rel_deg", fixedText(*summary.truth->r_rel_deg, 9));
  }
  line("saved", saved);
  // All above is the same in every run; these are not.
  line("estimation_seconds", fixedText(summary.estimation_seconds, 6));
  line("realtime_factor", fixedText(summary.realtime_factor, 3));
  return lines.text();
}

const char* const kTimeOffsetHeader = "stamp,offset_s,sigma_s\n";
const char* const kEgoVelocityHeader = "stamp,vx,vy,vz,sigma_x,sigma_y,sigma_z,inliers,points,status\n";
const char* const kBarometerHeader =
    "stamp,height,innovation,innovation_sigma,bias,bias_sigma,samples,status\n";
const char* const kGroundVehicleHeader =
    "stamp,vx,vy,vz,sigmas,qx,qy,qz,qw,sigma_rx,sigma_ry,sigma_rz,status\n";
const char* const kMapHeader = "id,x,y,z,sigma,snr_db,sightings\n";
const char* const kExtrinsicsHeader =
    "stamp,x,y,z,qx,qy,qz,qw,sigma_x,sigma_y,sigma_z,sigma_rx,sigma_ry,sigma_rz\n";

/// Whether a run wrote it, or began to.
bool isEmptyOrBeginsWith(const std::filesystem::path& path, const std::string& header) {
  std::string start(header.size(), '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  return file.gcount() == 0 || start == header;
}

}  // namespace

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

std::map<std::string, std::uint64_t> RunSummary::scansRejected() const {
  std::map<std::string, std::uint64_t> rejected;
  for (const RadarSummary& radar : radars) {
    for (const auto& [reason, count] : radar.scans_rejected) rejected[reason] += count;
  }
  return rejected;
}

std::string contradictionText(const GroundVehicleSummary& vehicle) {
  return "platform: ground_vehicle: after " + fixedText(vehicle.contradicted_at.value_or(0.0), 1) +
         " s the motion contradicted it, and the constraint was switched off: the platform moves sideways or "
         "upwards. Is it a ground vehicle, and does vehicle_frame_rotation_xyzw say which way it drives?";
}

std::vector<std::string> RunFiles::names() const {
  std::vector<std::string> names = {"trajectory.txt", "trajectory_optimized.txt", "navigation.csv"};
  for (const std::string& radar : radars) {
    names.push_back("time_offset" + suffixOf(radar) + ".csv");
    names.push_back("ego_velocity" + suffixOf(radar) + ".csv");
    if (extrinsics) names.push_back("extrinsics" + suffixOf(radar) + ".csv");
  }
  if (barometer) names.emplace_back("barometer.csv");
  if (ground_vehicle) names.emplace_back("ground_vehicle.csv");
  if (map) names.emplace_back("map.csv");
  names.emplace_back("biases.csv");
  names.emplace_back("summary.yaml");
  return names;
}

RunFiles runFiles(const Config& config) {
  RunFiles files;
  files.barometer = config.odometry.use_barometer;
  files.ground_vehicle = config.odometry.platform == Platform::kGroundVehicle;
  files.extrinsics = config.odometry.smoother.estimate_extrinsics != EstimateExtrinsics::kNone;
  files.map = config.odometry.landmarks.enabled && config.mode != RunMode::kBatch;
  if (config.radars.size() < 2) return files;
  files.radars.clear();
  for (const Config& radar : config.radars) files.radars.push_back(radar.radar_name);
  return files;
}

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

RunOutput::RunOutput(const std::string& folder, const RunFiles& files) : folder_(folder), files_(files) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw std::runtime_error("output folder " + folder + ": cannot be made (" +
                             (error ? error.message() : "a file of that name exists") + ")");
  }
  removeOfEarlierRuns();
  trajectory_.open(folder + "/trajectory.txt");
  optimized_.open(folder + "/trajectory_optimized.txt");
  navigation_.open(folder + "/navigation.csv");
  biases_.open(folder + "/biases.csv");
  if (files.map) map_.emplace().open(folder + "/map.csv");
  navigation_.buffer =
      "stamp,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_rx,sigma_ry,sigma_rz,sigma_vx,sigma_vy,sigma_vz\n";
  biases_.buffer = "stamp,bgx,bgy,bgz,bax,bay,baz\n";
  if (files.barometer) {
    barometer_.emplace().open(folder + "/barometer.csv");
    barometer_->buffer = kBarometerHeader;
  }
  if (files.ground_vehicle) {
    ground_vehicle_.emplace().open(folder + "/ground_vehicle.csv");
    ground_vehicle_->buffer = kGroundVehicleHeader;
  }
  for (const std::string& name : files.radars) {
    RadarOutput& radar = radars_.emplace_back();
    radar.time_offset.open(folder + "/time_offset" + suffixOf(name) + ".csv");
    radar.ego_velocity.open(folder + "/ego_velocity" + suffixOf(name) + ".csv");
    radar.time_offset.buffer = kTimeOffsetHeader;
    radar.ego_velocity.buffer = kEgoVelocityHeader;
    if (!files.extrinsics) continue;
    radar.extrinsics.emplace().open(folder + "/extrinsics" + suffixOf(name) + ".csv");
    radar.extrinsics->buffer = kExtrinsicsHeader;
  }
}

void RunOutput::removeOfEarlierRuns() const {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::remove(folder_ + "/summary.yaml", error);
  static const std::regex of_radar(
      "(time_offset|ego_velocity|extrinsics)(_[a-z0-9_]+)?\\.csv|(barometer|ground_vehicle|map)\\.csv");
  const std::vector<std::string> own = files_.names();
  std::vector<fs::path> earlier;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    std::smatch kind;
    if (name.size() > 255 || !std::regex_match(name, kind, of_radar) || !entry.is_regular_file(error))
      continue;
    if (std::find(own.begin(), own.end(), name) != own.end()) continue;
    const char* const header = kind[1] == "time_offset"       ? kTimeOffsetHeader
                               : kind[1] == "ego_velocity"    ? kEgoVelocityHeader
                               : name == "barometer.csv"      ? kBarometerHeader
                               : name == "map.csv"            ? kMapHeader
                               : name == "ground_vehicle.csv" ? kGroundVehicleHeader
                                                              : kExtrinsicsHeader;
    // A user's own time_offset_truth.csv stays.
    if (isEmptyOrBeginsWith(entry.path(), header)) earlier.push_back(entry.path());
  }
  for (const fs::path& path : earlier) fs::remove(path, error);
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
  const Covariance6 pose = bodyOdometry(state, 0.0).pose_covariance;
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
  addAids(result);
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses

  RadarOutput& radar = radars_.at(result.scan.radar);
  std::string* line = &radar.ego_velocity.buffer;
  appendStamp(line, result.scan.stamp);
  appendVector(line, result.ego_velocity.v_R, 6);
  appendVector(line, result.ego_velocity.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), 6);
  *line += ',' + std::to_string(result.ego_velocity.inliers.size()) + ',' +
           std::to_string(result.ego_velocity.points.size()) + ',' +
           (result.used ? toString(result.ego_velocity.status) : result.rejected_because);
  radar.ego_velocity.endLine();
  if (!result.updated) return;

  line = &radar.time_offset.buffer;
  appendStamp(line, result.scan.stamp);
  line->push_back(',');
  appendFixed(line, result.time_offset, 9);
  line->push_back(',');
  appendFixed(line, result.time_offset_sigma, 9);
  radar.time_offset.endLine();
  if (radar.extrinsics) addExtrinsics(*radar.extrinsics, result);

  if (result.landmarks)
    for (const LandmarkPoint& point : result.landmarks->map) landmarks_[point.id] = point;

  line = &biases_.buffer;
  appendStamp(line, result.scan.stamp);
  appendVector(line, result.state.b_g, 9);
  appendVector(line, result.state.b_a, 9);
  biases_.endLine();
}

void RunOutput::addAids(const ScanResult& result) {
  for (const BarometerAnswer& mean : result.barometer) {
    std::string* line = &barometer_->buffer;
    appendStamp(line, mean.time);
    for (const double x : {mean.height, mean.innovation, mean.innovation_sigma, mean.bias, mean.bias_sigma}) {
      line->push_back(',');
      appendFixed(line, x, 6);
    }
    *line += ',' + std::to_string(mean.samples) + ',' +
             (!mean.rejected_because.empty() ? mean.rejected_because
              : mean.stepped                 ? "stepped"
                                             : "used");
    barometer_->endLine();
  }
  if (!result.ground_vehicle) return;
  const GroundVehicleAnswer& vehicle = *result.ground_vehicle;
  std::string* line = &ground_vehicle_->buffer;
  appendStamp(line, vehicle.time);
  appendVector(line, vehicle.v_V, 6);
  line->push_back(',');
  appendFixed(line, std::sqrt(vehicle.squared_sigmas), 3);
  appendVector(line, vehicle.q_IV.vec(), 9);
  line->push_back(',');
  appendFixed(line, vehicle.q_IV.w(), 9);
  appendVector(line, vehicle.q_IV_sigma, 9);
  *line += vehicle.is_contradicted ? ",contradicted" : vehicle.used ? ",used" : ",left_out";
  ground_vehicle_->endLine();
}

void RunOutput::writeMap() {
  map_->buffer = kMapHeader;
  for (const auto& [id, point] : landmarks_) {
    std::string* line = &map_->buffer;
    *line += std::to_string(id);
    appendVector(line, point.p_W, 6);
    line->push_back(',');
    appendFixed(line, point.sigma, 6);
    line->push_back(',');
    appendFixed(line, point.snr_db, 3);
    *line += ',' + std::to_string(point.sightings);
    map_->endLine();
  }
  map_->flush();
}

void RunOutput::addExtrinsics(File& file, const ScanResult& result) {
  const Eigen::Quaterniond& q_IR = result.T_IR.q_IR;
  const Eigen::Matrix<double, 6, 1> sigmas = result.T_IR_covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  std::string* line = &file.buffer;
  appendStamp(line, result.scan.stamp);
  appendVector(line, result.T_IR.l_I, 9);
  appendVector(line, q_IR.vec(), 9);
  line->push_back(',');
  appendFixed(line, q_IR.w(), 9);
  appendVector(line, sigmas.head<3>(), 9);
  appendVector(line, sigmas.tail<3>(), 9);
  file.endLine();
}

void RunOutput::finish(const RunSummary& summary) {
  for (File* file : {&trajectory_, &optimized_, &navigation_, &biases_}) file->flush();
  if (barometer_) barometer_->flush();
  if (ground_vehicle_) ground_vehicle_->flush();
  for (RadarOutput& radar : radars_) {
    radar.time_offset.flush();
    radar.ego_velocity.flush();
    if (radar.extrinsics) radar.extrinsics->flush();
  }
  if (map_) writeMap();
  File yaml;
  yaml.open(folder_ + "/summary.yaml");
  yaml.buffer = summaryText(summary, files_.names());
  yaml.flush();
}

}  // namespace rio_t
