#include "rio_t/ros/live/session.h"

#include <cmath>
#include <utility>

namespace rio_t {
namespace {

constexpr double kObservabilityWindow = 1.0;     // [s]
constexpr double kObservableSigma = 0.02;        // [s] a fifth of a radar period: better than not knowing
constexpr std::size_t kMaxScansInFlight = 1000;  // bounds the memory of arrivals

}  // namespace

LiveSession::LiveSession(const Config& config, const OdometryOptions& options)
    : gyro_density_(options.imu_noise.gyro_density),
      odometry_(options),
      stamper_(stampingOptions(config)),
      queue_(options.max_queued_scans),
      observability_(kObservabilityWindow, kObservableSigma) {}

std::optional<NavigationState> LiveSession::addImu(const ImuMeasurement& imu) {
  ++waiting_imu_;
  return odometry_.addImu(imu);
}

double LiveSession::rateSigma(Time sample) {
  if (!first_imu_) first_imu_ = sample;
  ++imu_count_;
  const double seconds = sample - *first_imu_;
  if (seconds <= 0.0) return gyro_density_;
  return gyro_density_ * std::sqrt(static_cast<double>(imu_count_ - 1) / seconds);
}

LiveSession::Stamped LiveSession::stampWithImu(Time stamp, Time record) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  stamper_.addImu(stamp, record);
  return takeStamped();
}

LiveSession::Stamped LiveSession::addTrigger(std::uint32_t seq, Time stamp, Time record) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  stamper_.addTrigger(seq, stamp, record);
  return takeStamped();
}

LiveSession::Stamped LiveSession::addScan(std::uint32_t seq, Time header_stamp, Time record, RadarScan scan) {
  const std::lock_guard<std::mutex> lock(stamper_mutex_);
  stamper_.addScan(seq, header_stamp, record, std::move(scan));
  return takeStamped();
}

LiveSession::Stamped LiveSession::takeStamped() {
  Stamped stamped;
  for (RadarScan& scan : stamper_.take()) {
    ++stamped.queued;
    if (queue_.push({std::move(scan), Clock::now()})) ++stamped.dropped;
  }
  if (stamper_.givenUp() == given_up_) return stamped;
  for (const auto& [reason, count] : stamper_.givenUp()) {
    for (std::uint64_t& told = given_up_[reason]; told < count; ++told) stamped.given_up.push_back(reason);
  }
  return stamped;
}

std::vector<LiveSession::Result> LiveSession::process(bool* more) {
  std::optional<ScanQueue::Item> item = queue_.pop();
  *more = item.has_value();
  if (item) {
    if (arrivals_.size() >= kMaxScansInFlight) arrivals_.clear();
    arrivals_[item->scan.stamp.nanoseconds()] = item->arrival;
    odometry_.addScan(std::move(item->scan));
  }
  std::vector<Result> results;
  waiting_imu_ = 0;
  for (ScanResult& scan_result : odometry_.process()) {
    Result result;
    observability_.add(scan_result);
    result.offset_observable = observability_.observable();
    const auto arrival = arrivals_.find(scan_result.scan.stamp.nanoseconds());
    if (arrival != arrivals_.end()) {
      result.latency = std::chrono::duration<double>(Clock::now() - arrival->second).count();
      arrivals_.erase(arrival);
    }
    if (scan_result.updated) {
      const std::lock_guard<std::mutex> lock(trajectory_mutex_);
      for (const StampedPose& pose : scan_result.left_window) left_window_.add(pose);
      newest_ = StampedPose{scan_result.state.time, scan_result.state.p_W, scan_result.state.q_WI};
    }
    result.result = std::move(scan_result);
    results.push_back(std::move(result));
  }
  return results;
}

Trajectory LiveSession::trajectory(std::size_t* stride) const {
  const std::lock_guard<std::mutex> lock(trajectory_mutex_);
  if (stride != nullptr) *stride = left_window_.stride();
  Trajectory all = left_window_.poses();
  if (newest_) all.push_back(*newest_);
  return all;
}

}  // namespace rio_t
