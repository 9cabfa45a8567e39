#pragma once

#include <array>
#include <optional>

#include "rio_t/core/time.h"
#include "rio_t/imu/measurement.h"

namespace rio_t {

/// Finds samples at the end of the range of an IMU. Not thread-safe.
///
/// If the options do not give the range, a flat top shows it. An axis then reads its largest value of the
/// last second or two, of either sign, five times in a row, far from its first reading. It reached this value
/// by a large step: at the smooth top of a swing, a fast IMU repeats a reading, too, but reaches it by small
/// steps. The value is the end of the range until a sample exceeds it.
class SaturationDetector {
 public:
  /// Largest readings [m/s^2, rad/s]; 0: not known.
  SaturationDetector(double accel_range, double gyro_range);
  struct Saturated {
    bool accel = false, gyro = false;
  };
  Saturated check(const ImuMeasurement& imu);

 private:
  struct Axis {
    std::optional<double> first, last, limit;
    double largest = 0.0, largest_before = 0.0;  ///< of |reading|, in this stretch and the one before
    Time stretch_since;
    int repeated = 0;                     ///< the last reading
    std::optional<double> smallest_step;  ///< from a reading to another one
    bool is_steep = false;                ///< the step to the last reading
    bool isSaturated(Time time, double reading, double range, double far_from_first);
    void follow(double reading);
  };

  double accel_range_, gyro_range_;  // read-only after construction
  std::array<Axis, 6> axes_;         ///< accelerometer, gyro
};

}  // namespace rio_t
