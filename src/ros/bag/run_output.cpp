#include "rio_t/ros/bag/run_output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <cerrno>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "../text.h"
#include "rio_t/core/format.h"
#include "rio_t/core/sigmas.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

constexpr std::size_t kBufferSize = 1 << 18;
constexpr double kNavigationPeriod = 0.0999;  // [s] between lines of navigation.csv

/// Returns the files of the run before, as its summary names them.
std::vector<std::string> savedBefore(const std::string& folder) {
  try {
    return YAML::LoadFile(folder + "/summary.yaml")["saved"].as<std::vector<std::string>>();
  } catch (const YAML::Exception&) {  // no summary, or not one of ours
    return {};
  }
}

/// Says what became of a scan. If its points agree on no velocity, each point may still count.
std::string statusOf(const ScanResult& result) {
  if (!result.used) return result.rejected_because;
  const EgoVelocityStatus status = result.ego_velocity.status;
  return isValid(status) ? toString(status) : "points_only";
}

}  // namespace

std::vector<RunFile> RunFiles::all() const {
  std::vector<RunFile> files = {
      {"trajectory.txt", ""},
      {"trajectory_optimized.txt", ""},
      {"navigation.csv",
       "stamp,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_rx,sigma_ry,sigma_rz,sigma_vx,sigma_vy,sigma_vz\n"}};
  for (const std::string& radar : radars) {
    const std::string end = suffixOf(radar) + ".csv";
    files.push_back({"time_offset" + end, "stamp,offset_s,sigma_s\n"});
    files.push_back({"ego_velocity" + end, "stamp,vx,vy,vz,sigma_x,sigma_y,sigma_z,inliers,points,status\n"});
    if (extrinsics)
      files.push_back({"extrinsics" + end,
                       "stamp,x,y,z,qx,qy,qz,qw,sigma_x,sigma_y,sigma_z,sigma_rx,sigma_ry,sigma_rz\n"});
  }
  if (barometer)
    files.push_back(
        {"barometer.csv", "stamp,height,innovation,innovation_sigma,bias,bias_sigma,samples,status\n"});
  if (ground_vehicle)
    files.push_back(
        {"ground_vehicle.csv", "stamp,vx,vy,vz,sigmas,qx,qy,qz,qw,sigma_rx,sigma_ry,sigma_rz,status\n"});
  if (map) files.push_back({"map.csv", "id,x,y,z,sigma,snr_db,sightings\n"});
  files.push_back({"biases.csv", "stamp,bgx,bgy,bgz,bax,bay,baz\n"});
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

RunOutput::File& RunOutput::File::add(std::initializer_list<double> values, int decimals) {
  for (const double x : values) {
    buffer.push_back(',');
    appendFixed(&buffer, x, decimals);
  }
  return *this;
}

RunOutput::File& RunOutput::File::add(const Eigen::Vector3d& v, int decimals) {
  return add({v.x(), v.y(), v.z()}, decimals);
}

RunOutput::File& RunOutput::File::add(const Eigen::Quaterniond& q, int decimals) {
  return add({q.x(), q.y(), q.z(), q.w()}, decimals);
}

RunOutput::File& RunOutput::File::add(const std::string& text) {
  buffer += ',' + text;
  return *this;
}

void RunOutput::File::endLine() {
  buffer.push_back('\n');
  flushIfFull();
}

void RunOutput::File::flushIfFull() {
  if (buffer.size() > kBufferSize) flush();
}

FolderLock::FolderLock(const std::string& folder) : descriptor_(open(folder.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(descriptor_);
  throw OutputError("output folder " + folder + ": another run writes there; expected a folder of its own");
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

RunOutput::RunOutput(const std::string& folder, const RunFiles& files) : folder_(folder), files_(files) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  std::error_code unknown;  // for a name that is too long
  if (!std::filesystem::is_directory(folder, unknown)) {
    throw OutputError("output folder " + folder + ": cannot be made (" +
                      (error ? error.message() : "a file of that name exists") + ")");
  }
  lock_.emplace(folder);
  for (const std::string& name : savedBefore(folder))
    std::filesystem::remove(std::filesystem::path(folder) / std::filesystem::path(name).filename(), error);
  std::filesystem::remove(folder + "/summary.yaml", error);
  for (const RunFile& file : files.all()) open_[file.name].open(folder + "/" + file.name, file.header);
}

RunOutput::~RunOutput() {
  for (auto& [name, file] : open_) {
    try {
      file.flush();
    } catch (const std::exception&) {  // the run has failed already, and its message says why
    }
  }
}

RunOutput::File& RunOutput::row(std::string_view name, Time stamp) {
  File& table = file(name);
  table.buffer += formatTime(stamp);
  return table;
}

void RunOutput::addPose(std::string_view name, const StampedPose& pose) {
  File& trajectory = file(name);
  appendTumLine(&trajectory.buffer, pose);
  trajectory.flushIfFull();
}

void RunOutput::addState(const NavigationState& state) {
  addPose("trajectory.txt", {state.time, state.p_W, state.q_WI});
  // If the time runs back (a bag that loops), a line comes at once, then ten a second again.
  if (last_navigation_ && std::abs(state.time - *last_navigation_) < kNavigationPeriod) return;
  last_navigation_ = state.time;
  const Eigen::Matrix<double, 6, 1> pose = sigmasOf(bodyOdometry(state, 0.0).pose_covariance);
  row("navigation.csv", state.time)
      .add(state.v_W, 6)
      .add(pose.head<3>(), 6)
      .add(pose.tail<3>(), 6)
      .add(sigmasOf(state.covariance).segment<3>(StateBlock::kV), 6)
      .endLine();
}

void RunOutput::addResult(const ScanResult& result) {
  for (const StampedPose& pose : result.left_window) addPose("trajectory_optimized.txt", pose);
  addAids(result);
  if (!result.used && result.rejected_because.empty()) return;  // only carries the last poses

  const std::string end = suffixOf(files_.radars.at(result.scan.radar)) + ".csv";
  const Time stamp = result.scan.stamp;
  const EgoVelocity& velocity = result.ego_velocity;
  row("ego_velocity" + end, stamp)
      .add(velocity.v_R, 6)
      .add(sigmasOf(velocity.covariance), 6)
      .add(std::to_string(velocity.inliers.size()))
      .add(std::to_string(velocity.points.size()))
      .add(statusOf(result))
      .endLine();
  if (!result.updated) return;
  row("time_offset" + end, stamp).add({result.time_offset, result.time_offset_sigma}, 9).endLine();
  if (files_.extrinsics)
    row("extrinsics" + end, stamp)
        .add(result.T_IR.l_I, 9)
        .add(result.T_IR.q_IR, 9)
        .add(sigmasOf(result.T_IR_covariance).head<3>(), 9)
        .add(sigmasOf(result.T_IR_covariance).tail<3>(), 9)
        .endLine();
  if (result.landmarks && files_.map)
    for (const LandmarkPoint& point : result.landmarks->map) landmarks_[point.id] = point;
  row("biases.csv", stamp).add(result.state.b_g, 9).add(result.state.b_a, 9).endLine();
}

void RunOutput::addAids(const ScanResult& result) {
  for (const BarometerAnswer& mean : result.barometer)
    row("barometer.csv", mean.time)
        .add({mean.height, mean.innovation, mean.innovation_sigma, mean.bias, mean.bias_sigma}, 6)
        .add(std::to_string(mean.samples))
        .add(!mean.rejected_because.empty() ? mean.rejected_because
             : mean.stepped                 ? "stepped"
                                            : "used")
        .endLine();
  if (!result.ground_vehicle) return;
  const GroundVehicleAnswer& vehicle = *result.ground_vehicle;
  row("ground_vehicle.csv", vehicle.time)
      .add(vehicle.v_V, 6)
      .add({std::sqrt(vehicle.squared_sigmas)}, 3)
      .add(vehicle.q_IV, 9)
      .add(vehicle.q_IV_sigma, 9)
      .add(vehicle.is_contradicted ? "contradicted"
           : vehicle.used          ? "used"
                                   : "left_out")
      .endLine();
}

void RunOutput::finish(const RunSummary& summary) {
  for (const auto& [id, point] : landmarks_) {
    File& map = file("map.csv");
    map.buffer += std::to_string(id);
    map.add(point.p_W, 6).add({point.sigma}, 6).add({point.snr_db}, 3).add(std::to_string(point.sightings));
    map.endLine();
  }
  for (auto& [name, file] : open_) file.flush();
  const std::string path = folder_ + "/summary.yaml";
  try {
    File yaml;
    yaml.open(path, summaryText(summary, files_.names()));
    yaml.flush();
  } catch (const OutputError&) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);  // half of it
    throw;
  }
}

}  // namespace rio_t
