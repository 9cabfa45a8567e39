#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/angle.h"
#include "rio_t/imu/units.h"
#include "rio_t/odometry/body_odometry.h"
#include "rio_t/odometry/options.h"
#include "rio_t/ros/parameters/point_cloud_format.h"

namespace rio_t {

/// The source of the stamps of scans (see stamping.h).
enum class StampSource {
  kHeader,   ///< "header": the cloud's own header
  kTrigger,  ///< "trigger": the trigger message that belongs to the scan
  kArrival,  ///< "arrival": the time of arrival, converted to the IMU clock
};
std::string toString(StampSource source);

enum class RunMode {
  kOnline,  ///< "online": one pass, as live
  kBatch,   ///< "batch": an online pass, then the whole bag solved at once
  kRefine,  ///< "refine": several online passes, each with the offset found so far subtracted from the stamps
};

enum class ExtrinsicsSource {
  kParameters,  ///< "parameters": extrinsics_translation and extrinsics_rotation_xyzw
  kTf,          ///< "tf": the transform from the cloud's frame_id to the frame of the IMU
};

/// The source from which the live node takes T_BI, the pose of the IMU in base_link.
enum class BaseExtrinsicsSource {
  kAuto,        ///< "auto": tf, if it knows both frames when the odometry starts; else the parameters
  kParameters,  ///< "parameters": base_extrinsics_translation and base_extrinsics_rotation_xyzw
  kTf,          ///< "tf": the node waits for the transform from the frame of the IMU to base_link_frame
};

/// The pose at which the odometry of the live node goes on after a reset.
enum class ResetPose {
  kKeep,  ///< "keep": at the last pose
  kZero,  ///< "zero": at the origin
};

/// The axes of the radar that extrinsics_rotation_xyzw turns into those of the IMU.
enum class ExtrinsicsAxes {
  kRightForwardUp,  ///< "rfu": x right, y forward, z up, even if the cloud has other axes
  kCloud,           ///< "cloud": the axes of the cloud, see `radar_axes`
};

/// These members override the preset `radar_format`. An empty text, no value and a sign of zero keep the
/// preset.
struct PointCloudOverrides {
  std::optional<PointCoordinates> coordinates;
  std::optional<PointAxes> axes;
  std::string x, y, z, azimuth, elevation, range;
  std::string doppler;
  int doppler_sign = 0;
  std::string power;
  std::optional<PowerUnit> power_unit;
  std::optional<bool> size_from_data;
};

/// All parameters: the options of the estimator and those of the programs around it. Each member has one key,
/// listed with unit, range and meaning in config/estimator.yaml.
struct Config {
  /// With several radars, the whole configuration of each. Empty: there is one radar, and this is its
  /// configuration.
  std::vector<Config> radars;
  std::string radar_name;  ///< set only in an element of `radars`

  std::string imu_topic = "sensor_platform/imu";
  std::string radar_topic = "sensor_platform/radar/scan";
  std::string trigger_topic = "sensor_platform/radar/trigger";
  std::string ground_truth_topic = "ground_truth/pose";
  std::string barometer_topic;  ///< empty: no barometer

  StampSource stamp_source = StampSource::kHeader;
  double radar_stamp_shift = 0.0;  ///< [s]

  std::string odom_frame = "odom";
  std::string base_link_frame = "base_link";
  std::string imu_frame;  ///< empty: the frame_id of the IMU's messages
  BaseExtrinsicsSource base_extrinsics_source = BaseExtrinsicsSource::kAuto;
  ImuInBody T_BI;  ///< by the parameters
  std::string radar_frame = "rio_t_radar";
  bool publish_tf = true;
  bool publish_radar_tf = true;
  bool invert_tf = false;
  double tf_rate = 50.0;   ///< [Hz] 0: with each IMU sample
  double odom_rate = 0.0;  ///< [Hz] 0: with each IMU sample
  bool correct_stamps = true;
  ResetPose reset_pose = ResetPose::kKeep;
  std::size_t path_max_poses = 2000;
  std::string trajectory_file = "rio_t_trajectory.txt";

  ExtrinsicsSource extrinsics_source = ExtrinsicsSource::kParameters;
  // makeConfig turns these four into odometry.radar and odometry.smoother.
  std::optional<Eigen::Vector3d> lever_arm;  ///< [m] in I; empty: nobody has measured it
  double lever_arm_sigma = 0.0;              ///< [m] per axis; 0: the default, which depends on `lever_arm`
  EstimateExtrinsics estimate_extrinsics = EstimateExtrinsics::kNone;
  double extrinsics_rotation_sigma = SmootherOptions().extrinsics_rotation_sigma;  ///< [rad] per axis
  // Two other ways to give the rotation of T_IR. makeConfig turns them into odometry.radar.T_IR, which always
  // has the axes of RIO, and sets them back to their defaults.
  std::optional<Eigen::Vector3d> mounting;  ///< yaw, pitch, roll as MountingAngles, but in degrees
  ExtrinsicsAxes extrinsics_axes = ExtrinsicsAxes::kRightForwardUp;
  bool rotation_replaces_mounting = false;  ///< the quaternion comes from a later source than `mounting`
  bool has_default_mounting = false;        ///< makeConfig found no key that gives the rotation of T_IR

  ImuUnits imu_units;

  std::string radar_format = "irs";
  PointCloudOverrides radar_overrides;

  OdometryOptions odometry;

  RunMode mode = RunMode::kOnline;
  int refine_passes = 3;
  int batch_max_iterations = 100;
  double bag_start = 0.0;     ///< [s]
  double bag_duration = 0.0;  ///< [s] 0: to the end
  std::string ground_truth;   ///< TUM file; empty: the topic
};

/// The configuration of each radar: `config.radars`, or `config` alone if there is one radar. The index is
/// that of RadarScan::radar.
std::vector<Config> configsOfRadars(const Config& config);

/// Whether the configuration or tf gives the lever arm of this radar.
bool hasLeverArm(const Config& radar);

/// [rad] Standard deviation of a mounting that was measured with a protractor.
constexpr double kConfiguredSigma = 1.0 * kDegree;

/// Whether the mounting is estimated although the user wants to hold it. This is so on a ground vehicle: an
/// error of a mounting that is held would tilt the vehicle frame. The prior is kConfiguredSigma.
bool refinesHeldMounting(const Config& config);

using TopicResolver = std::function<std::string(const std::string& key, const std::string& topic)>;
/// Returns the configuration with the topics that `resolve` gives. An empty topic stays empty.
Config withTopics(Config config, const TopicResolver& resolve);

/// A topic that the estimator reads: its key, and the type that it must have.
struct InputTopic {
  std::string key, topic, type;
};
std::vector<InputTopic> inputTopics(const Config& config);

/// The name of a frame for tf2, which refuses the leading slash that tf1 had.
std::string withoutSlash(const std::string& frame);

PointCloudFormat pointCloudFormat(const Config& config);

}  // namespace rio_t
