#include <cmath>

#include "parameter_sections.h"
#include "rio_t/radar/doppler_grid.h"
#include "rio_t/radar/scan.h"

namespace rio_t {
namespace {

void listPointFilter(ParameterList& list, EgoVelocityOptions& radar) {
  list.number("radar_min_range", "m", atLeast(0), radar.min_range,
              "Points nearer than this are left out. Raise it if the radar sees its own platform.");
  list.number("radar_max_range", "m", above(0), radar.max_range,
              "Points farther than this are left out. Lower it if far points are mostly ghosts.");
  list.first().number(
      "radar_min_snr_db", "dB", anyNumber(), radar.min_snr_db,
      "Points with a weaker signal to noise than this are left out. 3 to 10 dB are typical. Lower it if too "
      "few points are left. Raise it in clutter. If it removes almost all points, the preset reads the power "
      "in the wrong unit: see radar_power_unit.");
  list.number(
      "radar_max_azimuth", "rad", above(0, M_PI), radar.max_azimuth,
      "Points farther than this to either side of forward are left out. Lower it if points at the edge of "
      "the view are bad. Raise it above 1.57 only for a radar that sees behind itself.");
  list.number(
      "radar_max_elevation", "rad", above(0, M_PI / 2), radar.max_elevation,
      "Points higher or lower than this are left out. Lower it if points at the edge of the view are bad.");
}

void listStandstill(ParameterList& list, EgoVelocityOptions& radar) {
  list.number("zero_velocity_threshold", "m/s", atLeast(0), radar.zero_velocity_threshold,
              "A Doppler smaller than this counts as zero in the test for standstill. 0 means half of "
              "radar_doppler_step, or 1.5 radar_doppler_sigma if that is more.");
  list.number("zero_velocity_outlier_fraction", "", below(0, 1), radar.zero_velocity_outlier_fraction,
              "A scan counts as standstill if at most this share of its Dopplers is larger than "
              "zero_velocity_threshold. Raise it if many things move around a platform that stands.");
  list.number(
      "zero_velocity_sigma", "m/s", sigma(), radar.zero_velocity_sigma,
      "The velocity of a scan at standstill has this standard deviation per axis. The estimator adds the "
      "motion that a step of the Doppler can hide.");
}

void listConsensus(ParameterList& list, EgoVelocityOptions& radar) {
  list.number(
      "ransac_inlier_threshold", "m/s", atLeast(0), radar.ransac_inlier_threshold,
      "A point is an inlier if its Doppler differs from that of a static point by less than this. 0 means "
      "half of radar_doppler_step plus 2.5 radar_doppler_sigma.");
  list.number(
      "ransac_outlier_probability", "", below(0, 1), radar.ransac_outlier_probability,
      "RANSAC expects this share of outliers. A larger share takes more draws: 0.6 takes almost four times "
      "as many as 0.4. Raise it in crowds and heavy clutter.");
  list.number(
      "ransac_success_probability", "", inside(0, 1), radar.ransac_success_probability,
      "With this probability, at least one draw of RANSAC has only inliers. There is seldom a reason to "
      "change it.");
  list.number(
      "ego_velocity_prior_gate", "", above(0), radar.prior_gate,
      "A velocity contradicts the prediction of the IMU if the two are more than this many standard "
      "deviations apart. The estimator then prefers the points that agree with the prediction, for example "
      "beside a bus that moves.");
  list.integer("ransac_seed", atLeast(0), radar.ransac_seed,
               "Each scan restarts the random generator with this seed, so that the same scan gives the same "
               "velocity. Change it only to see how much the draws matter.");
  list.integer(
      "ego_velocity_min_inliers", atLeast(3), radar.min_inliers,
      "A velocity needs at least this many inliers. Three determine it, and the others confirm it. With "
      "radar_factor: doppler, a scan with fewer points still counts point by point.");
  list.number(
      "ego_velocity_min_inlier_fraction", "", between(0, 1), radar.min_inlier_fraction,
      "A velocity needs at least this share of the points as inliers, since fewer can agree by chance. Lower "
      "it with care if most points are clutter.");
  list.number(
      "ego_velocity_prior_min_inlier_fraction", "", between(0, 1), radar.prior_min_inlier_fraction,
      "If the velocity of the majority contradicts the IMU, and this share of the points agrees with "
      "the IMU, the estimator takes these. ego_velocity_min_inlier_fraction holds for them, too: with "
      "fewer, the scan gives no velocity.");
}

void listPointNoise(ParameterList& list, EgoVelocityOptions& radar) {
  list.choice<EgoVelocitySolver>(
      "ego_velocity_solver",
      {{"ls", EgoVelocitySolver::kLeastSquares}, {"eiv", EgoVelocitySolver::kErrorsInVariables}},
      radar.solver,
      "ls solves for the velocity by plain least squares. eiv (errors in variables) weighs each point by the "
      "noise of its direction and removes the bias that this noise causes. ls is for comparison.");
  list.number(
      "radar_azimuth_sigma", "rad", below(0, 0.5), radar.azimuth_sigma,
      "The azimuth of a point has this noise at the start. eiv learns it on the way. 0.02 to 0.05 rad are "
      "typical of small radars.");
  list.number(
      "radar_elevation_sigma", "rad", below(0, 0.5), radar.elevation_sigma,
      "The elevation of a point has this noise at the start. eiv learns it on the way. 0.03 to 0.1 rad are "
      "typical of small radars, which have few antennas above each other.");
  list.number("radar_doppler_sigma", "m/s", between(0, kLargestSigma), radar.doppler_sigma,
              "The Doppler of a point has this noise at the start, in addition to the rounding to "
              "radar_doppler_step. eiv learns it on the way.");
  list.number(
      "radar_doppler_span", "m/s", zeroOr(DopplerGrid::kLeastStep, 2.0 * kLargestDoppler), radar.doppler_span,
      "The radar measures Dopplers over this span, from the lowest to the highest. A faster point appears at "
      "the other end of the span (aliasing). 0 reads the span off the data. Set it if you know it and drive "
      "faster than half of it.");
  list.number(
      "radar_doppler_step", "m/s", between(0, DopplerGrid::kLargestStep), radar.doppler_quantization,
      "The radar gives the Doppler in steps of this size. 0 reads it off the data. Any other value below "
      "0.02 means no steps. Set it if you know it and the bag is short.");
  list.vector3(
      "ego_velocity_added_sigma", "m/s", between(0, kLargestSigma), radar.added_sigma,
      "The estimator adds this standard deviation (right, forward, up) in quadrature to that of the velocity "
      "of a scan. It stands for errors that the points share, such as multipath and slow objects. This is "
      "the start value: the estimator scales it by what the scans show.");
  list.number(
      "ego_velocity_max_condition_number", "", above(1), radar.max_condition_number,
      "This bounds two condition numbers: that of H'H, with the unit directions of the inliers as the rows "
      "of H, and that of the information of the velocity. A scan above it is rejected, for example if all "
      "points lie in one direction.");
  list.number(
      "ego_velocity_max_sigma", "m/s", above(0), radar.max_sigma,
      "A scan in motion is rejected if the standard deviation of its velocity is larger than this along any "
      "axis.");
}

}  // namespace

void listImu(ParameterList& list, Config& c) {
  list.group("IMU");
  list.choice<AccelerationUnit>(
      "imu_acceleration_unit",
      {{"m/s2", AccelerationUnit::kMetresPerSecondSquared}, {"g", AccelerationUnit::kStandardGravity}},
      c.imu_units.acceleration,
      "This is the unit of linear_acceleration in the messages. sensor_msgs/Imu asks for m/s2. Some drivers "
      "write g: then the acceleration at rest has a size of 1.");
  list.choice<RateUnit>(
      "imu_rate_unit", {{"rad/s", RateUnit::kRadiansPerSecond}, {"deg/s", RateUnit::kDegreesPerSecond}},
      c.imu_units.rate,
      "This is the unit of angular_velocity in the messages. sensor_msgs/Imu asks for rad/s. Some "
      "drivers write deg/s.");
  list.number("gravity", "m/s^2", between(9.5, 10.0), c.odometry.gravity,
              "This is the size of gravity at your place: 9.78 at the equator, 9.83 at the poles.");
  list.first().number(
      "imu_accel_noise_density", "m/s^2/sqrt(Hz)", above(0, 10), c.odometry.imu_noise.accel_density,
      "This is the white noise of the accelerometer, from its data sheet or an Allan plot. 0.001 to 0.02 are "
      "typical. This is the start value: the estimator takes more if the samples or the radar show more. A "
      "value two or three times that of the data sheet is a good choice.");
  list.first().number(
      "imu_gyro_noise_density", "rad/s/sqrt(Hz)", above(0, 1), c.odometry.imu_noise.gyro_density,
      "This is the white noise of the gyro, from its data sheet or an Allan plot. 0.00005 to 0.001 "
      "are typical. The estimator takes more if the samples show more.");
  list.number(
      "imu_accel_random_walk", "m/s^3/sqrt(Hz)", above(0, 1), c.odometry.imu_noise.accel_random_walk,
      "The bias of the accelerometer wanders by this random walk. Raise it if the biases cannot follow, for "
      "example while the IMU warms up.");
  list.number(
      "imu_gyro_random_walk", "rad/s^2/sqrt(Hz)", above(0, 0.1), c.odometry.imu_noise.gyro_random_walk,
      "The bias of the gyro wanders by this random walk. Raise it if the biases cannot follow, for example "
      "while the IMU warms up.");
  list.number("imu_gyro_scale_error", "", between(0, 1), c.odometry.imu_noise.gyro_scale_error,
              "The rates of the gyro are too large or too small by this share (sigma). A third of the "
              "tolerance in the data sheet is a good choice: 0.003 for the 1 % of most MEMS gyros. 0 is for "
              "a gyro whose scale was calibrated.");

  ImuInputCheckOptions& gate = c.odometry.imu_input_check;
  list.group("Gaps of the sensors");
  list.number(
      "max_imu_gap", "s", above(0), c.odometry.max_imu_gap,
      "A longer gap between IMU samples is counted as imu_gap, and the uncertainty grows over it. Set it to "
      "three or four sample periods. Raise it for an IMU below 100 Hz.");
  list.number("max_bridged_imu_gap", "s", above(0, 60), gate.max_bridged_gap,
              "The estimate starts again after a longer gap, or if the stamps of the IMU run back.");
  list.number(
      "imu_jump_patience", "s", above(0), gate.jump_patience,
      "The estimator drops IMU samples whose stamps jump ahead or run back. If such samples go on for this "
      "time, the clock has jumped, and the estimate starts again. After a gap longer than this, the first "
      "sample is dropped, too. Keep it above ten sample periods.");
  list.number(
      "imu_accel_range", "m/s^2", atLeast(0), gate.accel_range,
      "This is the largest reading of the accelerometer on one axis. A sample at this value is clipped and "
      "counts less. 0 finds the range from flat tops in the data. If the data sheet says 16 g, set 156.9.");
  list.number(
      "imu_gyro_range", "rad/s", atLeast(0), gate.gyro_range,
      "This is the largest reading of the gyro on one axis. A sample at this value is clipped and counts "
      "less. 0 finds the range from flat tops in the data. If the data sheet says 2000 deg/s, set 34.9.");
  list.number(
      "imu_unseen_accel_density", "m/s^2/sqrt(Hz)", above(0, 100), gate.unseen_accel_density,
      "This noise stands for the acceleration that the IMU does not see, in gaps and beyond its range. The "
      "default suits people and drones. Lower it for a slow vehicle.");
  list.number(
      "imu_unseen_gyro_density", "rad/s/sqrt(Hz)", above(0, 10), gate.unseen_gyro_density,
      "This noise stands for the rotation that the IMU does not see: in gaps, beyond its range, and while an "
      "axis sticks. The default suits people and drones. Lower it for a slow vehicle.");
  list.number(
      "max_radar_gap", "s", above(0), c.odometry.max_radar_gap,
      "A longer time without a scan is counted as radar_gap. Raise it for a radar that sends fewer than five "
      "scans a second.");
}

void listRadar(ParameterList& list, Config& c) {
  EgoVelocityOptions& radar = c.odometry.radar.ego_velocity;
  list.group("Radar: which points count, and the velocity from them");
  list.ofRadar(true);
  listPointFilter(list, radar);
  listStandstill(list, radar);
  listConsensus(list, radar);
  listPointNoise(list, radar);
}

}  // namespace rio_t
