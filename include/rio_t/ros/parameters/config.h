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

/// The source of the stamp of a scan (see stamping.h).
enum class StampSource {
  kHeader,   ///< "header": the cloud's own header
  kTrigger,  ///< "trigger": the trigger message that belongs to the scan
  kArrival,  ///< "arrival": when the scan arrived, carried over into the IMU clock
};
std::string toString(StampSource source);

/// How the bag runner goes through a bag.
enum class RunMode {
  kOnline,  ///< "online": as a live user has it
  kBatch,   ///< "batch": the whole bag solved at once, after an online pass
  kRefine,  ///< "refine": online passes, each with the offset found before taken off the stamps
};

/// Where T_IR comes from.
enum class ExtrinsicsSource {
  kParameters,  ///< "parameters": extrinsics_translation and extrinsics_rotation_xyzw
  kTf,          ///< "tf": the transform from the cloud's frame_id to the frame of the IMU
};

/// The live node takes T_BI, the pose of the IMU in base_link, from here.
enum class BaseExtrinsicsSource {
  kAuto,        ///< "auto": tf, if it knows both frames when the odometry starts; else the parameters
  kParameters,  ///< "parameters": base_extrinsics_translation and base_extrinsics_rotation_xyzw
  kTf,          ///< "tf": the transform from the frame of the IMU to base_link_frame, which is waited for
};

/// After a reset, the odometry of the live node goes on here.
enum class ResetPose {
  kKeep,  ///< "keep": at the last pose
  kZero,  ///< "zero": at the origin
};

/// The axes of the radar that extrinsics_rotation_xyzw turns into those of the IMU.
enum class ExtrinsicsAxes {
  kRightForwardUp,  ///< "rfu": x right, y forward, z up, whatever the axes of the cloud
  kCloud,           ///< "cloud": the cloud's own, see `radar_axes`
};

/// These members override the preset `radar_format`. Empty text, no value and a sign of zero override
/// nothing.
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

/// All that a user can set: the estimator's options and what surrounds them. Each member has one key, listed
/// with unit, range and meaning in config/estimator.yaml.
struct Config {
  /// Several radars: the whole configuration as each of them has it. Empty: one radar, and this is its own.
  std::vector<Config> radars;
  std::string radar_name;  ///< empty, but for an element of `radars`

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
  ImuInBody T_BI;  ///< of the parameters
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
  std::optional<Eigen::Vector3d> lever_arm;  ///< [m] in I; nothing: nobody has measured it
  double lever_arm_sigma = 0.0;              ///< [m] per axis; 0: by whether `lever_arm` is given
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

/// The configuration as each radar has it: `config.radars`, or `config` alone for one radar. The index is
/// that of RadarScan::radar.
std::vector<Config> configsOfRadars(const Config& config);

/// Whether the configuration or tf gives the lever arm of this radar.
bool hasLeverArm(const Config& radar);

/// [rad] A protractor measures a mounting so well.
constexpr double kConfiguredSigma = 1.0 * kDegree;

/// Whether a mounting that is to be held is estimated all the same, with a prior of kConfiguredSigma: on a
/// vehicle, an error of a mounting that is exact would tilt the frame of the vehicle.
bool refinesHeldMounting(const Config& config);

using TopicResolver = std::function<std::string(const std::string& key, const std::string& topic)>;
/// The configuration with each topic as `resolve` gives it. An empty one stays empty.
Config withTopics(Config config, const TopicResolver& resolve);

/// A topic that the estimator reads: its key, and the type that it must have.
struct InputTopic {
  std::string key, topic, type;
};
std::vector<InputTopic> inputTopics(const Config& config);

/// The name of a frame for tf2, which refuses the leading slash that tf1 had.
std::string withoutSlash(const std::string& frame);

/// Layout of the cloud: the preset with the overrides.
PointCloudFormat pointCloudFormat(const Config& config);

}  // namespace rio_t
