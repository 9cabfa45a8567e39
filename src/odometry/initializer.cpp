#include "rio_t/odometry/initializer.h"

#include <algorithm>
#include <cmath>

#include "rio_t/smoother/node_prior.h"

namespace rio_t {

Initializer::Initializer(const OdometryOptions& options)
    : options_(options), rest_(options.initialization, options.gravity) {
  for (std::size_t k = 0; k < options.radarCount(); ++k) motion_.emplace_back(options, options.ofRadar(k));
}

bool Initializer::isMoving(Time from, Time to) const {
  const auto says = [&](bool moving) {
    return std::any_of(motion_.begin(), motion_.end(), [&](const MotionInitializer& radar) {
      return radar.isMoving(from, to, options_.rest.max_speed) == moving;
    });
  };
  return says(true) && !says(false);
}

bool Initializer::mayStartInMotion() const {
  if (options_.init_mode != InitMode::kAuto) return options_.init_mode == InitMode::kMotion;
  if (!first_ || *newest_ - *first_ < options_.init_motion_after) return false;
  // A start at rest with a long init_duration may still be under way.
  const double seconds = std::max(options_.init_motion_after, options_.initialization.duration);
  return rest_.hasSeenMotion() || isMoving(*newest_ - seconds, *newest_);
}

std::optional<Initialization> Initializer::add(const ImuMeasurement& newest, const ImuBuffer& imu) {
  if (!first_) first_ = newest.time;
  newest_ = newest.time;
  if (options_.init_mode != InitMode::kMotion) {
    const std::optional<StaticInitialization> rest = rest_.add(newest);
    // A smooth ride looks like rest to the IMU, and like motion to the radar.
    if (rest) radar_contradicts_rest_ = isMoving(rest->time - rest->duration, rest->time);
    if (rest && !radar_contradicts_rest_) {
      StateBlock x;
      x.q_WI() = rest->q_WI;
      x.b_g() = rest->b_g;
      x.b_a() = rest->b_a;
      ImuNoise noise = options_.imu_noise;
      // The rest is a mean over many samples. The motion that a gap may hide belongs to one of them only.
      noise.accel_density = std::max(noise.accel_density, std::sqrt(newest.accel_mean_noise));
      noise.gyro_density = std::max(noise.gyro_density, std::sqrt(newest.gyro_mean_noise));
      return Initialization{
          rest->time,
          priorAtRest(options_.smoother, noise, x, options_.gravity, rest->duration, options_.ofRadar(0)),
          0,
          InitializedFrom::kRest,
          {}};
    }
  }
  if (!mayStartInMotion()) return std::nullopt;
  return findInMotion(imu, [](Time) { return PoseAnchor(); });  // W begins here
}

std::optional<Initialization> Initializer::findInMotion(const ImuBuffer& imu,
                                                        const std::function<PoseAnchor(Time)>& anchorAt) {
  for (std::size_t k = 0; k < motion_.size(); ++k) {
    std::optional<Initialization> found = motion_[k].solve(imu, anchorAt);
    if (!found) continue;
    found->radar = k;
    return found;
  }
  return std::nullopt;
}

void Initializer::forgetVelocities() {
  for (MotionInitializer& radar : motion_) radar.clear();
}

void Initializer::setImuNoise(const ImuNoise& noise) {
  options_.imu_noise = noise;
  for (MotionInitializer& radar : motion_) radar.setImuNoise(noise);
}

StartWait Initializer::waitingFor() const {
  const StartWait& motion = motion_.front().waitingFor();
  if (options_.init_mode == InitMode::kMotion) return motion;
  StartWait wait = rest_.waitingFor();
  if (radar_contradicts_rest_) wait.text += " (the IMU seemed at rest, but the radar saw motion)";
  if (!mayStartInMotion()) return wait;
  wait.text += "; or " + motion.text;
  // This obstacle is the most useful one: its text names gravity and mounting.
  if (motion.obstacle == StartObstacle::kContradiction) wait.obstacle = motion.obstacle;
  return wait;
}

}  // namespace rio_t
