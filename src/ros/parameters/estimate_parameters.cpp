#include <cmath>

#include "parameter_sections.h"

namespace rio_t {
namespace {

void listWindow(ParameterList& list, Config& c) {
  SmootherOptions& smoother = c.odometry.smoother;
  list.number(
      "window", "s", above(0, 60), smoother.window,
      "The smoother optimises the states of this last stretch of time. States that leave the window become a "
      "prior. 0.5 to 3 s are typical. A longer window costs more time per scan and helps little. Raise it if "
      "scans are rare. The biases of the IMU are constant over the window, and in a "
      "batch over each stretch of this length.");
  list.number(
      "huber_threshold", "", atLeast(0), smoother.huber_threshold,
      "A scan with a larger whitened residual counts less (Huber loss). 1 to 2 are typical. 0 switches the "
      "loss off.");
  list.choice<RadarFactor>(
      "radar_factor", {{"velocity", RadarFactor::kVelocity}, {"doppler", RadarFactor::kDoppler}},
      smoother.radar_factor,
      "This says what a scan adds to the window. doppler gives the Doppler of each point, so that scans of a "
      "few points count, too. velocity gives one velocity for the scan, as the paper does, and is faster.");
  list.choice<WindowSolver>("solver", {{"chain", WindowSolver::kChain}, {"ceres", WindowSolver::kCeres}},
                            smoother.solver,
                            "chain uses Gauss-Newton along the chain of states. ceres uses ceres::Solve, "
                            "which gives the same estimate and is slower. Use ceres to check chain.");
  list.integer("max_iterations", between(1, 1000), smoother.max_iterations,
               "The solver stops after this many iterations at each scan. It usually needs one or two. The "
               "diagnostics tell if it often reaches this limit.");
  list.integer(
      "max_queued_scans", atLeast(1), c.odometry.max_queued_scans,
      "This is the largest number of scans that wait for the IMU or for the solver. If one more comes, the "
      "node drops the oldest and counts it as queue_full. Raise it if the IMU arrives in bursts.");
}

void listGate(ParameterList& list, InnovationGateOptions& gate) {
  list.number(
      "innovation_gate", "", atLeast(0), gate.sigmas,
      "A scan is rejected as an outlier if its velocity is farther from the prediction than this many "
      "standard deviations. 3 to 6 are typical. 0 takes every scan.");
  list.number(
      "innovation_model_error", "m/s", between(0, kLargestSigma), gate.model_error,
      "The gate adds this to the standard deviation of the prediction, along each axis. It stands for small "
      "errors of the mounting and of the IMU's scale. Raise it for a platform that is faster than 10 m/s.");
  list.number(
      "innovation_gate_timeout", "s", above(0), gate.timeout,
      "If no scan was used for this time, the gate takes the next scan that has a velocity on which most "
      "points agree. A wrong prediction then cannot lock the radar out.");
}

void listPriors(ParameterList& list, SmootherOptions& smoother) {
  list.number(
      "prior_sigma_yaw", "rad", sigma(M_PI), smoother.prior_sigma_yaw,
      "The yaw of the first state has this standard deviation. It is small, since the first yaw defines the "
      "world frame.");
  list.number(
      "prior_sigma_position", "m", sigma(), smoother.prior_sigma_position,
      "The position of the first state has this standard deviation. It is small, since the first position "
      "defines the world frame.");
  list.number(
      "prior_sigma_velocity", "m/s", sigma(), smoother.prior_sigma_velocity,
      "The velocity of the first state has this standard deviation after a start at rest. Raise it if the "
      "platform sways while it rests, as a boat does.");
  list.number(
      "prior_sigma_gyro_bias", "rad/s", sigma(), smoother.prior_sigma_gyro_bias,
      "The gyro bias of the first state has this standard deviation, in addition to the noise of the mean at "
      "rest. Take the in-run bias stability of the data sheet: 7e-5 is 14 deg/h.");
  list.number(
      "prior_sigma_accel_bias", "m/s^2", sigma(), smoother.prior_sigma_accel_bias,
      "The accelerometer bias of the first state has this standard deviation. Divided by gravity, it is also "
      "the standard deviation of roll and pitch. 0.05 to 0.3 are typical of a MEMS.");
}

void listOffsetSteps(ParameterList& list, OffsetStepDetectorOptions& monitor) {
  list.boolean(
      "time_offset_step_detection", monitor.enabled,
      "The estimator looks for steps of the offset, as after a restart of the driver. After a step it "
      "estimates the offset again. Set it to false if the offset cannot step.");
  list.number(
      "time_offset_step_memory", "s", above(1), monitor.memory,
      "The detector finds steps that came at most this long ago. A longer time finds smaller steps, and "
      "steps in slower motion.");
  list.number(
      "time_offset_step_significance", "", above(0), monitor.significance,
      "The offset has stepped if the scans ask for a change of this many standard deviations. Raise it if "
      "the detector fires without a step.");
  list.number("time_offset_step_min", "s", above(0), monitor.min_change,
              "The detector ignores steps smaller than this. The random walk of the offset follows them.");
}

}  // namespace

void listStart(ParameterList& list, Config& c) {
  StaticInitializerOptions& init = c.odometry.initialization;
  list.group("Initialisation");
  list.first().choice<InitMode>(
      "init_mode", {{"static", InitMode::kStatic}, {"motion", InitMode::kMotion}, {"auto", InitMode::kAuto}},
      c.odometry.init_mode,
      "This is how the estimate starts. static waits for rest, however long. motion starts from radar and "
      "IMU at once, moving or not. auto waits for rest for init_motion_after, and then starts in motion. A "
      "start at rest is the most accurate: let the platform stand for 3 s if you can.");
  list.number(
      "init_motion_after", "s", atLeast(0), c.odometry.init_motion_after,
      "init_mode: auto starts in motion after this time without rest. Lower it for bags that begin in "
      "motion.");
  list.number(
      "init_duration", "s", atLeast(1), init.duration,
      "A start at rest averages the IMU over this time for attitude and gyro bias. 2 to 5 s are typical.");
  list.number(
      "init_max_gyro_std", "rad/s", above(0), init.max_gyro_std,
      "The platform counts as moving if the means of the gyro over 0.1 s scatter more than this on one axis. "
      "An engine that idles hardly moves these means.");
  list.number(
      "init_max_accel_std", "m/s^2", above(0), init.max_accel_std,
      "The platform counts as moving if the means of the accelerometer over 0.1 s scatter more than this on "
      "one axis. An engine that idles hardly moves these means.");
  list.number(
      "init_max_gyro_mean", "rad/s", above(0), init.max_gyro_mean,
      "The platform counts as turning if the mean of the gyro is larger than this in size. Raise it for a "
      "cheap gyro with a larger bias.");
  list.number(
      "init_max_gravity_error", "m/s^2", above(0), init.max_gravity_error,
      "A start at rest is refused if the size of the mean acceleration differs from gravity by more than "
      "this. A larger error means wrong units, or a bad accelerometer.");
  MotionInitializerOptions& motion = c.odometry.motion_initialization;
  list.number(
      "init_motion_window", "s", between(1, 10), motion.window,
      "A start in motion uses the radar velocities of this time. Raise it if the start in motion is often "
      "refused.");
  list.number(
      "init_motion_max_gravity_error", "m/s^2", above(0), motion.max_gravity_error,
      "A start in motion is refused if radar and IMU together show a gravity that is wrong by more than "
      "this. Then the units, the mounting or the Doppler sign are wrong.");
  list.number(
      "init_motion_max_outlier_fraction", "", between(0, 1), motion.max_outlier_fraction,
      "A start in motion is refused if more than this share of the radar velocities does not fit the IMU.");
  list.number(
      "init_motion_sigma_gyro_bias", "rad/s", sigma(), motion.sigma_gyro_bias,
      "A start in motion takes the gyro bias as zero with this standard deviation on each axis. Raise it for "
      "a cheap gyro with a larger bias.");
  list.number(
      "init_motion_sigma_accel_bias", "m/s^2", sigma(), motion.sigma_accel_bias,
      "A start in motion takes the accelerometer bias as zero with this standard deviation on each axis.");

  RestOptions& rest = c.odometry.rest;
  list.group("Rest on the way, as the IMU sees it");
  list.boolean(
      "rest_enabled", rest.enabled,
      "The estimator holds the velocity at zero while the IMU sees rest. Set it to false on a platform that "
      "moves slowly and smoothly, such as a crane.");
  list.number("rest_window", "s", above(0), rest.window,
              "The platform counts as at rest once the IMU has been still for this time.");
  list.number("rest_max_gyro_std", "rad/s", above(0), rest.max_gyro_std,
              "The IMU is still if the gyro scatters less than this on each axis over rest_window.");
  list.number("rest_max_accel_std", "m/s^2", above(0), rest.max_accel_std,
              "The IMU is still if the accelerometer scatters less than this on each axis over rest_window.");
  list.number("rest_max_rate", "rad/s", above(0), rest.max_rate,
              "The IMU is still if the mean of the gyro, without its bias, is smaller than this in size.");
  list.number(
      "rest_max_accel_error", "m/s^2", above(0), rest.max_accel_error,
      "The IMU is still if the mean of the accelerometer, without bias and gravity, is smaller than this in "
      "size.");
  list.number("rest_max_speed", "m/s", above(0), rest.max_speed,
              "If the estimated speed is larger than this, a still IMU shows a smooth ride, not rest.");
  list.number(
      "rest_velocity_sigma", "m/s", sigma(), rest.velocity_sigma,
      "The zero velocity at rest has this standard deviation on each axis. The estimator adds the velocity "
      "that the platform may have gained within rest_window, by the acceleration that the IMU shows. Raise "
      "it for a hand that holds still, or for a platform that may creep by some cm/s.");
}

void listTimeOffset(ParameterList& list, Config& c) {
  SmootherOptions& smoother = c.odometry.smoother;
  list.group("Time offset: a scan stamped s was measured at s - offset");
  list.boolean("estimate_time_offset", smoother.estimate_time_offset,
               "The estimator finds the time offset of the radar on the way. false holds it at "
               "time_offset_initial.");
  list.choice<TimeOffsetModel>(
      "time_offset_model",
      {{"constant_acceleration", TimeOffsetModel::kConstantAcceleration}, {"imu", TimeOffsetModel::kImu}},
      smoother.time_offset_model,
      "imu integrates the IMU over the offset. constant_acceleration takes one acceleration times the "
      "offset, as the paper does, and is for comparison.");
  list.boolean(
      "time_offset_shared", smoother.time_offset_shared,
      "true gives all radars one offset. Use it if one trigger line or one computer stamps all scans. false "
      "gives each radar its own offset.");
  list.ofRadar(true);
  list.first().number(
      "time_offset_initial", "s", anyNumber(), c.odometry.radar.time_offset_initial,
      "The estimate of the offset starts here. A positive offset means that the stamps are late. Set it to "
      "the value that an earlier run or `calibrate` found; zero works for offsets of up to 0.2 s.");
  list.number(
      "time_offset_sigma", "s", sigma(), c.odometry.radar.time_offset_sigma,
      "The estimate of the offset starts with this standard deviation. Lower it after a calibration. Raise "
      "it if you raise max_time_offset.");
  list.ofRadar(false);
  list.number(
      "time_offset_noise", "s/sqrt(s)", sigma(), smoother.time_offset_noise,
      "The offset may wander by this random walk. The estimator raises the random walk if the scans keep "
      "asking for a change, as they do if clocks drift.");
  list.number(
      "time_offset_min_acceleration", "m/s^2", atLeast(0), smoother.time_offset_min_acceleration,
      "A scan informs the offset only if the radar accelerates more than this. It informs the offset less, "
      "or not at all, if noise of the IMU could explain the accelerations of the last 20 s.");
  list.first().number(
      "max_time_offset", "s", above(0, 1), smoother.max_time_offset,
      "The offset cannot exceed this in size. Raise it if a run ends with the offset at this bound; the "
      "buffers grow with it. For a larger delay that you know, use radar_stamp_shift.");
  listOffsetSteps(list, c.odometry.offset_step_detector);
}

void listSmoother(ParameterList& list, Config& c) {
  list.group("Smoother");
  listWindow(list, c);
  listGate(list, c.odometry.innovation_gate);
  listPriors(list, c.odometry.smoother);
}

void listHealthAndLandmarks(ParameterList& list, Config& c) {
  HealthOptions& health = c.odometry.health;
  list.group("Health: ok, coasting or diverged");
  list.choice<OnDivergence>(
      "on_divergence", {{"report", OnDivergence::kReport}, {"reinitialize", OnDivergence::kReinitialize}},
      health.on_divergence,
      "report says that the estimate diverged and goes on. reinitialize also re-initialises velocity and "
      "tilt in motion if the divergence lasts; position and heading go on.");
  list.number(
      "reinitialize_after", "s", atLeast(0), health.reinitialize_after,
      "The estimator re-initialises after this time of divergence. Until then the IMU alone is better than a "
      "radar that contradicts it, as in front of a bus that passes.");
  list.number(
      "divergence_window", "s", above(0, 60), health.window,
      "The health is judged by the scans of this time. With a longer time, a crowd may fill the view for "
      "longer, but a divergence is reported later: after two thirds of this time if all scans contradict "
      "the estimate.");
  list.number(
      "divergence_max_contradiction", "", inside(0, 1), health.max_contradiction,
      "The estimate diverged if the mean contradiction of the scans in divergence_window is larger than "
      "this. The contradiction of a scan is the square of its distance from the prediction, in units of "
      "innovation_gate, and at most 1. It is 0 if no majority of the points agrees.");
  list.number(
      "divergence_max_velocity_sigma", "m/s", above(0), health.max_velocity_sigma,
      "The estimate diverged if the standard deviation of the velocity is larger than this on one axis.");
  list.number(
      "coasting_after", "s", above(0), health.coasting_after,
      "After this time without a used scan the health is coasting: the IMU alone carries the estimate.");

  LandmarkOptions& landmarks = c.odometry.landmarks;
  list.group("Landmarks: static points that come back hold position and heading");
  list.boolean(
      "landmarks", landmarks.enabled,
      "true keeps static detections as points of the world. Position and heading drift less if the points "
      "come back. The map must prove itself first; until then nothing changes. Landmarks cost several times "
      "the computing time. mode: batch solves without them.");
  list.integer("landmarks_max", between(1, 100), landmarks.max_landmarks,
               "The window holds at most this many landmarks at once. The cost grows faster than their "
               "number.");
  list.number("radar_range_sigma", "m", sigma(), landmarks.range_sigma,
              "The range of a point has this noise. Only landmarks use it. If the value is too small, the "
              "map contradicts itself, and the estimator drops the map (landmarks_dropped).");
}

}  // namespace rio_t
