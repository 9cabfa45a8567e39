#include "bag_player.h"

#include <array>
#include <utility>

#include "bag_file.h"
#include "rio_t/core/quantile.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
BagPlayer::BagPlayer(const Config& config, RunLog* log, BatchOdometry* recorder)
    : config_(config),
      odometry_(config.odometry),
      log_(log),
      recorder_(recorder),
      evidence_(config),
      imu_stamps_(config.odometry.imu_input_check.max_bridged_gap,
                  config.odometry.imu_input_check.jump_patience) {
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
  if (topic == config_.imu_topic) addImu(*read<sensor_msgs::Imu>(instance), record);
  if (topic == config_.barometer_topic) addPressure(*read<sensor_msgs::FluidPressure>(instance));
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    if (topic == radars_[k].topic) addCloud(*read<sensor_msgs::PointCloud2>(instance), record, k);
    // One line may trigger several radars.
    if (topic == radars_[k].trigger_topic) addTrigger(*read<std_msgs::Header>(instance), record, k);
  }
  for (std::size_t k = 0; k < radars_.size(); ++k) feed(radars_[k].stamper.take(), k);
  for (ScanResult& result : odometry_.process()) account(result);
}

void BagPlayer::finish() {
  for (std::size_t k = 0; k < radars_.size(); ++k) feed(radars_[k].stamper.finish(), k);
  for (ScanResult& result : odometry_.finish()) account(result);
}

void BagPlayer::feed(std::vector<RadarScan> scans, std::size_t radar) {
  for (RadarScan& scan : scans) {
    scan.radar = radar;
    odometry_.addScan(std::move(scan));
  }
}

RunSummary BagPlayer::summary(const RunLog& log) const {
  RunSummary summary(evidence_.evidence(odometry_, odometry_.start()));
  log.fill(&summary);
  summary.imu_count = imu_count_;
  summary.imu_restarts = imu_restarts_;
  if (summary.barometer) summary.barometer->pressures = pressure_count_;
  const auto warn = [&](const NotUsableByKind& kinds) {
    for (const auto& [kind, what] : kinds)
      summary.warnings.push_back(what.why + " (messages: " + std::to_string(what.count) + ")");
  };
  const auto count = [&](const NotUsableByKind& kinds, Counts* counts) {
    for (const auto& [kind, what] : kinds) (*counts)[kind] += what.count;
  };
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    const Radar& radar = radars_[k];
    RadarSummary& radar_summary = summary.radars[k];
    radar_summary.noise = odometry_.radarNoise(k);
    radar_summary.doppler_step = odometry_.radarDopplerStep(k);
    for (std::size_t i = 0; i < 3; ++i) {
      constexpr std::array<double, 3> kShares = {0.1, 0.5, 0.9};
      radar_summary.points_per_scan[i] = static_cast<std::uint64_t>(quantile(radar.scan_sizes, kShares[i]));
    }
    radar_summary.scans_total = radar.scans_total;
    if (radar_summary.points_not_finite > 0)
      summary.input_faults["points_not_finite"] += radar_summary.points_not_finite;
    for (const auto& [reason, given_up] : radar.stamper.givenUp())
      radar_summary.scans_rejected[reason] += given_up;
    count(radar.not_usable, &radar_summary.scans_rejected);
    count(radar.triggers_not_usable, &summary.input_faults);
    warn(radar.not_usable);
  }
  count(imu_not_usable_, &summary.input_faults);
  count(pressure_not_usable_, &summary.input_faults);
  for (const Radar& radar : radars_) warn(radar.triggers_not_usable);
  warn(pressure_not_usable_);
  if (!imu_restarts_.empty())
    summary.warnings.push_back("topic " + config_.imu_topic + ": " +
                               describeRestarts(imu_restarts_, config_));
  warn(imu_not_usable_);
  summary.diagnosis = diagnose(summary, config_);
  // Keys and files of the only radar carry no name.
  if (summary.radars.size() == 1) summary.radars.front().name.clear();
  return summary;
}

void BagPlayer::addImu(const sensor_msgs::Imu& message, Time record) {
  ++imu_count_;
  ImuMeasurement imu;
  try {
    imu = toImuMeasurement(message, config_.imu_topic, config_.imu_units);
  } catch (const std::exception& error) {
    notUsable("imu_not_usable", error.what(), &imu_not_usable_);
    return;
  }
  followImuStamps(imu);
  for (Radar& radar : radars_) radar.stamper.addImu(imu.time, record);
  if (recorder_ != nullptr) recorder_->addImu(imu);
  const std::optional<NavigationState> state = odometry_.addImu(imu);
  if (!state) return;
  evidence_.addState(state->time);
  log_->addState(*state);
}

void BagPlayer::followImuStamps(const ImuMeasurement& imu) {
  if (faultOfValues(imu, config_.odometry.imu_input_check) != nullptr) return;
  const std::optional<Time> before = imu_stamps_.newest();
  const bool restarts = imu_stamps_.check(imu.time) == ClockJumpDetector::Verdict::kRestart;
  if (restarts && odometry_.initialized()) imu_restarts_.push_back({*before, imu.time});
  if (imu_stamps_.newest() == imu.time) evidence_.addImu(imu.time);
}

void BagPlayer::addTrigger(const std_msgs::Header& message, Time record, std::size_t radar) {
  try {
    radars_[radar].stamper.addTrigger(message.seq, toTime(message.stamp), record);
  } catch (const std::exception& error) {
    notUsable("trigger_stamp_zero", error.what(), &radars_[radar].triggers_not_usable);
    evidence_.addZeroTrigger(radar);
  }
}

void BagPlayer::addPressure(const sensor_msgs::FluidPressure& message) {
  ++pressure_count_;
  try {
    odometry_.addPressure(toPressure(message, config_.barometer_topic));
  } catch (const std::exception& error) {
    notUsable("pressure_not_usable", error.what(), &pressure_not_usable_);
  }
}

void BagPlayer::addCloud(const sensor_msgs::PointCloud2& message, Time record, std::size_t k) {
  Radar& radar = radars_[k];
  ++radar.scans_total;
  DecodedScan decoded;
  try {
    decoded = decode(message, radar.format);
  } catch (const std::exception& error) {
    notUsable("cloud_not_usable", "topic " + radar.topic + ": " + error.what(), &radar.not_usable);
    return;
  }
  evidence_.addNotFinite(k, decoded.dropped_not_finite);
  radar.scan_sizes.push_back(static_cast<double>(decoded.cloud.size()));
  try {
    radar.stamper.addScan(message.header.seq, toTime(message.header.stamp), record,
                          toRadarScan(decoded.cloud, Time()));
  } catch (const std::exception& error) {
    notUsable("stamp_zero", error.what(), &radar.not_usable);
  }
}

void BagPlayer::notUsable(const std::string& kind, const std::string& why, NotUsableByKind* kinds) {
  ++kinds->try_emplace(kind, NotUsable{why, 0}).first->second.count;
}

void BagPlayer::account(ScanResult& result) {
  if (!start_) start_ = odometry_.start();
  evidence_.add(result);
  if (recorder_ != nullptr) recorder_->addResult(result);
  log_->addResult(result);
}

}  // namespace rio_t
