#include <cmath>

#include "parameter_sections.h"

namespace rio_t {
void listMessages(ParameterList& list, Config& c) {
  list.group("Topics");
  list.first().text(
      "imu_topic", c.imu_topic,
      "The IMU publishes sensor_msgs/Imu on this topic, in m/s^2 and rad/s unless imu_acceleration_unit or "
      "imu_rate_unit says otherwise. 100 to 1000 samples a second are typical. The orientation in the "
      "message is not used.");
  list.ofRadar(true);
  list.first().text(
      "radar_topic", c.radar_topic,
      "The radar publishes sensor_msgs/PointCloud2 on this topic. Each point needs a position and a "
      "Doppler velocity. 5 to 30 scans a second are typical.");
  list.textOrEmpty(
      "trigger_topic", c.trigger_topic,
      "The trigger line publishes std_msgs/Header on this topic, stamped in the IMU clock when a scan "
      "starts. Only stamp_source: trigger reads it.");
  list.ofRadar(false);
  list.textOrEmpty(
      "ground_truth_topic", c.ground_truth_topic,
      "The bag may have the true poses of the IMU as geometry_msgs/PoseStamped on this topic. The bag "
      "runner then adds the errors to summary.yaml. The live node does not read it.");

  list.group("Several radars");
  list.radarNames(
      "radars", c.radars,
      "Name your radars here if you have more than one. Each name has a section (left: {radar_topic: ...}) "
      "with its own values of the keys that say \"per radar\". The radar takes the other keys from the top "
      "level. An empty list means one radar without a section.");

  list.group("Stamps of the scans");
  list.ofRadar(true);
  list.first().choice<StampSource>(
      "stamp_source",
      {{"header", StampSource::kHeader},
       {"trigger", StampSource::kTrigger},
       {"arrival", StampSource::kArrival}},
      c.stamp_source,
      "This says where the time of a scan comes from. header takes the stamp of the cloud. trigger takes the "
      "stamp of the trigger message that belongs to the scan. arrival takes the time at which the scan "
      "arrived, converted to the clock of the IMU. Use arrival if the driver leaves the stamp at zero and "
      "there is no trigger. The estimated time offset covers the delay that remains.");
  // The bounds keep sums and differences of stamps within 64 bits of nanoseconds.
  list.number("radar_stamp_shift", "s", between(-2e9, 2e9), c.radar_stamp_shift,
              "This is added to the stamp of every scan. Use it for a known delay that is larger than "
              "max_time_offset. For a delay of 0.5 s, set -0.5. Most set-ups leave it at zero.");
}

void listFrames(ParameterList& list, Config& c) {
  list.group("Frames");
  list.frame("odom_frame", c.odom_frame,
             "This is the name of the world frame. Its z axis points up. Its origin and heading are those of "
             "the first pose of base_link_frame.");
  list.first().frame(
      "base_link_frame", c.base_link_frame,
      "This is the body whose odometry the live node publishes. The IMU may sit elsewhere on it.");
  list.textOrEmpty(
      "imu_frame", c.imu_frame,
      "This is the name of the frame of the IMU. If this is empty, the name is the frame_id of the IMU's "
      "messages. Set it if your driver writes a frame that tf does not know.");
  list.choice<BaseExtrinsicsSource>(
      "base_extrinsics_source",
      {{"auto", BaseExtrinsicsSource::kAuto},
       {"parameters", BaseExtrinsicsSource::kParameters},
       {"tf", BaseExtrinsicsSource::kTf}},
      c.base_extrinsics_source,
      "This says where the live node takes the pose of the IMU in base_link_frame from. parameters takes the "
      "next two keys. tf waits for the transform from the frame of the IMU to base_link_frame. auto takes tf "
      "if it is there when the odometry starts, and the next two keys if not.");
  list.vector3("base_extrinsics_translation", "m", between(-100, 100), c.T_BI.p_B,
               "This is the position of the IMU in base_link_frame, x, y, z.");
  list.rotation("base_extrinsics_rotation_xyzw", c.T_BI.q_BI,
                "This quaternion turns vectors of the IMU into base_link_frame.");
  list.ofRadar(true);
  list.frame(
      "radar_frame", c.radar_frame,
      "This is the frame in which the live node shows what the radar sees: x forward, y left, z up. With "
      "several radars, rio_t appends _NAME to the value of the top level. No other node may publish a "
      "transform of this frame, unless publish_radar_tf is false.");
  list.ofRadar(false);
  list.boolean("publish_tf", c.publish_tf,
               "The live node publishes the transform from odom_frame to base_link_frame. Set it to false if "
               "another node, such as robot_localization, publishes it.");
  list.boolean(
      "publish_radar_tf", c.publish_radar_tf,
      "The live node publishes the transform from base_link_frame to radar_frame. Set it to false if "
      "radar_frame is a frame of your URDF.");
  list.boolean(
      "invert_tf", c.invert_tf,
      "The live node publishes the transform from base_link_frame to odom_frame instead. Set it to true if "
      "base_link_frame already has another parent, since a frame can have only one.");
  list.number(
      "tf_rate", "Hz", atLeast(0), c.tf_rate,
      "The live node publishes the transform between odom_frame and base_link_frame this often. 0 means with "
      "each IMU sample. 50 is enough for most consumers of tf.");
  list.number("odom_rate", "Hz", atLeast(0), c.odom_rate,
              "The live node publishes ~odom this often. 0 means with each IMU sample. Use 30 to 50 for an "
              "autopilot.");
  list.boolean(
      "correct_stamps", c.correct_stamps,
      "The live node stamps the points and the velocity of a scan with the time of measurement: the stamp of "
      "the scan minus the time offset. Set it to false to keep the stamps of the driver.");
  list.choice<ResetPose>(
      "reset_pose", {{"keep", ResetPose::kKeep}, {"zero", ResetPose::kZero}}, c.reset_pose,
      "This says where the odometry of the live node goes on after a reset. keep goes on at the "
      "last pose. zero starts at the origin of odom_frame.");
}

void listPointCloud(ParameterList& list, Config& c) {
  list.group("Point cloud: what differs from the preset (\"\" and 0: as in the preset)");
  list.ofRadar(true);
  std::vector<std::pair<std::string, std::string>> presets;
  for (const std::string& name : pointCloudPresets()) presets.emplace_back(name, name);
  list.first().choice<std::string>(
      "radar_format", presets, c.radar_format,
      "This preset says how your driver lays out its cloud: names of the fields, axes, sign of the "
      "Doppler and unit of the power. If no preset fits, take the nearest and change what differs "
      "with the keys radar_field_..., radar_axes, radar_doppler_sign and radar_power_unit.");
  list.choice<std::optional<PointCoordinates>>(
      "radar_coordinates",
      {{"", std::nullopt},
       {"cartesian", PointCoordinates::kCartesian},
       {"spherical", PointCoordinates::kSpherical}},
      c.radar_overrides.coordinates,
      "The cloud has positions as x, y, z (cartesian) or as azimuth, elevation, range (spherical).");
  list.first().choice<std::optional<PointAxes>>(
      "radar_axes",
      {{"", std::nullopt}, {"rfu", PointAxes::kRightForwardUp}, {"flu", PointAxes::kForwardLeftUp}},
      c.radar_overrides.axes,
      "These are the axes of the cloud. rfu: x right, y forward, z up. flu: x forward, y left, z up, "
      "as REP-103. Empty means the axes of the preset.");
  list.textOrEmpty("radar_field_x", c.radar_overrides.x,
                   "This field of the cloud holds the x coordinate of a point [m].");
  list.textOrEmpty("radar_field_y", c.radar_overrides.y,
                   "This field of the cloud holds the y coordinate of a point [m].");
  list.textOrEmpty("radar_field_z", c.radar_overrides.z,
                   "This field of the cloud holds the z coordinate of a point [m].");
  list.textOrEmpty(
      "radar_field_azimuth", c.radar_overrides.azimuth,
      "This field holds the azimuth of a point [rad]. Zero is forward. Positive is right for rfu and left "
      "for flu. Only radar_coordinates: spherical reads it.");
  list.textOrEmpty("radar_field_elevation", c.radar_overrides.elevation,
                   "This field holds the elevation of a point, positive up [rad]. Only radar_coordinates: "
                   "spherical reads it.");
  list.textOrEmpty(
      "radar_field_range", c.radar_overrides.range,
      "This field holds the distance of a point [m]. Only radar_coordinates: spherical reads it.");
  list.textOrEmpty("radar_field_doppler", c.radar_overrides.doppler,
                   "This field holds the Doppler velocity of a point [m/s].");
  list.first().integer(
      "radar_doppler_sign", between(-1, 1), c.radar_overrides.doppler_sign,
      "+1: the Doppler of the driver is positive for points that recede. -1: it is positive for "
      "points that approach. 0 means the sign of the preset. A wrong sign lets the estimate "
      "diverge or never start.");
  list.textOrEmpty(
      "radar_field_power", c.radar_overrides.power,
      "This field holds the signal to noise of a point, in the unit that radar_power_unit names.");
  std::vector<std::pair<std::string, std::optional<PowerUnit>>> units = {{"", std::nullopt}};
  for (const PowerUnit unit :
       {PowerUnit::kSnrDb, PowerUnit::kSnrDeciDb, PowerUnit::kSnrLinear, PowerUnit::kNotSnr})
    units.emplace_back(toString(unit), unit);
  list.choice<std::optional<PowerUnit>>(
      "radar_power_unit", units, c.radar_overrides.power_unit,
      "This is the unit of the power field. snr_db: signal to noise in dB. snr_decidb: in steps of 0.1 dB. "
      "snr_linear: a plain ratio. not_snr: something else, such as RCS; then the field is not read and "
      "radar_min_snr_db does not apply. Change it if radar_min_snr_db removes almost all points.");
  list.choice<std::optional<bool>>(
      "radar_cloud_size", {{"", std::nullopt}, {"declared", false}, {"from_data", true}},
      c.radar_overrides.size_from_data,
      "This says how the number of points is found. declared: width times height. from_data: from the length "
      "of the data, for drivers that leave width and height at zero.");
}

void listExtrinsics(ParameterList& list, Config& c) {
  list.group("T_IR: pose of the radar (x right, y forward, z up) in the IMU frame");
  list.ofRadar(true);
  list.choice<ExtrinsicsSource>(
      "extrinsics_source", {{"parameters", ExtrinsicsSource::kParameters}, {"tf", ExtrinsicsSource::kTf}},
      c.extrinsics_source,
      "This says where the mounting of the radar comes from. parameters takes the keys of this section. tf "
      "takes the transform from the frame_id of the cloud to the frame of the IMU, in the axes of the cloud. "
      "rio_t_bag takes the transform from the tf in the bag.");
  list.first().vector3OrEmpty(
      "extrinsics_translation", "m", between(-100, 100), c.lever_arm,
      "This is the lever arm, the position of the radar in the IMU frame, x, y, z. A tape measure is good "
      "enough: 1 cm of error matters only if the platform turns fast. [] means that nobody has measured it. "
      "rio_t then estimates it, whatever estimate_extrinsics says: with none only the lever arm, with "
      "rotation the whole pose. If the lever arm of one of several radars is [], all lever arms are "
      "estimated.");
  list.first().rotation(
      "extrinsics_rotation_xyzw", c.odometry.radar.T_IR.q_IR,
      "This quaternion turns radar vectors (x right, y forward, z up) into the IMU frame. An error of a "
      "degree bends the path by about 2 % of its length. If you know the rotation only to 10 degrees, set "
      "estimate_extrinsics: pose, or run `calibrate`.");
  list.choice<ExtrinsicsAxes>("extrinsics_axes",
                              {{"rfu", ExtrinsicsAxes::kRightForwardUp}, {"cloud", ExtrinsicsAxes::kCloud}},
                              c.extrinsics_axes,
                              "This says which radar axes extrinsics_rotation_xyzw turns. rfu: x right, y "
                              "forward, z up, whatever the axes of the cloud. cloud: the axes of the cloud "
                              "itself, as a tf or a calibration tool gives them.");
  list.first().vector3OrEmpty(
      "mounting_yaw_pitch_roll_deg", "deg", between(-360, 360), c.mounting,
      "These angles replace extrinsics_rotation_xyzw: yaw to the left, pitch up, roll right side down. They "
      "assume an IMU with x forward, y left, z up. [0, 0, 0] is an upright radar that looks forward. [] "
      "means that extrinsics_rotation_xyzw is used. Give only one of the two keys in a file. Each of them, "
      "given by --set or on the parameter server, replaces the rotation of the file.");

  SmootherOptions& smoother = c.odometry.smoother;
  list.group("Estimate of T_IR: the mounting above is where the estimate starts");
  list.first().choice<EstimateExtrinsics>(
      "estimate_extrinsics",
      {{"none", EstimateExtrinsics::kNone},
       {"rotation", EstimateExtrinsics::kRotation},
       {"pose", EstimateExtrinsics::kPose}},
      c.estimate_extrinsics,
      "none takes the mounting as it is. rotation estimates the rotation of the radar on the way, and takes "
      "its position as exact. pose also estimates its position, as far as the platform turns. Use pose for "
      "a mounting by eye. After a calibration, keep what calibrate wrote. Use none only for a mounting that "
      "is exact. A position that is not given is always estimated. With platform: ground_vehicle, none also "
      "estimates the rotation, but takes it to be right to a degree (or to extrinsics_rotation_sigma, if "
      "that is smaller).");
  list.number(
      "extrinsics_rotation_sigma", "rad", sigma(M_PI), c.extrinsics_rotation_sigma,
      "The estimate of the rotation starts with this standard deviation about each axis. 0.17 rad (10 "
      "degrees) suits a mounting by eye, 0.02 rad a mounting from a drawing.");
  list.ofRadar(true);
  list.number(
      "extrinsics_translation_sigma", "m", zeroOr(kLeastSigma, 100), c.lever_arm_sigma,
      "The estimate of the position starts with this standard deviation along each axis. 0 means 0.05 "
      "m if extrinsics_translation is given, and 0.5 m if it is not.");
  list.ofRadar(false);
  list.number(
      "extrinsics_rotation_noise", "rad/sqrt(s)", sigma(), smoother.extrinsics_rotation_noise,
      "The rotation may wander by this random walk about each axis. Raise it for a mounting that bends or "
      "slips.");
  list.number("extrinsics_translation_noise", "m/sqrt(s)", sigma(), smoother.extrinsics_translation_noise,
              "The position may wander by this random walk along each axis.");
}

}  // namespace rio_t
