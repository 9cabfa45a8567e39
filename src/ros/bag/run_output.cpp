#include "rio_t/ros/bag/run_output.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <filesystem>
#include <regex>
#include <stdexcept>
#include <system_error>

#include "../text.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/ros/messages/conversions.h"
#include "summary_text.h"

namespace rio_t {
namespace {

constexpr std::size_t kBufferSize = 1 << 18;
constexpr double kNavigationPeriod = 0.0999;  // [s] between lines of navigation.csv

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

std::vector<RunFile> RunFiles::all() const {
  std::vector<RunFile> files = {
      {"trajectory.txt", ""}, {"trajectory_optimized.txt", ""}, {"navigation.csv", kNavigationHeader}};
  for (const std::string& radar : radars) {
    const std::string end = suffixOf(radar) + ".csv";
    files.push_back({"time_offset" + end, kTimeOffsetHeader});
    files.push_back({"ego_velocity" + end, kEgoVelocityHeader});
    if (extrinsics) files.push_back({"extrinsics" + end, kExtrinsicsHeader});
  }
  if (barometer) files.push_back({"barometer.csv", kBarometerHeader});
  if (ground_vehicle) files.push_back({"ground_vehicle.csv", kGroundVehicleHeader});
  if (map) files.push_back({"map.csv", kMapHeader});
  files.push_back({"biases.csv", kBiasesHeader});
  return files;
}

std::vector<std::string> RunFiles::names() const {
  std::vector<std::string> names;
  for (const RunFile& file : all()) names.push_back(file.name);
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

void RunOutput::File::open(const std::string& path_in, const std::string& text) {
  path = path_in;
  stream.open(path, std::ios::binary | std::ios::trunc);
  if (!stream) {
    const std::string reason = std::error_code(errno, std::generic_category()).message();
    throw OutputError("output " + path + ": cannot be written (" + reason + ")");
  }
  buffer.reserve(kBufferSize + 1024);
  buffer = text;
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
  for (const RunFile& file : files.all()) open_[file.name].open(folder + "/" + file.name, file.header);
}

void RunOutput::removeOfEarlierRuns() const {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::remove(folder_ + "/summary.yaml", error);
  // Not every run writes these.
  static const std::regex optional("(time_offset|ego_velocity|extrinsics)_[a-z0-9_]+\\.csv|(.+)\\.csv");
  const std::vector<std::string> own = files_.names();
  const std::vector<RunFile> possible = RunFiles{{""}, true, true, true, true}.all();
  std::vector<fs::path> earlier;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_, error)) {
    const std::string name = entry.path().filename().string();
    std::smatch kind;
    if (name.size() > 255 || !std::regex_match(name, kind, optional) || !entry.is_regular_file(error))
      continue;
    if (std::find(own.begin(), own.end(), name) != own.end()) continue;
    const std::string stem = kind[1].str() + kind[2].str();
    const auto file = std::find_if(possible.begin(), possible.end(),
                                   [&](const RunFile& each) { return each.name == stem + ".csv"; });
    if (file == possible.end()) continue;
    // A user's own time_offset_truth.csv stays.
    if (isEmptyOrBeginsWith(entry.path(), file->header)) earlier.push_back(entry.path());
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
  addPose(file("trajectory.txt"), state.time, state.p_W, state.q_WI);
  // Also where time runs back (a bag that loops): a line, then ten a second again.
  if (last_navigation_ && std::abs(state.time - *last_navigation_) < kNavigationPeriod) return;
  last_navigation_ = state.time;
  const auto sigmas = [](const auto& variances) {
    return Eigen::Vector3d(variances.cwiseMax(0.0).cwiseSqrt());
  };
  const Covariance6 pose = bodyOdometry(state, 0.0).pose_covariance;
  File& navigation = file("navigation.csv");
  std::string* line = &navigation.buffer;
  *line += formatTime(state.time);
  appendVector(line, state.v_W, 6);
  appendVector(line, sigmas(pose.diagonal().head<3>()), 6);
  appendVector(line, sigmas(pose.diagonal().tail<3>()), 6);
  appendVector(line, sigmas(state.covariance.diagonal().segment<3>(StateBlock::kV)), 6);
  navigation.endLine();
}

void RunOutput::addResult(const ScanResult& result) {
  for (const StampedPose& pose : result.left_window)
    addPose(file("trajectory_optimized.txt"), pose.time, pose.p_W, pose.q_WI);
  addAids(result);
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses

  const std::string end = suffixOf(files_.radars.at(result.scan.radar)) + ".csv";
  File& ego_velocity = file("ego_velocity" + end);
  std::string* line = &ego_velocity.buffer;
  *line += formatTime(result.scan.stamp);
  appendVector(line, result.ego_velocity.v_R, 6);
  appendVector(line, result.ego_velocity.covariance.diagonal().cwiseMax(0.0).cwiseSqrt(), 6);
  *line += ',' + std::to_string(result.ego_velocity.inliers.size()) + ',' +
           std::to_string(result.ego_velocity.points.size()) + ',' +
           (result.used ? toString(result.ego_velocity.status) : result.rejected_because);
  ego_velocity.endLine();
  if (!result.updated) return;

  File& time_offset = file("time_offset" + end);
  line = &time_offset.buffer;
  *line += formatTime(result.scan.stamp);
  appendNumber(line, result.time_offset, 9);
  appendNumber(line, result.time_offset_sigma, 9);
  time_offset.endLine();
  if (files_.extrinsics) addExtrinsics(file("extrinsics" + end), result);

  if (result.landmarks)
    for (const LandmarkPoint& point : result.landmarks->map) landmarks_[point.id] = point;

  File& biases = file("biases.csv");
  line = &biases.buffer;
  *line += formatTime(result.scan.stamp);
  appendVector(line, result.state.b_g, 9);
  appendVector(line, result.state.b_a, 9);
  biases.endLine();
}

void RunOutput::addAids(const ScanResult& result) {
  for (const BarometerAnswer& mean : result.barometer) {
    File& barometer = file("barometer.csv");
    std::string* line = &barometer.buffer;
    *line += formatTime(mean.time);
    for (const double x : {mean.height, mean.innovation, mean.innovation_sigma, mean.bias, mean.bias_sigma})
      appendNumber(line, x, 6);
    *line += ',' + std::to_string(mean.samples) + ',' +
             (!mean.rejected_because.empty() ? mean.rejected_because
              : mean.stepped                 ? "stepped"
                                             : "used");
    barometer.endLine();
  }
  if (!result.ground_vehicle) return;
  const GroundVehicleAnswer& vehicle = *result.ground_vehicle;
  File& ground_vehicle = file("ground_vehicle.csv");
  std::string* line = &ground_vehicle.buffer;
  *line += formatTime(vehicle.time);
  appendVector(line, vehicle.v_V, 6);
  appendNumber(line, std::sqrt(vehicle.squared_sigmas), 3);
  appendVector(line, vehicle.q_IV.vec(), 9);
  appendNumber(line, vehicle.q_IV.w(), 9);
  appendVector(line, vehicle.q_IV_sigma, 9);
  *line += vehicle.is_contradicted ? ",contradicted" : vehicle.used ? ",used" : ",left_out";
  ground_vehicle.endLine();
}

void RunOutput::addMap(File& file) {
  for (const auto& [id, point] : landmarks_) {
    std::string* line = &file.buffer;
    *line += std::to_string(id);
    appendVector(line, point.p_W, 6);
    appendNumber(line, point.sigma, 6);
    appendNumber(line, point.snr_db, 3);
    *line += ',' + std::to_string(point.sightings);
    file.endLine();
  }
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
  if (files_.map) addMap(file("map.csv"));
  for (auto& [name, file] : open_) file.flush();
  File yaml;
  yaml.open(folder_ + "/summary.yaml", summaryText(summary, files_.names()));
  yaml.flush();
}

}  // namespace rio_t
