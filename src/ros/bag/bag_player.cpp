#include "bag_player.h"

#include <std_msgs/Header.h>

#include <array>
#include <stdexcept>
#include <utility>

#include "bag_file.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

/// The least number of points that so many of the scans do not exceed.
std::uint64_t quantile(const std::map<std::size_t, std::uint64_t>& scans_by_size, double share) {
  std::uint64_t total = 0;
  for (const auto& [size, scans] : scans_by_size) total += scans;
  std::uint64_t so_far = 0;
  for (const auto& [size, scans] : scans_by_size) {
    so_far += scans;
    if (static_cast<double>(so_far) >= share * static_cast<double>(total)) return size;
  }
  return 0;
}

}  // namespace

BagPlayer::BagPlayer(const Config& config, RunLog* log, BatchOdometry* recorder)
    : config_(config),
      format_(pointCloudFormat(config)),
      stamper_(stampingOptions(config)),
      odometry_(config.odometry),
      log_(log),
      recorder_(recorder) {}

void BagPlayer::play(const rosbag::MessageInstance& instance) {
  const std::string& topic = instance.getTopic();
  const Time record = toTime(instance.getTime());
  if (topic == config_.imu_topic) {
    addImu(*read<sensor_msgs::Imu>(instance), record);
  } else if (topic == config_.radar_topic) {
    addCloud(*read<sensor_msgs::PointCloud2>(instance), record);
  } else {
    const auto trigger = read<std_msgs::Header>(instance);
    stamper_.addTrigger(trigger->seq, toTime(trigger->stamp), record);
  }
  for (RadarScan& scan : stamper_.take()) odometry_.addScan(std::move(scan));
  for (ScanResult& result : odometry_.process()) account(result);
}

void BagPlayer::finish() {
  for (RadarScan& scan : stamper_.finish()) odometry_.addScan(std::move(scan));
  for (ScanResult& result : odometry_.finish()) account(result);
}

RunSummary BagPlayer::summary() const {
  RunSummary summary;
  log_->fill(&summary);
  countInput(&summary);
  return summary;
}

void BagPlayer::countInput(RunSummary* summary) const {
  summary->imu_count = imu_count_;
  summary->imu_noise = odometry_.imuNoise();
  summary->radar_noise = odometry_.radarNoise();
  summary->radar_doppler_step = odometry_.radarDopplerStep();
  for (std::size_t i = 0; i < 3; ++i) {
    constexpr std::array<double, 3> kShares = {0.1, 0.5, 0.9};
    summary->radar_points_per_scan[i] = quantile(scans_by_size_, kShares[i]);
  }
  summary->scans_total = scans_total_;
  for (const auto& [reason, count] : stamper_.givenUp()) summary->scans_rejected[reason] += count;
  summary->input_faults = odometry_.faults();
  // These two are judgements of the estimate, with keys of their own.
  const auto take = [&](const char* name) {
    const auto node = summary->input_faults.extract(name);
    return node.empty() ? std::uint64_t{0} : node.mapped();
  };
  summary->divergences = take("diverged");
  summary->reinitializations = take("reinitialized");
  summary->health_at_end = toString(odometry_.health());
  if (const auto start = odometry_.start()) summary->initialized_from = toString(start->from);
  if (points_not_finite_ > 0) summary->input_faults["points_not_finite"] = points_not_finite_;
  for (const auto& [kind, what] : not_usable_) {
    (kind == "imu_not_usable" ? summary->input_faults : summary->scans_rejected)[kind] += what.count;
    summary->warnings.push_back(what.why + " (messages: " + std::to_string(what.count) + ")");
  }
}

void BagPlayer::addImu(const sensor_msgs::Imu& message, Time record) {
  ++imu_count_;
  ImuMeasurement imu;
  try {
    imu = toImuMeasurement(message, config_.imu_topic);
  } catch (const std::exception& error) {
    notUsable("imu_not_usable", error.what());
    return;
  }
  stamper_.addImu(imu.time, record);
  if (recorder_ != nullptr) recorder_->addImu(imu);
  if (const std::optional<NavigationState> state = odometry_.addImu(imu)) log_->addState(*state);
}

void BagPlayer::addCloud(const sensor_msgs::PointCloud2& message, Time record) {
  ++scans_total_;
  DecodedScan decoded;
  try {
    decoded = decode(message, format_);
  } catch (const std::exception& error) {
    notUsable("cloud_not_usable", "topic " + config_.radar_topic + ": " + error.what());
    return;
  }
  points_not_finite_ += decoded.dropped_not_finite;
  ++scans_by_size_[decoded.cloud.size()];
  try {
    stamper_.addScan(message.header.seq, toTime(message.header.stamp), record,
                     toRadarScan(decoded.cloud, Time()));
  } catch (const std::exception& error) {
    notUsable("stamp_zero", error.what());
  }
}

void BagPlayer::notUsable(const std::string& kind, const std::string& why) {
  ++not_usable_.try_emplace(kind, NotUsable{why, 0}).first->second.count;
}

void BagPlayer::account(ScanResult& result) {
  if (!start_) start_ = odometry_.start();
  if (recorder_ != nullptr) {
    const auto faults = odometry_.faults();
    const auto steps = faults.find("time_offset_step");
    const std::uint64_t count = steps == faults.end() ? 0 : steps->second;
    recorder_->addResult(result, std::exchange(offset_steps_, count) != count);
  }
  log_->addResult(result);
}

}  // namespace rio_t
