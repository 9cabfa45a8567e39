#include "parameter_list.h"

// Each key once: its unit, its range, its member and its meaning. Loading, checking, the fault messages and
// config/estimator.yaml all come from here.
namespace rio_t {
namespace {

constexpr double kPi = 3.14159265358979323846;

Range anyNumber() { return {}; }
Range atLeast(double min) { return {min, anyNumber().max, false, false}; }
Range above(double min) { return {min, anyNumber().max, true, false}; }
Range above(double min, double max) { return {min, max, true, false}; }
Range between(double min, double max) { return {min, max, false, false}; }
Range inside(double min, double max) { return {min, max, true, true}; }

void listTopics(ParameterList& list, Config& c) {
  list.group("Topics");
  list.text("imu_topic", c.imu_topic, "sensor_msgs/Imu");
  list.ofRadar(true);
  list.text("radar_topic", c.radar_topic, "sensor_msgs/PointCloud2");
  list.textOrEmpty(
      "trigger_topic", c.trigger_topic,
      "std_msgs/Header, stamped in the IMU clock when a scan starts; only read with stamp_source: trigger");
  list.ofRadar(false);
  list.textOrEmpty("ground_truth_topic", c.ground_truth_topic,
                   "geometry_msgs/PoseStamped of the IMU, for the errors in summary.yaml; bag runner only");
}

void listRadars(ParameterList& list, Config& c) {
  list.group("Several radars");
  list.radarNames("radars", c.radars,
                  "each name has a section (left: {radar_topic: ...}) with what this radar has of its own of "
                  "the keys marked \"per radar\"; []: one radar, without section");
}

void listStamps(ParameterList& list, Config& c) {
  list.group("Stamps of the scans");
  list.ofRadar(true);
  list.choice<StampSource>(
      "stamp_source",
      {{"header", StampSource::kHeader},
       {"trigger", StampSource::kTrigger},
       {"arrival", StampSource::kArrival}},
      c.stamp_source,
      "header of the cloud, its trigger message, or its time of arrival carried over into the IMU clock");
  // The bounds keep sums and differences of stamps within 64 bits of nanoseconds.
  list.number("radar_stamp_shift", "s", between(-2e9, 2e9), c.radar_stamp_shift,
              "added to the stamp of every scan; a known delay goes here with a minus sign");
}

void listFrames(ParameterList& list, Config& c) {
  list.group("Frames");
  list.text("odom_frame", c.odom_frame, "The world frame of the odometry: z is up, and it starts at base_link_frame.");
  list.text("base_link_frame", c.base_link_frame, "The body whose odometry the live node publishes.");
  list.textOrEmpty("imu_frame", c.imu_frame,
                   "The frame of the IMU. If it is empty, the frame_id of the IMU's messages names it.");
  list.choice<BaseExtrinsicsSource>(
      "base_extrinsics_source",
      {{"auto", BaseExtrinsicsSource::kAuto},
       {"parameters", BaseExtrinsicsSource::kParameters},
       {"tf", BaseExtrinsicsSource::kTf}},
      c.base_extrinsics_source,
      "Where the live node takes the pose of the IMU in base_link_frame from: the next two, or tf, which it then "
      "waits for. auto takes tf if it is there when the odometry starts, else the next two.");
  list.vector3("base_extrinsics_translation", "m", between(-100, 100), c.T_BI.p_B,
               "The origin of the IMU in base_link_frame, x, y, z.");
  list.rotation("base_extrinsics_rotation_xyzw", c.T_BI.q_BI,
                "The rotation that turns vectors of the IMU into base_link_frame.");
  list.ofRadar(true);
  list.text("radar_frame", c.radar_frame,
            "The frame in which the live node shows what a radar sees: x forward, y left, z up. Nobody else may "
            "publish a tf of it. With several radars it is rio_t_radar_NAME.");
  list.ofRadar(false);
  list.boolean("publish_tf", c.publish_tf, "Whether the live node publishes the tf odom_frame -> base_link_frame.");
  list.boolean("publish_radar_tf", c.publish_radar_tf,
               "Whether the live node publishes the tf base_link_frame -> radar_frame.");
  list.boolean("invert_tf", c.invert_tf,
               "Publishes the tf base_link_frame -> odom_frame instead, for a tree in which base_link_frame has "
               "another parent.");
  list.number("tf_rate", "Hz", atLeast(0), c.tf_rate,
              "How often the tf of odom_frame is published. 0: with each IMU sample.");
  list.number("odom_rate", "Hz", atLeast(0), c.odom_rate,
              "How often ~odom is published. 0: with each IMU sample.");
  list.boolean("correct_stamps", c.correct_stamps,
               "Whether what the live node publishes of a scan has the time of measurement as its stamp (the scan's "
               "stamp minus the time offset, once there is an estimate), or the scan's stamp.");
  list.choice<ResetPose>("reset_pose", {{"keep", ResetPose::kKeep}, {"zero", ResetPose::kZero}}, c.reset_pose,
                         "Where the odometry of the live node goes on after a reset: at the last pose, or at the "
                         "origin of odom_frame.");
}

void listLiveNode(ParameterList& list, Config& c) {
  list.group("Live node");
  list.integer("path_max_poses", between(1, 1e6), c.path_max_poses, "of ~path, the newest ones");
  list.text("trajectory_file", c.trajectory_file,
            "TUM file that ~save_trajectory writes; a relative path counts from the node's working folder");
}

void listPointCloud(ParameterList& list, Config& c) {
  list.group("Point cloud: a preset, and what differs from it (\"\" and 0: as in the preset)");
  list.ofRadar(true);
  list.word("radar_format", pointCloudPresets(), c.radar_format,
            "layout of the cloud: names, axes, sign and power");
  list.word("radar_coordinates", {"", "cartesian", "spherical"}, c.radar_overrides.coordinates,
            "positions as x, y, z or as azimuth, elevation, range");
  list.word("radar_axes", {"", "rfu", "flu"}, c.radar_overrides.axes,
            "x right, y forward, z up (rfu) or x forward, y left, z up (flu)");
  list.textOrEmpty("radar_field_x", c.radar_overrides.x, "name of the field, as the next ones");
  list.textOrEmpty("radar_field_y", c.radar_overrides.y, "position [m]");
  list.textOrEmpty("radar_field_z", c.radar_overrides.z, "position [m]");
  list.textOrEmpty("radar_field_azimuth", c.radar_overrides.azimuth,
                   "from forward to the lateral axis [rad]");
  list.textOrEmpty("radar_field_elevation", c.radar_overrides.elevation, "positive up [rad]");
  list.textOrEmpty("radar_field_range", c.radar_overrides.range, "distance [m]");
  list.textOrEmpty("radar_field_doppler", c.radar_overrides.doppler, "range rate [m/s]");
  list.integer("radar_doppler_sign", between(-1, 1), c.radar_overrides.doppler_sign,
               "+1: the field is positive for receding targets, -1: for approaching ones");
  list.textOrEmpty("radar_field_power", c.radar_overrides.power, "signal to noise, in radar_power_unit");
  list.word("radar_power_unit", {"", "snr_db", "snr_decidb", "snr_linear", "not_snr"},
            c.radar_overrides.power_unit,
            "not_snr: the field is not read and radar_min_snr_db does not apply");
  list.word("radar_cloud_size", {"", "declared", "from_data"}, c.radar_overrides.size,
            "number of points: width * height, or what the data hold (drivers that leave those at zero)");
}

void listExtrinsics(ParameterList& list, Config& c) {
  list.group("T_IR: pose of the radar (x right, y forward, z up) in the IMU frame");
  list.ofRadar(true);
  list.choice<ExtrinsicsSource>(
      "extrinsics_source", {{"parameters", ExtrinsicsSource::kParameters}, {"tf", ExtrinsicsSource::kTf}},
      c.extrinsics_source,
      "The two below, or tf, live or of the bag: from the cloud's frame_id, with the cloud's axes, to the frame "
      "of the IMU.");
  list.vector3("extrinsics_translation", "m", between(-100, 100), c.odometry.T_IR.l_I,
               "origin of the radar in the IMU frame, x, y, z");
  list.rotation("extrinsics_rotation_xyzw", c.odometry.T_IR.q_IR, "turns radar vectors into the IMU frame");
}

void listEstimateExtrinsics(ParameterList& list, Config& c) {
  SmootherOptions& smoother = c.odometry.smoother;
  list.group("Estimate of T_IR: what is told is where it starts");
  list.choice<EstimateExtrinsics>("estimate_extrinsics",
                                  {{"none", EstimateExtrinsics::kNone},
                                   {"rotation", EstimateExtrinsics::kRotation},
                                   {"pose", EstimateExtrinsics::kPose}},
                                  smoother.estimate_extrinsics,
                                  "take T_IR as told; or estimate its rotation; or translation, too");
  list.number("extrinsics_rotation_sigma", "rad", above(0, kPi), smoother.extrinsics_rotation_sigma,
              "standard deviation of the rotation told, about each axis");
  list.number("extrinsics_translation_sigma", "m", above(0, 100), smoother.extrinsics_translation_sigma,
              "standard deviation of the translation told, per axis");
  list.number("extrinsics_rotation_noise", "rad/sqrt(s)", above(0), smoother.extrinsics_rotation_noise,
              "random walk of the rotation, about each axis");
  list.number("extrinsics_translation_noise", "m/sqrt(s)", above(0), smoother.extrinsics_translation_noise,
              "random walk of the translation, per axis");
}

void listImu(ParameterList& list, Config& c) {
  list.group("IMU");
  list.number("gravity", "m/s^2", between(9.5, 10.0), c.odometry.gravity,
              "magnitude of gravity at the place");
  list.number("imu_accel_noise_density", "m/s^2/sqrt(Hz)", above(0), c.odometry.imu_noise.accel_density,
              "white noise of the accelerometer, to begin with: the innovations scale it, and more counts if "
              "the samples show more");
  list.number("imu_gyro_noise_density", "rad/s/sqrt(Hz)", above(0), c.odometry.imu_noise.gyro_density,
              "white noise of the gyro; more counts if the samples show more");
  list.number("imu_accel_random_walk", "m/s^3/sqrt(Hz)", above(0), c.odometry.imu_noise.accel_random_walk,
              "random walk of the accelerometer's bias");
  list.number("imu_gyro_random_walk", "rad/s^2/sqrt(Hz)", above(0), c.odometry.imu_noise.gyro_random_walk,
              "random walk of the gyro's bias");
}

void listGaps(ParameterList& list, Config& c) {
  ImuInputCheckOptions& gate = c.odometry.imu_input_check;
  list.group("What sensors may leave out");
  list.number("max_imu_gap", "s", above(0), c.odometry.max_imu_gap,
              "between samples; over a longer gap the uncertainty grows, and it is reported");
  list.number("max_bridged_imu_gap", "s", above(0, 60), gate.max_bridged_gap,
              "after a longer one, or where the stamps run back, the estimate starts again");
  list.number("imu_jump_patience", "s", above(0), gate.jump_patience,
              "samples stamped elsewhere are dropped this long, then it is their clock that jumped");
  list.number("imu_accel_range", "m/s^2", atLeast(0), gate.accel_range,
              "largest reading of an axis; 0: found from flat tops");
  list.number("imu_gyro_range", "rad/s", atLeast(0), gate.gyro_range,
              "largest reading of an axis; 0: found from flat tops");
  list.number("imu_unseen_accel_density", "m/s^2/sqrt(Hz)", above(0), gate.unseen_accel_density,
              "noise that stands for the motion in gaps and beyond the range");
  list.number("imu_unseen_gyro_density", "rad/s/sqrt(Hz)", above(0), gate.unseen_gyro_density,
              "likewise, and while an axis sticks");
  list.number("max_radar_gap", "s", above(0), c.odometry.max_radar_gap,
              "without a scan that is not reported");
}

void listInitialization(ParameterList& list, Config& c) {
  StaticInitializerOptions& init = c.odometry.initialization;
  list.group("Initialisation");
  list.choice<InitMode>(
      "init_mode", {{"static", InitMode::kStatic}, {"motion", InitMode::kMotion}, {"auto", InitMode::kAuto}},
      c.odometry.init_mode,
      "wait for rest; start from radar and IMU at once, moving or not; or wait for rest for "
      "init_motion_after");
  list.number("init_motion_after", "s", atLeast(0), c.odometry.init_motion_after,
              "without rest, after which auto starts in motion");
  list.number("init_duration", "s", above(0), init.duration,
              "rest that is averaged for attitude and gyro bias");
  list.number("init_max_gyro_std", "rad/s", above(0), init.max_gyro_std,
              "of an axis; above, the platform moves");
  list.number("init_max_accel_std", "m/s^2", above(0), init.max_accel_std,
              "of an axis; above, the platform moves");
  list.number("init_max_gyro_mean", "rad/s", above(0), init.max_gyro_mean,
              "of an axis; a larger mean is a rotation, not a bias");
  list.number("init_max_gravity_error", "m/s^2", above(0), init.max_gravity_error,
              "difference of the mean accelerometer's norm from gravity");
  MotionInitializerOptions& motion = c.odometry.motion_initialization;
  list.number("init_motion_window", "s", between(1, 10), motion.window,
              "of radar velocities that a start in motion uses");
  list.number("init_motion_max_gravity_error", "m/s^2", above(0), motion.max_gravity_error,
              "of what radar and IMU show together as gravity; more, and units or extrinsics are wrong");
  list.number("init_motion_max_outlier_fraction", "", between(0, 1), motion.max_outlier_fraction,
              "of the radar velocities that may not fit the IMU");
  list.number("init_motion_sigma_gyro_bias", "rad/s", above(0), motion.sigma_gyro_bias,
              "of an axis, around zero: in motion nothing tells the biases beforehand");
  list.number("init_motion_sigma_accel_bias", "m/s^2", above(0), motion.sigma_accel_bias,
              "of an axis, around zero");
}

void listHealth(ParameterList& list, Config& c) {
  HealthOptions& health = c.odometry.health;
  list.group("Health: ok, coasting or diverged");
  list.choice<OnDivergence>(
      "on_divergence", {{"report", OnDivergence::kReport}, {"reinitialize", OnDivergence::kReinitialize}},
      health.on_divergence,
      "say so and go on; or also find the state anew in motion where it lasts: position and heading go on");
  list.number("reinitialize_after", "s", atLeast(0), health.reinitialize_after,
              "of divergence; for so long the IMU alone is worth more than a radar that contradicts it");
  list.number("divergence_window", "s", above(0, 60), health.window, "of scans that are judged");
  list.number("divergence_max_contradiction", "", inside(0, 1), health.max_contradiction,
              "mean over the window of the squared innovation in units of innovation_gate, at most 1 a scan; "
              "0 without a majority");
  list.number("divergence_max_velocity_sigma", "m/s", above(0), health.max_velocity_sigma,
              "of an axis; above, the velocity counts as not known");
  list.number("coasting_after", "s", above(0), health.coasting_after, "without a scan used");
}

void listRest(ParameterList& list, Config& c) {
  RestOptions& rest = c.odometry.rest;
  list.group("Rest on the way, as the IMU sees it");
  list.boolean("rest_enabled", rest.enabled, "hold the velocity at zero while at rest");
  list.number("rest_window", "s", above(0), rest.window, "that the platform must have been still for");
  list.number("rest_max_gyro_std", "rad/s", above(0), rest.max_gyro_std, "of an axis over the window");
  list.number("rest_max_accel_std", "m/s^2", above(0), rest.max_accel_std, "of an axis over the window");
  list.number("rest_max_rate", "rad/s", above(0), rest.max_rate, "mean gyro without bias");
  list.number("rest_max_accel_error", "m/s^2", above(0), rest.max_accel_error,
              "mean accelerometer without bias and gravity");
  list.number("rest_max_speed", "m/s", above(0), rest.max_speed,
              "estimated; faster, stillness is a smooth ride and not rest");
  list.number("rest_velocity_sigma", "m/s", above(0), rest.velocity_sigma, "of the zero velocity, per axis");
}

void listEgoVelocity(ParameterList& list, Config& c) {
  EgoVelocityOptions& radar = c.odometry.ego_velocity;
  list.group("Radar: which points count, and the velocity from them");
  list.ofRadar(true);
  list.number("radar_min_range", "m", atLeast(0), radar.min_range, "nearer points are left out");
  list.number("radar_max_range", "m", above(0), radar.max_range, "farther points are left out");
  list.number("radar_min_snr_db", "dB", anyNumber(), radar.min_snr_db, "weaker points are left out");
  list.number("radar_max_azimuth", "rad", above(0, kPi), radar.max_azimuth,
              "field of view to either side of forward");
  list.number("radar_max_elevation", "rad", above(0, kPi / 2), radar.max_elevation,
              "field of view up and down");
  list.number("zero_velocity_threshold", "m/s", atLeast(0), radar.zero_velocity_threshold,
              "a Doppler below counts as zero; 0: half of radar_doppler_step, or 1.5 radar_doppler_sigma if "
              "that is more");
  list.number("zero_velocity_outlier_fraction", "", between(0, 1), radar.zero_velocity_outlier_fraction,
              "share of Dopplers that may exceed it at rest");
  list.number("zero_velocity_sigma", "m/s", above(0), radar.zero_velocity_sigma,
              "standard deviation per axis, at rest, besides what radar_doppler_step hides");
  list.number("ransac_inlier_threshold", "m/s", atLeast(0), radar.ransac_inlier_threshold,
              "Doppler residual of an inlier; 0: half of radar_doppler_step and 2.5 radar_doppler_sigma");
  list.number("ransac_outlier_probability", "", Range{0, 1, false, true}, radar.ransac_outlier_probability,
              "share of outliers that is reckoned with");
  list.number("ransac_success_probability", "", inside(0, 1), radar.ransac_success_probability,
              "of drawing inliers only, once; sets the number of draws");
  list.number("ego_velocity_prior_gate", "", above(0), radar.prior_gate,
              "standard deviations; farther from what the IMU predicts, a velocity contradicts it");
  list.integer("ransac_seed", atLeast(0), radar.ransac_seed,
               "restarted at each scan: same scan, same answer");
  list.integer("ego_velocity_min_inliers", atLeast(3), radar.min_inliers,
               "one velocity has three unknowns, the others are witnesses; so many for the estimate alone "
               "outvote a majority");
  list.number("ego_velocity_min_inlier_fraction", "", between(0, 1), radar.min_inlier_fraction,
              "of the points that count; fewer agree by chance");
  list.number("ego_velocity_prior_min_inlier_fraction", "", between(0, 1), radar.prior_min_inlier_fraction,
              "likewise, to side with points that agree with what the IMU predicts");
  list.choice<EgoVelocitySolver>(
      "ego_velocity_solver",
      {{"ls", EgoVelocitySolver::kLeastSquares}, {"eiv", EgoVelocitySolver::kErrorsInVariables}},
      radar.solver,
      "plain least squares, or weighted by direction noise and freed of its bias (errors in variables)");
  list.number("radar_azimuth_sigma", "rad", atLeast(0), radar.azimuth_sigma,
              "noise of a point's azimuth to start with; eiv learns it from the residuals");
  list.number("radar_elevation_sigma", "rad", atLeast(0), radar.elevation_sigma, "likewise of its elevation");
  list.number("radar_doppler_sigma", "m/s", atLeast(0), radar.doppler_sigma,
              "likewise of its Doppler, besides the steps");
  list.number(
      "radar_doppler_span", "m/s", atLeast(0), radar.doppler_span,
      "whole span of the radar's Doppler: what lies beyond comes back on the other side; 0: read it off "
      "the data");
  list.number("radar_doppler_step", "m/s", atLeast(0), radar.doppler_quantization,
              "step in which the radar gives the Doppler; 0: read off the data, which may show none; "
              "above 0 and below 0.02: none");
  list.vector3("ego_velocity_added_sigma", "m/s", atLeast(0), radar.added_sigma,
               "added in quadrature, to begin with: right, forward, up; the innovations scale it");
  list.number("ego_velocity_max_condition_number", "", atLeast(1), radar.max_condition_number,
              "of H'H over the unit directions; above, they do not span space");
  list.number("ego_velocity_max_sigma", "m/s", above(0), radar.max_sigma,
              "largest axis of the estimate; above, the scan is rejected");
}

void listFeasibility(ParameterList& list, Config& c) {
  list.group("Radar: jumps of the velocity that no platform can make");
  list.number("feasibility_window", "s", above(0), c.odometry.feasibility.window,
              "length of the sliding average");
  list.number("feasibility_max_acceleration", "m/s^2", above(0), c.odometry.feasibility.max_acceleration,
              "the velocity cannot leave the average faster");
  list.number("feasibility_margin", "m/s", atLeast(0), c.odometry.feasibility.margin, "always allowed");
}

void listTimeOffset(ParameterList& list, Config& c) {
  SmootherOptions& smoother = c.odometry.smoother;
  list.group("Time offset: a scan stamped s was measured at s - offset");
  list.boolean("estimate_time_offset", smoother.estimate_time_offset, "false: fixed at time_offset_initial");
  list.choice<TimeOffsetModel>(
      "time_offset_model",
      {{"constant_acceleration", TimeOffsetModel::kConstantAcceleration}, {"imu", TimeOffsetModel::kImu}},
      smoother.time_offset_model,
      "the paper's, one acceleration times the offset; or the IMU itself over the offset");
  list.boolean("time_offset_shared", smoother.time_offset_shared,
               "all radars have one clock, and so one offset; false: each has its own");
  list.ofRadar(true);
  list.number("time_offset_initial", "s", anyNumber(), smoother.time_offset_initial,
              "where the estimate starts");
  list.number("time_offset_sigma", "s", above(0), smoother.time_offset_sigma,
              "standard deviation of that start");
  list.ofRadar(false);
  list.number("time_offset_noise", "s/sqrt(s)", above(0), smoother.time_offset_noise,
              "random walk of the offset; it grows by itself while the scans ask for a change all the time, "
              "as they do where clocks drift");
  list.number("time_offset_min_acceleration", "m/s^2", atLeast(0), smoother.time_offset_min_acceleration,
              "of the radar; below, or below five sigma of the IMU's noise, a scan says nothing of the "
              "offset, which then holds still");
  list.number("max_time_offset", "s", above(0, 1), smoother.max_time_offset,
              "bound on its size, either sign");
  OffsetStepDetectorOptions& monitor = c.odometry.offset_step_detector;
  list.boolean("time_offset_step_detection", monitor.enabled,
               "find the offset anew where the scans say that it stepped, e.g. after a driver restart");
  list.number("time_offset_step_memory", "s", above(0), monitor.memory, "of the average over scans");
  list.number("time_offset_step_significance", "", above(0), monitor.significance,
              "standard deviations of the change that the scans ask for");
  list.number("time_offset_step_min", "s", above(0), monitor.min_change,
              "smaller steps are left to the random walk");
}

void listSmoother(ParameterList& list, Config& c) {
  SmootherOptions& smoother = c.odometry.smoother;
  list.group("Smoother");
  list.number("window", "s", above(0, 60), smoother.window,
              "length; what leaves it is marginalised into a prior");
  list.number("huber_threshold", "", atLeast(0), smoother.huber_threshold,
              "on the norm of the whitened radar residual; 0: no robust loss");
  list.choice<RadarFactor>("radar_factor",
                           {{"velocity", RadarFactor::kVelocity}, {"doppler", RadarFactor::kDoppler}},
                           smoother.radar_factor,
                           "what a scan gives to the window: its ego-velocity, or the Doppler of each point, "
                           "so that scans of a few "
                           "points count, too");
  list.choice<WindowSolver>(
      "solver", {{"chain", WindowSolver::kChain}, {"ceres", WindowSolver::kCeres}}, smoother.solver,
      "chain: Gauss-Newton along the chain of states; ceres: ceres::Solve, the same estimate, slower");
  list.integer("max_iterations", between(1, 1000), smoother.max_iterations, "of the solver, each scan");
  list.number("innovation_gate", "", atLeast(0), smoother.innovation_gate,
              "standard deviations from the IMU's prediction; farther, a scan is rejected; 0: no gate");
  list.number("innovation_model_error", "m/s", atLeast(0), smoother.innovation_model_error,
              "per axis, added to that prediction in the gate only: what extrinsics and IMU scale are wrong");
  list.number("innovation_gate_timeout", "s", above(0), smoother.innovation_gate_timeout,
              "without a scan used, after which the next is taken all the same");
  list.number("prior_sigma_yaw", "rad", above(0), smoother.prior_sigma_yaw,
              "of the first state; yaw defines the world frame");
  list.number("prior_sigma_position", "m", above(0), smoother.prior_sigma_position,
              "of the first state; it defines the world frame");
  list.number("prior_sigma_velocity", "m/s", above(0), smoother.prior_sigma_velocity,
              "of the first state, and of either end of the rest before it");
  list.number("prior_sigma_gyro_bias", "rad/s", above(0), smoother.prior_sigma_gyro_bias,
              "of the first state, besides the noise of the mean at rest");
  list.number("prior_sigma_accel_bias", "m/s^2", above(0), smoother.prior_sigma_accel_bias,
              "of the first state; over gravity, it is the sigma of roll and pitch, too");
  list.integer("max_queued_scans", atLeast(1), c.odometry.max_queued_scans,
               "scans that may wait for the IMU or the solver");
}

void listBag(ParameterList& list, Config& c) {
  list.group("Bag runner");
  list.choice<RunMode>(
      "mode", {{"online", RunMode::kOnline}, {"batch", RunMode::kBatch}, {"refine", RunMode::kRefine}},
      c.mode,
      "as a live user has it; the whole bag solved at once; or passes, each with the offset found before "
      "taken "
      "off the stamps");
  list.integer("refine_passes", between(1, 100), c.refine_passes, "of mode: refine");
  list.integer("batch_max_iterations", between(1, 10000), c.batch_max_iterations,
               "of the solver, with mode: batch");
  list.number("bag_start", "s", atLeast(0), c.bag_start, "of the bag that is left out at its beginning");
  list.number("bag_duration", "s", atLeast(0), c.bag_duration, "of the bag that is played; 0: to its end");
  list.textOrEmpty("ground_truth", c.ground_truth,
                   "TUM file with the poses of the IMU; empty: ground_truth_topic, if the bag has it");
}

}  // namespace

ParameterList parametersOf(Config& config) {
  ParameterList list;
  listTopics(list, config);
  listRadars(list, config);
  listStamps(list, config);
  listFrames(list, config);
  listPointCloud(list, config);
  listExtrinsics(list, config);
  listEstimateExtrinsics(list, config);
  listImu(list, config);
  listGaps(list, config);
  listInitialization(list, config);
  listRest(list, config);
  listEgoVelocity(list, config);
  listFeasibility(list, config);
  listTimeOffset(list, config);
  listSmoother(list, config);
  listHealth(list, config);
  listLiveNode(list, config);
  listBag(list, config);
  return list;
}

}  // namespace rio_t
