#pragma once

#include <rosbag/message_instance.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "publishers.h"
#include "rio_t/odometry/batch_odometry.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/ros/cloud/stamping.h"
#include "rio_t/ros/diagnosis/diagnosis.h"
#include "rio_t/ros/parameters/config.h"
#include "run_log.h"

namespace rio_t {

/// Feeds the messages of a bag to the estimator, one by one.
class BagPlayer {
 public:
  /// `config` and `log` must outlive the player. `recorder` keeps the run for a batch; it may be null.
  BagPlayer(const Config& config, RunLog* log, BatchOdometry* recorder);

  void play(const rosbag::MessageInstance& instance);
  /// Call it at the end of the bag.
  void finish();

  /// Returns counts of messages and scans, the measured noise, the diagnosis, and the estimates of `log`.
  RunSummary summary(const RunLog& log) const;
  /// The first initialisation; empty before it.
  const std::optional<RadarInertialOdometry::Start>& start() const { return start_; }

 private:
  /// The input of one radar.
  struct Radar {
    explicit Radar(const Config& config);

    std::string topic, trigger_topic;  // the latter is empty if triggers are not read
    PointCloudFormat format;
    ScanStamper stamper;
    std::vector<double> scan_sizes;  // numbers of points
  };

  void addImu(const sensor_msgs::Imu& message, Time record);
  void addTrigger(const std_msgs::Header& message, Time record, std::size_t radar);
  void addPressure(const sensor_msgs::FluidPressure& message);
  void addCloud(const sensor_msgs::PointCloud2& message, Time record, std::size_t k);
  void feed(std::vector<RadarScan> scans, std::size_t radar);
  /// Counts a message that cannot be used. The summary reports the first `why` of each kind and topic.
  NotUsable& notUsable(const std::string& kind, const std::string& topic, const std::string& why);
  /// The same for a scan, which then counts as rejected.
  void dropScan(const std::string& kind, const std::string& why, std::size_t radar);
  void account(ScanResult& result);

  const Config& config_;
  std::vector<Radar> radars_;  // by RadarScan::radar
  RadarInertialOdometry odometry_;
  RunLog* log_;
  BatchOdometry* recorder_;
  std::optional<RadarInertialOdometry::Start> start_;
  EvidenceCollector evidence_;
  std::vector<ImuRestart> imu_restarts_;
  std::uint64_t imu_count_ = 0;
  std::optional<BarometerCounts> barometer_;  // empty without one
  std::vector<NotUsable> not_usable_;
  std::map<std::string, Publishers> publishers_;  // by topic
};

}  // namespace rio_t
