#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <functional>
#include <optional>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// Fills up scans of few points. Three points always agree on some velocity; a consensus needs more.
///
/// A point of an earlier scan has the Doppler d = -u . v. ScanPool adds to it the change of velocity since
/// then, as the IMU predicts it, and the point counts as one of the new scan. Over so short a time the IMU
/// predicts the change well, even if the velocity itself is wrong. Not thread-safe.
class ScanPool {
 public:
  /// Predicted velocity of the radar, in R [m/s], at the measurement of the scan with that stamp.
  using VelocityAt = std::function<std::optional<Eigen::Vector3d>(Time stamp)>;
  /// RANSAC finds the static world in so many points if three in ten are outliers (docs/method.md, 9.9).
  static constexpr std::size_t kEnoughPoints = 20;

  /// [s] Over this time the IMU predicts a change of velocity to some cm/s, even if it vibrates.
  static constexpr double kMaxAge = 0.2;

  /// The points of the scan, followed by the borrowed ones.
  RadarScan filled(const RadarScan& scan, const VelocityAt& velocityAt);

 private:
  std::deque<RadarScan> scans_;
};

/// The scans since the IMU came to rest.
///
/// A platform that creeps leaves most points of a scan in the Doppler bin around zero, and its IMU shows no
/// motion either. Its velocity is the same in all these scans, so their points together show what those of
/// one scan do not. Not thread-safe.
class RestPool {
 public:
  /// [points] They show a creep at a third of a Doppler bin (*ManyPointsTellACreepOfAThirdOfABin*).
  static constexpr std::size_t kMost = 500;

  /// `slow`: see EgoVelocityEstimator::slowPoints.
  void add(const RadarScan& slow);
  /// The points of the scan, followed by those of the newest scans that were added, until there are `enough`.
  RadarScan filled(const RadarScan& scan, std::size_t enough) const;
  Time oldest() const { return scans_.front().stamp; }  ///< stamp of the oldest scan; the pool is not empty

 private:
  std::deque<RadarScan> scans_;
};

}  // namespace rio_t
