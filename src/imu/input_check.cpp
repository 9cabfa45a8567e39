#include "rio_t/imu/input_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace rio_t {
namespace {

/// [m/s^2] 200 g: no IMU for navigation reads more.
constexpr double kImpossibleAcceleration = 2000.0;
/// [rad/s] 20 000 degrees/s: the range of the fastest gyros on the market.
constexpr double kImpossibleRate = 350.0;
/// [ranges] No IMU reads more than twice its range. The configured range may be rounded.
constexpr double kImpossibleShareOfRange = 2.0;

/// The largest reading that is plausible.
double mostPlausible(double range, double if_unknown) {
  return range > 0.0 ? kImpossibleShareOfRange * range : if_unknown;
}

void raise(double& variance, double density) { variance = std::max(variance, density * density); }

}  // namespace

ImuSampleCheck::ImuSampleCheck(const ImuInputCheckOptions& options)
    : most_acceleration_(mostPlausible(options.accel_range, kImpossibleAcceleration)),
      most_rate_(mostPlausible(options.gyro_range, kImpossibleRate)),
      max_gap_(options.max_bridged_gap),
      stamps_(options.max_bridged_gap, options.jump_patience) {}

const char* ImuSampleCheck::faultOfValues(const ImuMeasurement& imu) const {
  if (!imu.angular_velocity.allFinite() || !imu.acceleration.allFinite()) return "imu_not_finite";
  const bool is_plausible = imu.acceleration.cwiseAbs().maxCoeff() <= most_acceleration_ &&
                            imu.angular_velocity.cwiseAbs().maxCoeff() <= most_rate_;
  return is_plausible ? nullptr : "imu_not_plausible";
}

// If the IMU turns, gravity moves in it, so no two samples are the same. At rest an IMU without noise, as in
// some simulators, repeats itself.
bool ImuSampleCheck::repeats(const ImuMeasurement& imu) {
  const bool is_new = !distinct_ || distinct_->angular_velocity != imu.angular_velocity ||
                      distinct_->acceleration != imu.acceleration;
  if (is_new) distinct_ = imu;
  return !is_new && distinct_->time < imu.time && imu.angular_velocity.norm() > kTurns;
}

ImuSampleCheck::Verdict ImuSampleCheck::check(const ImuMeasurement& imu) {
  Verdict verdict;
  verdict.before = stamps_.newest();
  if (latest_) longest_step_ = std::max(longest_step_, imu.time - *latest_);
  latest_ = imu.time;
  verdict.fault = faultOfValues(imu);
  if (verdict.fault == nullptr && repeats(imu)) {
    verdict.repeats = true;
    // Up to this time, a bridged gap is better than the repeated values. Afterwards they are taken: the IMU
    // of a simulator may repeat itself for ever.
    if (imu.time - distinct_->time < kMotionCorrelationTime) verdict.fault = "imu_repeated";
  }
  if (verdict.fault == nullptr) {
    const ClockJumpDetector::Verdict stamp = stamps_.check(imu.time);
    if (stamp == ClockJumpDetector::Verdict::kBehind) verdict.fault = "imu_out_of_order";
    if (stamp == ClockJumpDetector::Verdict::kAhead) verdict.fault = "imu_stamp_jump";
    verdict.is_restart = stamp == ClockJumpDetector::Verdict::kRestart;
    verdict.stepped_back = stamps_.steppedBack();
  }
  if (verdict.fault != nullptr) {
    ++dropped_[verdict.fault];
    return verdict;
  }
  if (verdict.is_restart) {
    verdict.stamps_went_on = *verdict.before < imu.time && longest_step_ <= max_gap_;
    verdict.dropped = std::move(dropped_);
  }
  dropped_.clear();
  longest_step_ = 0.0;
  return verdict;
}

ImuInputCheck::ImuInputCheck(double max_gap, const ImuInputCheckOptions& options)
    : max_gap_(max_gap),
      options_(options),
      samples_(options),
      saturation_(options.accel_range, options.gyro_range) {}

