#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "rio_t/core/sliding_queue.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// Fills up scans of few points. Three points always agree on some velocity; a consensus needs more.
///
/// A point of an earlier scan has the Doppler d = -u . v. It counts as a point of the new scan if its Doppler
/// is changed by what the velocity changed since then, as the IMU predicts it: over so short a time, that is
/// right even where the velocity itself is wrong. Not thread-safe.
class ScanPool {
 public:
  /// Predicted velocity of the radar, in R [m/s], at the measurement of the scan with that stamp.
  using VelocityAt = std::function<std::optional<Eigen::Vector3d>(Time stamp)>;

  /// [s] The IMU predicts a change of velocity over this time to some cm/s, also where it vibrates.
  static constexpr double kMaxAge = 0.2;

  /// The points of the scan, followed by those borrowed.
  RadarScan filled(const RadarScan& scan, const VelocityAt& velocityAt);
  void clear() { scans_.clear(); }

 private:
  SlidingQueue<RadarScan> scans_;
};

}  // namespace rio_t
