#include "bag_player.h"

#include <algorithm>
#include <array>
#include <utility>

#include "bag_file.h"
#include "rio_t/core/quantile.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
BagPlayer::BagPlayer(const Config& config, RunLog* log, BatchOdometry* recorder)
    : config_(config), odometry_(config.odometry), log_(log), recorder_(recorder), evidence_(config) {
  if (config.odometry.use_barometer) barometer_.emplace();
  for (const Config& radar : configsOfRadars(config)) radars_.emplace_back(radar);
}

BagPlayer::Radar::Radar(const Config& config)
    : topic(config.radar_topic),
      trigger_topic(config.stamp_source == StampSource::kTrigger ? config.trigger_topic : ""),
      format(pointCloudFormat(config)),
      stamper(stampingOptions(config)) {}

void BagPlayer::play(const rosbag::MessageInstance& instance) {
  const std::string& topic = instance.getTopic();
  const Time record = toTime(instance.getTime());
  if (topic == config_.imu_topic) {
    const auto message = read<sensor_msgs::Imu>(instance);
    publishers_[topic].add(instance.getCallerId(), message->header.frame_id);
    addImu(*message, record);
  }
  if (topic == config_.barometer_topic) addPressure(*read<sensor_msgs::FluidPressure>(instance));
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    if (topic == radars_[k].topic) {
      const auto message = read<sensor_msgs::PointCloud2>(instance);
      publishers_[topic].add(instance.getCallerId(), message->header.frame_id);
      addCloud(*message, record, k);
    }
    // One trigger line may serve several radars.
    if (topic == radars_[k].trigger_topic) addTrigger(*read<std_msgs::Header>(instance), record, k);
  }
  for (std::size_t k = 0; k < radars_.size(); ++k) feed(radars_[k].stamper.take(), k);
  for (ScanResult& result : odometry_.process()) account(result);
}

void BagPlayer::finish() {
  for (std::size_t k = 0; k < radars_.size(); ++k) feed(radars_[k].stamper.finish(), k);
  for (ScanResult& result : odometry_.finish()) account(result);
  for (std::size_t k = 0; k < radars_.size(); ++k)
    for (const auto& [reason, count] : radars_[k].stamper.takeGivenUp())
      evidence_.addDropped(k, reason, count);
}

void BagPlayer::feed(std::vector<RadarScan> scans, std::size_t radar) {
  for (RadarScan& scan : scans) {
    scan.radar = radar;
    odometry_.addScan(std::move(scan));
  }
}

RunSummary BagPlayer::summary(const RunLog& log) const {
  // The odometry has no start while it waits to start again. Then the first start counts.
  const std::optional<RadarInertialOdometry::Start> newest = odometry_.start();
  RunSummary summary(evidence_.evidence(odometry_, newest ? newest : start_));
  summary.initialized = start_ || odometry_.initialized();
  log.fill(&summary);
  summary.imu_count = imu_count_;
  summary.imu_restarts = imu_restarts_;
  summary.barometer = barometer_;
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    const Radar& radar = radars_[k];
    RadarSummary& radar_summary = summary.radars[k];
    radar_summary.knowledge = odometry_.radarKnowledge(k);
    for (std::size_t i = 0; i < 3; ++i) {
      constexpr std::array<double, 3> kShares = {0.1, 0.5, 0.9};
      radar_summary.points_per_scan[i] = static_cast<std::uint64_t>(quantile(radar.scan_sizes, kShares[i]));
    }
    if (radar_summary.points_not_finite > 0)
      summary.input_faults["points_not_finite"] += radar_summary.points_not_finite;
  }
  summary.not_usable = not_usable_;
  for (const NotUsable& each : not_usable_) {
    summary.warnings.push_back(each.text());
    if (!each.is_scan) summary.input_faults[each.kind] += each.count;
  }
  if (!imu_restarts_.empty())
    summary.warnings.push_back("topic " + config_.imu_topic + ": " +
                               describeRestarts(imu_restarts_, config_));
  for (const auto& [topic, publishers] : publishers_) {
    const std::string several = publishers.describeSeveral(topic);
    if (!several.empty()) summary.several_publishers.push_back(several);
  }
  summary.diagnosis = diagnose(summary, config_);
  return summary;
}