ImuInputCheck::Verdict ImuInputCheck::check(ImuMeasurement& imu) {
  Verdict verdict{samples_.check(imu)};
  const ImuSampleCheck::Verdict& sample = verdict.sample;
  if (sample.fault != nullptr) {
    verdict.faults = {sample.fault};
    return verdict;
  }
  if (sample.is_restart) {
    verdict.faults = {"imu_clock_restart"};
    bridge_.reset();
    accel_axes_ = {};
    gyro_axes_ = {};
    accel_noise_.interrupt();
    gyro_noise_.interrupt();
  }
  const double gap = sample.before && !sample.is_restart ? imu.time - *sample.before : 0.0;
  if (gap > max_gap_) {
    verdict.faults.push_back("imu_gap");
    const double share = std::min(1.0, gap / kMotionCorrelationTime);
    raise(imu.unseen_gyro_variance, share * options_.unseen_gyro_density);
    raise(imu.unseen_accel_variance, share * options_.unseen_accel_density);
  }
  imu.lost_time = sample.stepped_back;
  if (imu.lost_time > 0.0) {
    verdict.faults.push_back("imu_clock_back");
    addLostMotion(gap, imu);
  }
  // A saturated sample hides motion in the intervals before and after it. So does a repeat that is taken.
  const SaturationDetector::Saturated hidden =
      sample.repeats ? SaturationDetector::Saturated{true, true} : saturation_.check(imu);
  if (hidden.accel || hidden.gyro)
    verdict.faults.push_back(sample.repeats ? "imu_repeated" : "imu_saturated");
  if (hidden.gyro || hidden_before_.gyro) raise(imu.unseen_gyro_variance, options_.unseen_gyro_density);
  if (hidden.accel || hidden_before_.accel) raise(imu.unseen_accel_variance, options_.unseen_accel_density);
  hidden_before_ = hidden;
  const bool turns = imu.angular_velocity.norm() > kTurns;
  const bool accel_sticks = findFrozen(imu, turns) && !hidden.accel;
  const bool gyro_sticks = replaceStuck(imu, turns, hidden.gyro);
  if (accel_sticks || gyro_sticks) verdict.faults.push_back("imu_stuck");
  if (accel_sticks) raise(imu.unseen_accel_variance, options_.unseen_accel_density);
  if (gyro_sticks) raise(imu.unseen_gyro_variance, options_.unseen_gyro_density);
  // Motion over a long gap would look like noise.
  if (hidden.accel || hidden.gyro || accel_sticks || gyro_sticks || gap > kMotionCorrelationTime ||
      imu.lost_time > 0.0) {
    accel_noise_.interrupt();
    gyro_noise_.interrupt();
  } else {
    imu.unseen_accel_variance =
        std::max(imu.unseen_accel_variance, accel_noise_.add(imu.time, imu.acceleration));
    imu.unseen_gyro_variance =
        std::max(imu.unseen_gyro_variance, gyro_noise_.add(imu.time, imu.angular_velocity));
  }
  imu.accel_noise = accel_noise_.squaredDensity();
  imu.gyro_noise = gyro_noise_.squaredDensity();
  imu.accel_mean_noise = accel_noise_.squaredDensityOfMeans();
  imu.gyro_mean_noise = gyro_noise_.squaredDensityOfMeans();
  if (gap > max_gap_) verdict.bridge = bridge_.until(imu);
  bridge_.follow(imu);
  return verdict;
}

MeasuredImuNoise ImuInputCheck::noise() const {
  return {std::sqrt(accel_noise_.squaredDensity()), std::sqrt(gyro_noise_.squaredDensity())};
}

// The motion in the lost time is about that of this sample, and deviates from it as over a gap. No interval
// covers the lost time, so the motion counts, too, and not only the deviation.
void ImuInputCheck::addLostMotion(double dt, ImuMeasurement& imu) const {
  const double lost = imu.lost_time;
  const double share = std::min(1.0, lost / kMotionCorrelationTime);
  const auto density = [&](double rate, double unseen) {
    return std::sqrt((rate * rate * lost + share * share * unseen * unseen) * lost / dt);
  };
  raise(imu.unseen_gyro_variance, density(imu.angular_velocity.norm(), options_.unseen_gyro_density));
  raise(imu.unseen_accel_variance,
        density((imu.acceleration - bridge_.gravity()).norm(), options_.unseen_accel_density));
}

bool ImuInputCheck::findFrozen(const ImuMeasurement& imu, bool turns) {
  bool is_frozen = false;
  for (int k = 0; k < 3; ++k)  // each axis must see each sample
    is_frozen |= accel_axes_[static_cast<std::size_t>(k)].isFrozen(imu.time, imu.acceleration[k], turns);
  return is_frozen;
}

bool ImuInputCheck::replaceStuck(ImuMeasurement& imu, bool turns, bool is_saturated) {
  bool is_stuck = false;
  for (int k = 0; k < 3; ++k) {
    const std::optional<double> likely =
        gyro_axes_[static_cast<std::size_t>(k)].check(imu.time, imu.angular_velocity[k], turns, is_saturated);
    if (!likely) continue;
    imu.angular_velocity[k] = *likely;
    is_stuck = true;
  }
  return is_stuck;
}

}  // namespace rio_t
