// LiveOdometry: the callbacks of IMU, scans, triggers and pressures.
#include <ros/console.h>

#include <cmath>

#include "radar_texts.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/live/live_odometry.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {

void LiveOdometry::onImu(const Event<sensor_msgs::Imu>& event) {
  const auto start = std::chrono::steady_clock::now();
  monitor_.imu();
  imu_rate_.tick();
  try {
    const ImuMeasurement imu =
        toImuMeasurement(*event.getConstMessage(), config_.imu_topic, config_.imu_units);
    const ImuSampleCheck::Verdict checked = imu_check_.check(imu);
    if (checked.is_restart) restartClock(checked, imu.time);
    if (checked.fault != nullptr) {
      monitor_.imuUnusable(checked.fault);
    } else {
      monitor_.imuUsable(imu.time);
    }
    frames_.hear(event.getConstMessage()->header.frame_id);
    const Received received{imu, toTime(event.getReceiptTime())};
    const Session now = session_.get();
    if (!now) {
      // The first scan, by which tf names the radar, comes later than the samples that belong to it.
      early_imu_.push_back(received);
      if (early_imu_.size() <= kImuQueue) return;
      early_imu_.pop_front();
      monitor_.imuDropped("imu_before_extrinsics");
      return;
    }
    for (; !early_imu_.empty(); early_imu_.pop_front()) feed(*now, early_imu_.front());
    if (const std::optional<NavigationState> state = feed(*now, received)) {
      if (const std::optional<BodyOdometry> body = frames_.place(*now, *state)) {
        session_.speak(Speaker::kNavigation, now, [&] {
          if (publisher_.odometry(*body)) odom_rate_.tick();
          frames_.published(*body);
          monitor_.odometry(*state,
                            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
        });
      } else if (!frames_.waitingFor().empty()) {
        monitor_.imuDropped("odometry_before_base_extrinsics");
      }
    }
    if (now->imuPilesUp()) {
      reset("the optimisation thread took none of the last " + std::to_string(LiveSession::kMaxWaitingImu) +
            " IMU samples");
    }
    wakeSolver();
  } catch (const std::exception& error) {
    monitor_.imuDropped(kImuNotUsable);
    monitor_.imuUnusable(error.what());
    log_.error(kImuNotUsable, error.what());
  }
}

void LiveOdometry::restartClock(const ImuSampleCheck::Verdict& checked, Time time) {
  const double step = time - *checked.before;
  const std::string seconds = std::to_string(std::abs(step)) + " s";
  reset(checked.stamps_went_on
            ? "no sample of topic " + config_.imu_topic + " that can be used came for " + seconds +
                  ", more than max_bridged_imu_gap: " + describeDropped(checked.dropped)
            : std::string("the IMU's stamps jumped ") + (step < 0.0 ? "back" : "ahead") + " by " + seconds,
        true);
  early_imu_.clear();
}

std::optional<NavigationState> LiveOdometry::feed(LiveSession& session, const Received& received) {
  std::optional<NavigationState> state = session.addImu(received.imu);
  account(session.stampWithImu(received.imu.time, received.record));
  return state;
}

void LiveOdometry::onScan(std::size_t radar, const Event<sensor_msgs::PointCloud2>& event) {
  const sensor_msgs::PointCloud2& message = *event.getConstMessage();
  Radar& from = radars_[radar];
  monitor_.scan(radar);
  from.scan_rate->tick();
  std::string what = "frame_not_usable";
  try {
    // First of all: a cloud that cannot be read still names its frame, and the other radars wait for it.
    if (!from.T_IR) lookUpExtrinsics(from, message.header.frame_id);
    if (!session_.get()) startSessionWhenReady(event.getReceiptTime());
    what = "cloud_not_usable";  // as the bag runner calls it
    DecodedScan decoded;
    try {
      decoded = decode(message, from.format);
    } catch (const std::exception& error) {
      throw std::runtime_error("topic " + from.config.radar_topic + ": " + error.what());
    }
    monitor_.padding(radar, decoded.padding);
    if (decoded.dropped_not_finite > 0)
      monitor_.dropped(radar, "points_not_finite", decoded.dropped_not_finite);
    const Session now = session_.get();
    if (!now || !from.T_IR) {
      monitor_.dropped(radar, "scan_before_extrinsics");
      return;
    }
    RadarScan scan = toRadarScan(decoded.cloud, Time());
    scan.radar = radar;
    what = "stamp_zero";
    account(now->addScan(message.header.seq, toTime(message.header.stamp), toTime(event.getReceiptTime()),
                         std::move(scan)));
    wakeSolver();
  } catch (const std::exception& error) {
    monitor_.dropped(radar, what);
    log_.error(what + " " + from.config.radar_topic, beginning(from.config) + error.what());
  }
}

void LiveOdometry::onPressure(const Event<sensor_msgs::FluidPressure>& event) {
  monitor_.pressure();
  pressure_rate_.tick();
  try {
    const Pressure pressure = toPressure(*event.getConstMessage(), config_.barometer_topic);
    if (const Session now = session_.get()) now->addPressure(pressure);
  } catch (const std::exception& error) {
    monitor_.pressureDropped(error.what());
    log_.error("pressure", error.what());
  }
}

void LiveOdometry::onTrigger(std::size_t radar, const Event<std_msgs::Header>& event) {
  monitor_.trigger(radar);
  radars_[radar].trigger_rate->tick();
  const Session now = session_.get();
  if (!now) return;
  const std_msgs::Header& trigger = *event.getConstMessage();
  try {
    account(now->addTrigger(radar, trigger.seq, toTime(trigger.stamp), toTime(event.getReceiptTime())));
    wakeSolver();
  } catch (const std::exception& error) {
    monitor_.zeroTrigger(radar);
    const Config& config = radars_[radar].config;
    log_.error("trigger_stamp_zero " + config.radar_topic, beginning(config) + error.what());
  }
}

void LiveOdometry::account(const std::vector<LiveSession::GivenUp>& given_up) {
  for (const auto& [radar, reason, count] : given_up) {
    monitor_.dropped(radar, reason, count);
    const Config& config = radars_[radar].config;
    log_.warn("no stamp for " + config.radar_topic + ": " + reason,
              beginning(config) + "a scan got no stamp: " + whyNoStamp(config, reason));
  }
}

void LiveOdometry::lookUpExtrinsics(Radar& radar, const std::string& cloud_frame) {
  const Config& config = radar.config;
  try {
    radar.T_IR = frames_.radarExtrinsics(config, cloud_frame, &radar.waiting_for);
  } catch (const std::exception&) {
    radar.waiting_for = "a frame of the clouds that tf knows" + withName("", config, " of radar ");
    monitor_.waitFor(radar.waiting_for);
    throw;
  }
  if (!radar.T_IR) return;  // the status `odometry` and the log tell what it waits for
  ROS_INFO_STREAM(name_ << ": " << withName("extrinsics", config) << " from tf " << cloud_frame << " -> "
                        << *frames_.imuFrame() << ": translation [" << radar.T_IR->l_I.transpose()
                        << "], rotation xyzw [" << radar.T_IR->q_IR.coeffs().transpose() << "]");
  if (!session_.get()) return;
  takeExtrinsics();
  reset("the mounting" + withName("", config, " of radar ") + " is known now");
}

}  // namespace rio_t
