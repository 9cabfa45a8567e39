#pragma once

#include <cstddef>
#include <deque>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// The scans since the IMU came to rest.
///
/// A platform that creeps leaves most points of a scan in the Doppler bin around zero, and its IMU shows no
/// motion either. Its velocity is the same in all these scans, so their points tell together what those of
/// one scan do not. Not thread-safe.
class RestPool {
 public:
  /// [points] They show a creep at a third of a Doppler bin (*ManyPointsTellACreepOfAThirdOfABin*).
  static constexpr std::size_t kMost = 500;

  /// `slow`: a scan without the points that no platform at rest sees.
  void add(const RadarScan& slow);
  /// The points of the scan, followed by those of the newest scans that were added, until there are `enough`.
  RadarScan filled(const RadarScan& scan, std::size_t enough) const;
  Time oldest() const { return scans_.front().stamp; }  ///< stamp of the oldest scan; the pool is not empty

 private:
  std::deque<RadarScan> scans_;
};

}  // namespace rio_t
