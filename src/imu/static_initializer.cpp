#include "rio_t/imu/static_initializer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/format.h"

namespace rio_t {
namespace {

constexpr double kWrongUnits = 0.4;  // share of gravity by which the mean accelerometer is off

/// [s] An engine that idles at 600 turns a minute or more does not move the mean over this time.
constexpr double kMean = 0.1;
/// [s] Rest ends if the mean over this time differs from the mean before.
constexpr double kNewest = 0.5;
constexpr double kCheckEvery = 0.1;
/// [s] Shortest rest that counts if it ends. The sigmas of tilt and gyro bias are then twice those of 4 s.
constexpr double kShortest = 1.0;

struct MeanAndStd {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d std = Eigen::Vector3d::Zero();
};

using Samples = std::vector<ImuMeasurement>::const_iterator;

Eigen::Vector3d meanOf(Samples first, Samples last, Eigen::Vector3d ImuMeasurement::*member) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto sample = first; sample != last; ++sample) sum += *sample.*member;
  return sum / static_cast<double>(last - first);
}

/// The means over successive stretches of kMean. The incomplete last stretch is left out.
std::vector<Eigen::Vector3d> meansOf(Samples first, Samples last, Eigen::Vector3d ImuMeasurement::*member) {
  std::vector<Eigen::Vector3d> means;
  for (auto next = first; next != last; ++next) {
    if (next->time - first->time < kMean) continue;
    means.push_back(meanOf(first, next, member));
    first = next;
  }
  return means;
}

Eigen::Vector3d variancesOf(const std::vector<Eigen::Vector3d>& values, const Eigen::Vector3d& mean) {
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& value : values) squares += (value - mean).cwiseAbs2();
  return squares / static_cast<double>(values.size());
}

/// Mean of the samples, and standard deviation of the means over kMean without their white noise.
MeanAndStd statistics(const std::vector<ImuMeasurement>& samples, Eigen::Vector3d ImuMeasurement::*member,
                      double ImuMeasurement::*squared_density) {
  double density = 0.0;
  for (const ImuMeasurement& sample : samples) density += sample.*squared_density;
  density /= static_cast<double>(samples.size());
  MeanAndStd result;
  result.mean = meanOf(samples.begin(), samples.end(), member);
  const Eigen::Vector3d variances = variancesOf(meansOf(samples.begin(), samples.end(), member), result.mean);
  result.std = (variances.array() - density / kMean).max(0.0).sqrt();
  return result;
}

struct RestStatistics {
  MeanAndStd gyro, accel;
  double mean_size = 0.0;  // [m/s^2] mean of the specific force's norm
};

RestStatistics statistics(const std::vector<ImuMeasurement>& samples) {
  RestStatistics result;
  result.gyro = statistics(samples, &ImuMeasurement::angular_velocity, &ImuMeasurement::gyro_mean_noise);
  result.accel = statistics(samples, &ImuMeasurement::acceleration, &ImuMeasurement::accel_mean_noise);
  for (const ImuMeasurement& sample : samples) result.mean_size += sample.acceleration.norm();
  result.mean_size /= static_cast<double>(samples.size());
  return result;
}

/// Why the samples do not show a platform at rest; nothing if they do.
std::optional<StartWait> noRestBecause(const RestStatistics& rest, const StaticInitializerOptions& options,
                                       double gravity) {
  const MeanAndStd& gyro = rest.gyro;
  const MeanAndStd& accel = rest.accel;
  const auto moving = [](std::string text) { return StartWait{StartObstacle::kMotion, std::move(text)}; };
  // In any motion of people and drones the accelerometer reads gravity on average. If not, units are wrong.
  if (std::abs(rest.mean_size - gravity) > kWrongUnits * gravity) {
    return StartWait{
        StartObstacle::kWrongGravity,
        formatted("rest: the accelerometer reads %.2f m/s^2 on the mean, expected gravity %.2f m/s^2: "
                  "gravity removed, or not in m/s^2?",
                  rest.mean_size, gravity)};
  }
  if (gyro.std.maxCoeff() > options.max_gyro_std) {
    return moving(
        formatted("rest: the gyro moves by %.3f rad/s (std), at most %.3f allowed: moving, or not in rad/s?",
                  gyro.std.maxCoeff(), options.max_gyro_std));
  }
  if (accel.std.maxCoeff() > options.max_accel_std) {
    return moving(formatted("rest: the accelerometer moves by %.2f m/s^2 (std), at most %.2f allowed",
                            accel.std.maxCoeff(), options.max_accel_std));
  }
  if (gyro.mean.norm() > options.max_gyro_mean) {
    return moving(formatted("rest: mean gyro %.3f rad/s, at most %.3f allowed: turning, or not in rad/s?",
                            gyro.mean.norm(), options.max_gyro_mean));
  }
  if (std::abs(accel.mean.norm() - gravity) > options.max_gravity_error) {
    return StartWait{
        StartObstacle::kWrongGravity,
        formatted(
            "rest: mean accelerometer %.2f m/s^2 instead of gravity %.2f: accelerating, or not in m/s^2?",
            accel.mean.norm(), gravity)};
  }
  return std::nullopt;
}

}  // namespace

