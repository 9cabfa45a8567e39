#include "rio_t/ros/live/session.h"

#include <stdexcept>
#include <utility>

namespace rio_t {
namespace {

constexpr std::size_t kMaxScansInFlight = 1000;  // bounds the memory of arrivals

}  // namespace

void OffsetObservability::add(const ScanResult& result) {
  const Time stamp = result.scan.stamp;
  if (result.used) samples_.push_back({stamp, result.offset_information});
  while (!samples_.empty() && stamp - samples_.front().stamp > kWindow) samples_.pop_front();
}

bool OffsetObservability::observable() const {
  double information = 0.0;
  for (const Sample& sample : samples_) information += sample.information;
  return information * kMaxSigma * kMaxSigma > 1.0;
}

BoundedTrajectory::BoundedTrajectory(std::size_t capacity) : capacity_(capacity) {
  if (capacity < 2) throw std::invalid_argument("BoundedTrajectory: expected a capacity of at least 2");
}

void BoundedTrajectory::add(const StampedPose& pose) {
  last_ = pose;
  if (count_++ % stride_ != 0) return;
  if (kept_.size() == capacity_) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < kept_.size(); k += 2) kept_[kept++] = kept_[k];
    kept_.resize(kept);
    stride_ *= 2;
  }
  if (lastIsKept()) kept_.push_back(pose);
}

Trajectory BoundedTrajectory::poses() const {
  Trajectory all = kept_;
  if (count_ > 0 && !lastIsKept()) all.push_back(last_);
  return all;
}

LiveSession::LiveSession(const Config& config, const OdometryOptions& options)
    : gyro_density_(options.imu_noise.gyro_density), odometry_(options) {
  for (const Config& radar : configsOfRadars(config)) {
    stampers_.emplace_back(stampingOptions(radar));
    radars_.push_back({OffsetObservability(), options.ofRadar(radars_.size()).T_IR, std::nullopt});
  }
}

std::optional<NavigationState> LiveSession::addImu(const ImuMeasurement& imu) {
  ++waiting_imu_;
  if (!first_imu_) first_imu_ = imu.time;
  const double seconds = imu.time - *first_imu_;
  if (seconds > 0.0) imu_rate_ = static_cast<double>(imu_count_) / seconds;
  ++imu_count_;
  return odometry_.addImu(imu).state;
}

std::vector<LiveSession::GivenUp> LiveSession::stampWithImu(Time stamp, Time record) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  for (ScanStamper& stamper : stampers_) stamper.addImu(stamp, record);
  return takeStamped();
}

std::vector<LiveSession::GivenUp> LiveSession::addTrigger(std::size_t radar, std::uint32_t seq, Time stamp,
                                                          Time record) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  stampers_.at(radar).addTrigger(seq, stamp, record);
  return takeStamped();
}

std::vector<LiveSession::GivenUp> LiveSession::addScan(std::uint32_t seq, Time header_stamp, Time record,
                                                       RadarScan scan) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  ScanStamper& stamper = stampers_.at(scan.radar);
  stamper.addScan(seq, header_stamp, record, std::move(scan));
  return takeStamped();
}

std::vector<LiveSession::GivenUp> LiveSession::takeStamped() {
  std::vector<GivenUp> given_up;
  for (std::size_t radar = 0; radar < stampers_.size(); ++radar) {
    for (RadarScan& scan : stampers_[radar].take()) {
      if (arrivals_.size() >= kMaxScansInFlight) arrivals_.clear();
      arrivals_[{scan.radar, scan.stamp.nanoseconds()}] = Clock::now();
      odometry_.addScan(std::move(scan));
    }
    for (const auto& [reason, count] : stampers_[radar].takeGivenUp())
      given_up.push_back({radar, reason, count});
  }
  return given_up;
}

std::vector<LiveSession::Result> LiveSession::process(bool* more) {
  std::vector<Result> results;
  waiting_imu_ = 0;
  for (ScanResult& scan_result : odometry_.process(1)) {
    Result result;
    const RadarScan& scan = scan_result.scan;
    Radar& radar = radars_.at(scan.radar);
    radar.observability.add(scan_result);
    result.offset_observable = radar.observability.observable();
    if (scan_result.updated) {
      radar.T_IR = scan_result.T_IR;
      radar.time_offset = scan_result.time_offset;
    }
    result.T_IR = radar.T_IR;
    result.measured_at = scan.stamp - radar.time_offset.value_or(0.0);
    {
      const std::lock_guard<std::mutex> lock(stamper_mutex_);
      const auto arrival = arrivals_.find({scan.radar, scan.stamp.nanoseconds()});
      if (arrival != arrivals_.end()) {
        result.latency = std::chrono::duration<double>(Clock::now() - arrival->second).count();
        arrivals_.erase(arrival);
      }
    }
    {
      const std::lock_guard<std::mutex> lock(trajectory_mutex_);
      for (const StampedPose& pose : scan_result.left_window) left_window_.add(pose);
      if (scan_result.updated)
        newest_ = StampedPose{scan_result.state.time, scan_result.state.p_W, scan_result.state.q_WI};
    }
    result.result = std::move(scan_result);
    results.push_back(std::move(result));
  }
  *more = !results.empty();
  const std::lock_guard<std::mutex> lock(start_mutex_);
  if (!start_) start_ = odometry_.start();
  return results;
}

std::optional<RadarInertialOdometry::Start> LiveSession::start() const {
  const std::lock_guard<std::mutex> lock(start_mutex_);
  return start_;
}

std::optional<WorldInOdom> LiveSession::world() const {
  const std::lock_guard<std::mutex> lock(start_mutex_);
  return world_;
}

void LiveSession::setWorld(const WorldInOdom& T_OW) {
  const std::lock_guard<std::mutex> lock(start_mutex_);
  world_ = T_OW;
}

Trajectory LiveSession::trajectory(std::size_t* stride) const {
  const std::lock_guard<std::mutex> lock(trajectory_mutex_);
  if (stride != nullptr) *stride = left_window_.stride();
  Trajectory all = left_window_.poses();
  // While no scan is used, newer poses leave the window.
  if (newest_ && (all.empty() || all.back().time < newest_->time)) all.push_back(*newest_);
  return all;
}

}  // namespace rio_t