void BagPlayer::addImu(const sensor_msgs::Imu& message, Time record) {
  ++imu_count_;
  ImuMeasurement imu;
  try {
    imu = toImuMeasurement(message, config_.imu_topic, config_.imu_units);
  } catch (const std::exception& error) {
    notUsable("imu_not_usable", config_.imu_topic, error.what());
    return;
  }
  const bool was_initialized = odometry_.initialized();
  const Navigation::Checked checked = odometry_.addImu(imu);
  const ImuSampleCheck::Verdict& sample = checked.sample;
  if (sample.is_restart && recorder_ != nullptr) recorder_->startAgain(start_ || was_initialized);
  if (sample.is_restart && was_initialized) {
    imu_restarts_.push_back({*sample.before, imu.time, sample.dropped, sample.stamps_went_on});
    log_->startAgain();
  }
  if (sample.fault == nullptr) evidence_.addImu(imu.time);
  for (Radar& radar : radars_) radar.stamper.addImu(imu.time, record);
  if (recorder_ != nullptr) recorder_->addImu(checked.taken);
  if (!checked.state) return;
  evidence_.addState(checked.state->time);
  log_->addState(*checked.state);
}

void BagPlayer::addTrigger(const std_msgs::Header& message, Time record, std::size_t radar) {
  try {
    radars_[radar].stamper.addTrigger(message.seq, toTime(message.stamp), record);
  } catch (const std::exception& error) {
    notUsable("trigger_stamp_zero", radars_[radar].trigger_topic, error.what());
    evidence_.addZeroTrigger(radar);
  }
}

void BagPlayer::addPressure(const sensor_msgs::FluidPressure& message) {
  if (barometer_) ++barometer_->pressures;
  try {
    odometry_.addPressure(toPressure(message, config_.barometer_topic));
  } catch (const std::exception& error) {
    notUsable("pressure_not_usable", config_.barometer_topic, error.what());
  }
}

void BagPlayer::addCloud(const sensor_msgs::PointCloud2& message, Time record, std::size_t k) {
  Radar& radar = radars_[k];
  DecodedScan decoded;
  try {
    decoded = decode(message, radar.format);
  } catch (const std::exception& error) {
    dropScan("cloud_not_usable", "topic " + radar.topic + ": " + error.what(), k);
    return;
  }
  evidence_.addNotFinite(k, decoded.dropped_not_finite);
  evidence_.addPadding(k, decoded.padding);
  radar.scan_sizes.push_back(static_cast<double>(decoded.cloud.size()));
  try {
    radar.stamper.addScan(message.header.seq, toTime(message.header.stamp), record,
                          toRadarScan(decoded.cloud, Time()));
  } catch (const std::exception& error) {
    dropScan("stamp_zero", error.what(), k);
  }
}

NotUsable& BagPlayer::notUsable(const std::string& kind, const std::string& topic, const std::string& why) {
  auto found = std::find_if(not_usable_.begin(), not_usable_.end(),
                            [&](const NotUsable& each) { return each.kind == kind && each.topic == topic; });
  if (found == not_usable_.end()) found = not_usable_.insert(found, {kind, topic, why});
  ++found->count;
  return *found;
}

void BagPlayer::dropScan(const std::string& kind, const std::string& why, std::size_t radar) {
  evidence_.addDropped(radar, kind, 1);
  notUsable(kind, radars_[radar].topic, why).is_scan = true;
}

void BagPlayer::account(ScanResult& result) {
  if (!start_) start_ = odometry_.start();
  evidence_.add(result);
  if (recorder_ != nullptr) recorder_->addResult(result);
  if (barometer_) barometer_->add(result);
  log_->addResult(result);
}

}  // namespace rio_t
