#include "rio_t/inspection/imu_report.h"

#include <algorithm>
#include <cmath>

#include "rio_t/core/quantile.h"
#include "rio_t/core/so3.h"
#include "rio_t/imu/input_check.h"
#include "rio_t/imu/noise_meter.h"
#include "rio_t/imu/saturation_detector.h"
#include "rio_t/imu/static_initializer.h"

namespace rio_t {
namespace {

using Eigen::Vector3d;

constexpr double kGravity = 9.81;    // [m/s^2]
constexpr double kMeanWidth = 0.2;   // [s] over which a direction of gravity is averaged, at least
constexpr std::size_t kApart = 3;    // [means] between two directions that are compared: about 0.6 s
constexpr double kFastest = 9.0;     // [rad/s] 500 deg/s: no platform turns faster for a tenth of the time
constexpr double kLeastTilt = 0.03;  // [rad] rms of gravity's turns in 0.6 s; less does not show the unit

/// Means of the specific force over steps of `kMeanWidth` (a slow IMU has slightly longer steps), and the
/// gyro's rotation from each step to the next.
struct Steps {
  std::vector<Vector3d> force;
  /// Integral of the rates, as written, between the middles of neighbouring steps.
  std::vector<Vector3d> turn;
};

Steps stepsOf(const std::vector<ImuMeasurement>& imu) {
  Steps steps;
  Vector3d force = Vector3d::Zero(), rate = Vector3d::Zero();
  std::vector<Vector3d> rates;
  std::vector<Time> middles;
  double count = 0.0, times = 0.0;  // times: sum, from `begin` on
  Time begin = imu.front().time;
  for (const ImuMeasurement& sample : imu) {
    if (sample.time - begin > kMeanWidth && count > 0.0) {
      steps.force.emplace_back(force / count);
      rates.emplace_back(rate / count);
      middles.push_back(begin + times / count);
      force.setZero();
      rate.setZero();
      count = times = 0.0;
      begin = sample.time;
    }
    force += sample.acceleration;
    rate += sample.angular_velocity;
    times += sample.time - begin;
    count += 1.0;
  }
  for (std::size_t i = 0; i + 1 < rates.size(); ++i)
    steps.turn.emplace_back(0.5 * (middles[i + 1] - middles[i]) * (rates[i] + rates[i + 1]));
  return steps;
}

/// Sum of squares of the changes of the specific force that the rates, times `scale`, do not explain.
double misfit(const Steps& steps, double scale) {
  double sum = 0.0;
  for (std::size_t i = 0; i + kApart < steps.force.size(); ++i) {
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    for (std::size_t k = i; k < i + kApart; ++k) turn = turn * so3::exp(scale * steps.turn[k]);
    // In the IMU frame, a force that is constant in the world turns the other way.
    sum += std::min((steps.force[i + kApart] - turn.conjugate() * steps.force[i]).squaredNorm(), 25.0);
  }
  return sum;
}

void findAccelerationUnit(double least_norm, ImuReport* report) {
  const double norm = report->written_norm;
  // The smallest norms show gravity, in m/s^2 or in g.
  if (least_norm < 0.5 && norm < 8.0) {
    report->acceleration_fault =
        "gravity is missing: the acceleration at rest is near zero, and rio_t needs the raw specific force";
    return;
  }
  if (norm > 8.0 && norm < 12.0) return;
  if (norm > 0.8 && norm < 1.2) {
    report->units.acceleration = AccelerationUnit::kStandardGravity;
  } else {
    report->acceleration_fault = "the acceleration is neither in m/s^2 (9.81) nor in g (1)";
  }
}

/// `fast`: |angular velocity| that nine in ten samples do not exceed.
void findRateUnit(const std::vector<ImuMeasurement>& imu, double fast, ImuReport* report) {
  const Steps steps = stepsOf(imu);
  if (steps.force.size() < 10) return;
  const double degrees = inRadiansPerSecond(RateUnit::kDegreesPerSecond);
  const double still = misfit(steps, 0.0);
  const double as_radians = misfit(steps, 1.0), as_degrees = misfit(steps, degrees);
  const double least = std::min(as_radians, as_degrees);
  const double pairs = static_cast<double>(steps.force.size());
  const bool turns = still / pairs > std::pow(kGravity * kLeastTilt, 2);  // enough to show the unit
  const bool are_degrees = turns && least < 0.7 * still ? as_degrees < as_radians : fast > kFastest;
  if (are_degrees) report->units.rate = RateUnit::kDegreesPerSecond;
  const double scale = are_degrees ? degrees : 1.0;
  const double right = misfit(steps, scale), inverted = misfit(steps, -scale);
  if (turns && inverted < 0.5 * right && inverted < 0.7 * still)
    report->rate_fault =
        "gyro and accelerometer contradict each other: gravity turns the other way. Their axes differ, or "
        "are left-handed";
}

/// Leaves out samples that repeat the one before. Returns their number.
std::size_t leaveOutRepeats(std::vector<ImuMeasurement>* imu) {
  ImuSampleCheck check{ImuInputCheckOptions()};
  std::vector<ImuMeasurement> kept;
  kept.reserve(imu->size());
  for (const ImuMeasurement& sample : *imu)
    if (!check.check(sample).repeats) kept.push_back(sample);
  std::swap(*imu, kept);
  return kept.size() - imu->size();
}

void findNoise(const std::vector<ImuMeasurement>& imu, ImuReport* report) {
  NoiseMeter accel, gyro;
  SaturationDetector saturation(0.0, 0.0);
  std::vector<double> accel_densities, gyro_densities;
  Time next = imu.front().time + 1.0;
  for (const ImuMeasurement& sample : imu) {
    accel.add(sample.time, sample.acceleration);
    gyro.add(sample.time, sample.angular_velocity);
    const SaturationDetector::Saturated saturated = saturation.check(sample);
    if (saturated.accel || saturated.gyro) ++report->saturated;
    report->largest_acceleration =
        std::max(report->largest_acceleration, sample.acceleration.cwiseAbs().maxCoeff());
    report->largest_rate = std::max(report->largest_rate, sample.angular_velocity.cwiseAbs().maxCoeff());
    if (sample.time < next) continue;
    accel_densities.push_back(std::sqrt(accel.squaredDensity()));
    gyro_densities.push_back(std::sqrt(gyro.squaredDensity()));
    next = sample.time + 1.0;
  }
  report->accel_density_quiet = quantile(accel_densities, 0.1);
  report->accel_density_median = quantile(accel_densities, 0.5);
  report->gyro_density_quiet = quantile(gyro_densities, 0.1);
}

void findRest(const std::vector<ImuMeasurement>& imu, ImuReport* report) {
  constexpr double kStart = 10.0;  // [s] from the start within which the rest must be complete
  StaticInitializerOptions options;
  options.max_gravity_error = 2.0;  // a larger error is reported as a fault of the acceleration
  StaticInitializer rest(options, kGravity);
  const Time begin = imu.front().time;
  ImuInputCheck check(0.04, {});  // measures the noise, which a vibrating frame has at rest, too
  for (ImuMeasurement sample : imu) {
    if (sample.time - begin > kStart) return;
    if (check.check(sample).sample.fault != nullptr) continue;
    const auto found = rest.add(sample);
    if (!found) continue;
    report->rests_at_start = true;
    report->rest = found->duration;
    report->rest_begin = std::max(0.0, found->time - begin - found->duration);
    report->rest_rate = found->b_g;
    report->rest_acceleration = found->f_I;
    return;
  }
}

}  // namespace

ImuReport inspectImu(const std::vector<ImuMeasurement>& written) {
  ImuReport report;
  std::vector<ImuMeasurement>& imu = report.samples;
  std::vector<double> norms, rates;
  for (const ImuMeasurement& sample : written) {
    if (!sample.acceleration.allFinite() || !sample.angular_velocity.allFinite()) {
      ++report.not_finite;
      continue;
    }
    imu.push_back(sample);
    norms.push_back(sample.acceleration.norm());
    rates.push_back(sample.angular_velocity.norm());
  }
  if (imu.empty()) return report;
  report.written_norm = quantile(norms, 0.5);
  findAccelerationUnit(quantile(norms, 0.02), &report);
  const double scale = inMetresPerSecondSquared(report.units.acceleration);
  for (ImuMeasurement& sample : imu) sample.acceleration *= scale;
  const double fast = quantile(rates, 0.9);
  if (fast == 0.0) {
    report.rate_fault = "the angular velocity is zero throughout";
  } else {
    findRateUnit(imu, fast, &report);
  }
  for (ImuMeasurement& sample : imu) sample.angular_velocity *= inRadiansPerSecond(report.units.rate);
  report.repeated = leaveOutRepeats(&imu);
  for (const ImuMeasurement& sample : imu)
    report.mean_acceleration += sample.acceleration / static_cast<double>(imu.size());
  findNoise(imu, &report);
  findRest(imu, &report);
  return report;
}

}  // namespace rio_t
