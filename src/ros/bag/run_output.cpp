#include "rio_t/ros/bag/run_output.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
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
#include "summary_text.h"

namespace rio_t {
namespace {

constexpr std::size_t kBufferSize = 1 << 18;
constexpr double kNavigationPeriod = 0.0999;  // [s] between lines of navigation.csv

void appendDigits(std::string* text, std::uint64_t value, int at_least) {
  std::array<char, 20> digits{};
  const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  const auto count = static_cast<int>(end - digits.data());
  if (count < at_least) text->append(static_cast<std::size_t>(at_least - count), '0');
  text->append(digits.data(), static_cast<std::size_t>(count));
}

void appendNumber(std::string* line, double x, int decimals) {
  line->push_back(',');
  appendFixed(line, x, decimals);
}

void appendVector(std::string* line, const Eigen::Vector3d& v, int decimals) {
  for (int i = 0; i < 3; ++i) appendNumber(line, v[i], decimals);
}

const char* const kNavigationHeader =
    "stamp,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_rx,sigma_ry,sigma_rz,sigma_vx,sigma_vy,sigma_vz\n";
const char* const kBiasesHeader = "stamp,bgx,bgy,bgz,bax,bay,baz\n";
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

std::string fixedText(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text.find_first_of("123456789in") == std::string::npos && text.front() == '-' ? text.substr(1)
                                                                                       : text;
}

void RunOutput::File::open(const std::string& path_in, const std::string& header) {
  path = path_in;
  stream.open(path, std::ios::binary | std::ios::trunc);
  if (!stream) {
    const std::string reason = std::error_code(errno, std::generic_category()).message();
    throw OutputError("output " + path + ": cannot be written (" + reason + ")");
  }
  buffer.reserve(kBufferSize + 1024);
  buffer = header;
}

void RunOutput::File::flush() {
  stream.write(buffer.data(), static_cast<std::streamsize>(buffer.size()));
  stream.flush();
  buffer.clear();
  if (!stream) throw OutputError("output " + path + ": writing failed (disk full?)");
}

void RunOutput::File::endLine() {
  buffer.push_back('\n');
  if (buffer.size() > kBufferSize) flush();
}

RunOutput::RunOutput(const std::string& folder, const RunFiles& files) : folder_(folder), files_(files) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!std::filesystem::is_directory(folder)) {
    throw OutputError("output folder " + folder + ": cannot be made (" +
                      (error ? error.message() : "a file of that name exists") + ")");
  }
  removeOfEarlierRuns();
  trajectory_.open(folder + "/trajectory.txt");
  optimized_.open(folder + "/trajectory_optimized.txt");
  navigation_.open(folder + "/navigation.csv", kNavigationHeader);
  biases_.open(folder + "/biases.csv", kBiasesHeader);
  if (files.map) map_.emplace().open(folder + "/map.csv", kMapHeader);
  if (files.barometer) barometer_.emplace().open(folder + "/barometer.csv", kBarometerHeader);
  if (files.ground_vehicle)
    ground_vehicle_.emplace().open(folder + "/ground_vehicle.csv", kGroundVehicleHeader);
  for (const std::string& name : files.radars) {
    const std::string end = suffixOf(name) + ".csv";
    RadarOutput& radar = radars_.emplace_back();
    radar.time_offset.open(folder + "/time_offset" + end, kTimeOffsetHeader);
    radar.ego_velocity.open(folder + "/ego_velocity" + end, kEgoVelocityHeader);
    if (files.extrinsics) radar.extrinsics.emplace().open(folder + "/extrinsics" + end, kExtrinsicsHeader);
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
  *line += formatTime(time);
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
  *line += formatTime(state.time);
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
  *line += formatTime(result.scan.stamp);
  appendVector(line, result.ego_velocity.v_R, 6);
  appendVector(line, result.ego_velocity.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), 6);
  *line += ',' + std::to_string(result.ego_velocity.inliers.size()) + ',' +
           std::to_string(result.ego_velocity.points.size()) + ',' +
           (result.used ? toString(result.ego_velocity.status) : result.rejected_because);
  radar.ego_velocity.endLine();
  if (!result.updated) return;

  line = &radar.time_offset.buffer;
  *line += formatTime(result.scan.stamp);
  appendNumber(line, result.time_offset, 9);
  appendNumber(line, result.time_offset_sigma, 9);
  radar.time_offset.endLine();
  if (radar.extrinsics) addExtrinsics(*radar.extrinsics, result);

  if (result.landmarks)
    for (const LandmarkPoint& point : result.landmarks->map) landmarks_[point.id] = point;

  line = &biases_.buffer;
  *line += formatTime(result.scan.stamp);
  appendVector(line, result.state.b_g, 9);
  appendVector(line, result.state.b_a, 9);
  biases_.endLine();
}

void RunOutput::addAids(const ScanResult& result) {
  for (const BarometerAnswer& mean : result.barometer) {
    std::string* line = &barometer_->buffer;
    *line += formatTime(mean.time);
    for (const double x : {mean.height, mean.innovation, mean.innovation_sigma, mean.bias, mean.bias_sigma})
      appendNumber(line, x, 6);
    *line += ',' + std::to_string(mean.samples) + ',' +
             (!mean.rejected_because.empty() ? mean.rejected_because
              : mean.stepped                 ? "stepped"
                                             : "used");
    barometer_->endLine();
  }
  if (!result.ground_vehicle) return;
  const GroundVehicleAnswer& vehicle = *result.ground_vehicle;
  std::string* line = &ground_vehicle_->buffer;
  *line += formatTime(vehicle.time);
  appendVector(line, vehicle.v_V, 6);
  appendNumber(line, std::sqrt(vehicle.squared_sigmas), 3);
  appendVector(line, vehicle.q_IV.vec(), 9);
  appendNumber(line, vehicle.q_IV.w(), 9);
  appendVector(line, vehicle.q_IV_sigma, 9);
  *line += vehicle.is_contradicted ? ",contradicted" : vehicle.used ? ",used" : ",left_out";
  ground_vehicle_->endLine();
}

void RunOutput::writeMap() {
  for (const auto& [id, point] : landmarks_) {
    std::string* line = &map_->buffer;
    *line += std::to_string(id);
    appendVector(line, point.p_W, 6);
    appendNumber(line, point.sigma, 6);
    appendNumber(line, point.snr_db, 3);
    *line += ',' + std::to_string(point.sightings);
    map_->endLine();
  }
  map_->flush();
}

void RunOutput::addExtrinsics(File& file, const ScanResult& result) {
  const Eigen::Quaterniond& q_IR = result.T_IR.q_IR;
  const Eigen::Matrix<double, 6, 1> sigmas = result.T_IR_covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  std::string* line = &file.buffer;
  *line += formatTime(result.scan.stamp);
  appendVector(line, result.T_IR.l_I, 9);
  appendVector(line, q_IR.vec(), 9);
  appendNumber(line, q_IR.w(), 9);
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
