#pragma once

#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "rio_t/inspection/inertial_track.h"
#include "rio_t/inspection/radar_velocities.h"

namespace rio_t {

/// [s] The search tries offsets up to this, to either side: slightly more than the default max_time_offset.
inline constexpr double kMaxSearchedOffset = 0.3;

struct MountingSearchOptions {
  double accel_density = 0.02;  ///< [m/s^2/sqrt(Hz)] white noise of the accelerometer, vibration included
  /// Gravity in G from a rest [m/s^2], and the end of this rest; the gyro carries it on. Without a rest, the
  /// mean of the specific force gives gravity.
  std::optional<Eigen::Vector3d> gravity_G;
  Time rest_end;
  /// The sign that the ranges show (DopplerSign); 0: none.
  int sign_from_ranges = 0;
  /// The direction that points up in I, at rest or on average. Without it, all mountings are equally likely a
  /// priori.
  std::optional<Eigen::Vector3d> up_I;
};

/// The mounting of a radar, as a recording shows it.
struct MountingSearch {
  bool enough = false;  ///< whether there was enough motion to look at; if not, the rest is empty

  /// v_I = sign q_IR v_R - omega x l, with q_IR a rotation.
  int sign = 1;
  /// How clearly the IMU shows the sign: by this much, the best mounting with the other sign fits worse
  /// [sigma^2].
  double sign_significance = 0.0;
  /// Ranges and IMU show contrary signs: one axis of the cloud is inverted, or two are swapped, or the
  /// accelerometer is negated.
  bool mirrored = false;
  Eigen::Quaterniond q_IR = Eigen::Quaterniond::Identity();
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();   ///< [rad] about the axes of I; pi: not observed
  Eigen::Vector3d lever_arm_I = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Vector3d lever_arm_sigma = Eigen::Vector3d::Zero();  ///< [m]
  double offset = 0.0;        ///< [s] a scan stamped s was measured at s - offset
  double offset_sigma = 0.0;  ///< [s]
};

/// Searches mounting, sign of the Doppler and time offset, coarsely, over all rotations, signs and offsets.
///
/// Fits M (the rotation), lever arm, and per window a velocity and gravity, by linear least squares. Method:
/// docs/method.md, section 15.
MountingSearch searchMounting(const std::vector<RadarVelocity>& velocities, const InertialTrack& track,
                              const MountingSearchOptions& options);

/// The 24 rotations that map axes to axes.
const std::array<Eigen::Matrix3d, 24>& axisTurns();

}  // namespace rio_t
