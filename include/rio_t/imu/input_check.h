#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/imu/clock_jump_detector.h"
#include "rio_t/imu/gap_bridge.h"
#include "rio_t/imu/measurement.h"
#include "rio_t/imu/noise.h"
#include "rio_t/imu/noise_meter.h"
#include "rio_t/imu/saturation_detector.h"
#include "rio_t/imu/stuck_axis_detector.h"

namespace rio_t {

struct ImuInputCheckOptions {
  double max_bridged_gap = 3.0;  ///< [s] the estimate starts again after a longer gap
  double jump_patience = 0.5;    ///< [s] of stamps at another time, after which the clock has jumped
  double accel_range = 0.0;      ///< [m/s^2] largest reading of an axis; 0: found from flat tops
  double gyro_range = 0.0;       ///< [rad/s] likewise
  /// Motion that the IMU misses in gaps and beyond its range, as white noise. For people and drones.
  double unseen_accel_density = 2.0;  ///< [m/s^2/sqrt(Hz)]
  double unseen_gyro_density = 0.5;   ///< [rad/s/sqrt(Hz)]
};

/// White noise of the IMU, measured from its samples, vibration included: densities of the noisiest axis.
struct MeasuredImuNoise {
  double accel_density = 0.0;  ///< [m/s^2/sqrt(Hz)]
  double gyro_density = 0.0;   ///< [rad/s/sqrt(Hz)]

  /// Whether a density is more than three times the configured one. A sensible configuration is nearer.
  bool isFarAbove(const ImuNoise& configured) const {
    return accel_density > 3.0 * configured.accel_density || gyro_density > 3.0 * configured.gyro_density;
  }
};

/// Decides which IMU samples the estimator takes, and after which of them it starts again. ImuInputCheck uses
/// it. Code outside the odometry that needs the same decisions has its own instance. Not thread-safe.
class ImuSampleCheck {
 public:
  struct Verdict {
    /// Why the sample is dropped; null: it is taken. "imu_not_finite" or "imu_not_plausible" by its values,
    /// whatever its stamp; "imu_repeated" by those of the sample before; "imu_out_of_order" or
    /// "imu_stamp_jump" by its stamp.
    const char* fault = nullptr;
    bool repeats = false;        ///< the sample is the one before, with a new stamp
    bool is_restart = false;     ///< the clock jumped, or the gap was too long: forget all before
    double stepped_back = 0.0;   ///< [s] by which the clock had stepped back before this sample
    std::optional<Time> before;  ///< stamp of the newest sample taken before; none for the first sample
    // Set only at a restart:
    std::map<std::string, std::uint64_t> dropped = {};  ///< samples since `before`, by fault
    /// No stamp jumped: samples came all the time, but none of them could be used.
    bool stamps_went_on = false;
  };

  explicit ImuSampleCheck(const ImuInputCheckOptions& options);
  Verdict check(const ImuMeasurement& imu);

 private:
  /// Why the sample is dropped by its values; null: it is not.
  const char* faultOfValues(const ImuMeasurement& imu) const;
  /// Whether the sample is the one before once more, with a new stamp.
  bool repeats(const ImuMeasurement& imu);

  double most_acceleration_, most_rate_, max_gap_;  // [m/s^2], [rad/s], [s] read-only after construction
  ClockJumpDetector stamps_;
  std::optional<ImuMeasurement> distinct_;        // the newest that did not repeat the one before
  std::optional<Time> latest_;                    // stamp of the last sample, dropped or not
  std::map<std::string, std::uint64_t> dropped_;  // since the newest sample that was taken
  double longest_step_ = 0.0;                     // [s] from one stamp to the next, since that sample
};

/// Checks IMU samples. It drops those that cannot be used, writes into the others how much of the motion they
/// miss, and bridges gaps. Not thread-safe.
///
/// A signal with the correlation time tau deviates far less from the straight line over a gap of T << tau
/// than over a long one. So the density of a gap is the full one times min(1, T / kMotionCorrelationTime).
class ImuInputCheck {
 public:
  struct Verdict {
    ImuSampleCheck::Verdict sample = {};
    /// Snake case: "imu_not_finite", "imu_not_plausible", "imu_repeated", "imu_out_of_order",
    /// "imu_stamp_jump", "imu_clock_restart", "imu_clock_back", "imu_gap", "imu_saturated", "imu_stuck".
    std::vector<const char*> faults = {};
    /// Samples to take first: they stand for a gap before this sample.
    std::vector<ImuMeasurement> bridge = {};
  };

  /// `max_gap` [s] between samples: a longer gap is reported and bridged.
  ImuInputCheck(double max_gap, const ImuInputCheckOptions& options);
  /// Checks `imu`. If it is taken, sets its noise with the unseen motion, and replaces a stuck reading.
  Verdict check(ImuMeasurement& imu);
  MeasuredImuNoise noise() const;

 private:
  /// Adds to the sample the variance of the motion that is lost because the clock stepped back before it.
  /// `dt` [s]: since the sample before.
  void addLostMotion(double dt, ImuMeasurement& imu) const;
  /// Whether an axis of the accelerometer is frozen.
  bool findFrozen(const ImuMeasurement& imu, bool turns);
  /// Replaces the readings of stuck axes of the gyro. Returns whether there were any.
  bool replaceStuck(ImuMeasurement& imu, bool turns, bool is_saturated);

  double max_gap_;  // read-only after construction, as the next
  ImuInputCheckOptions options_;
  ImuSampleCheck samples_;
  SaturationDetector saturation_;
  std::array<FrozenAxisDetector, 3> accel_axes_;
  std::array<StuckAxisDetector, 3> gyro_axes_;
  GapBridge bridge_;
  NoiseSpectrum accel_noise_, gyro_noise_;
  SaturationDetector::Saturated hidden_before_;  // whether the sample before hid motion
};

}  // namespace rio_t