Eigen::Quaterniond levelingRotation(const Eigen::Vector3d& f_I) {
  return Eigen::Quaterniond::FromTwoVectors(f_I, Eigen::Vector3d::UnitZ());
}

StaticInitializer::StaticInitializer(const StaticInitializerOptions& options, double gravity)
    : options_(options), gravity_(gravity) {}

bool StaticInitializer::endsNow() {
  const ImuMeasurement& newest = samples_.back();
  if (newest.time - samples_.front().time < 2.0 * kNewest || newest.time - checked_at_ < kCheckEvery)
    return false;
  checked_at_ = newest.time;
  const auto new_ones = std::find_if(samples_.begin(), samples_.end(), [&](const ImuMeasurement& sample) {
    return newest.time - sample.time < kNewest;
  });
  const auto acceleration = &ImuMeasurement::acceleration;
  const Eigen::Vector3d before = meanOf(samples_.begin(), new_ones, acceleration);
  const Eigen::Vector3d change = meanOf(new_ones, samples_.end(), acceleration) - before;
  // Noise of the mean over the newest samples: as measured, or as the means before have scattered.
  const Eigen::Vector3d variances = variancesOf(meansOf(samples_.begin(), new_ones, acceleration), before);
  const double noise = std::sqrt(std::max(newest.accel_mean_noise, kMean * variances.maxCoeff()) / kNewest);
  return change.norm() > 0.2 * options_.max_accel_std + 4.0 * noise;
}

std::optional<StaticInitialization> StaticInitializer::add(const ImuMeasurement& imu) {
  // The platform may have moved during so long a gap.
  if (!samples_.empty() && imu.time - samples_.back().time > kNewest) samples_.clear();
  samples_.push_back(imu);
  const bool is_ending = endsNow();
  if (is_ending) {  // the samples before kNewest are still rest
    while (imu.time - samples_.back().time < kNewest) samples_.pop_back();
  }
  const double collected = samples_.back().time - samples_.front().time;
  if (collected < (is_ending ? kShortest : options_.duration) || samples_.size() < 10) {
    // A reason that was reported stays until rest has been seen for a whole duration.
    if (waiting_for_.obstacle == StartObstacle::kTooFewData) {
      waiting_for_.text = formatted("standing still: %.1f of %.1f s seen", collected, options_.duration);
    }
    if (is_ending) {
      waiting_for_ = {
          StartObstacle::kMotion,
          formatted("rest: the mean acceleration changes after %.1f s, at least %.1f expected: moving?",
                    collected, kShortest)};
      has_seen_motion_ = true;
      samples_ = {imu};
    }
    return std::nullopt;
  }

  const RestStatistics rest = statistics(samples_);
  if (std::optional<StartWait> fault = noRestBecause(rest, options_, gravity_)) {
    waiting_for_ = std::move(*fault);
    has_seen_motion_ = true;
    samples_.erase(samples_.begin(), samples_.begin() + static_cast<std::ptrdiff_t>(samples_.size() / 4 + 1));
    return std::nullopt;
  }

  StaticInitialization result;
  result.time = samples_.back().time;
  result.q_WI = levelingRotation(rest.accel.mean);
  result.b_g = rest.gyro.mean;
  result.f_I = rest.accel.mean;
  result.b_a = rest.accel.mean * ((rest.accel.mean.norm() - gravity_) / rest.accel.mean.norm());
  result.duration = collected;
  waiting_for_ = {};
  samples_.clear();
  return result;
}

}  // namespace rio_t
