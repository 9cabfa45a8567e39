#include "rio_t/simulation/motions.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "rio_t/simulation/random.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t::simulation {
namespace {

constexpr double kSampleStep = 0.01;  // [s] between the poses from which the spline is made
static_assert(kLongest == kMostSamples * kSampleStep);
constexpr std::uint64_t kMotionStream = 1;
constexpr double kWalkingPace = 1.3;    // [m/s]
constexpr double kStraightSpeed = 1.0;  // [m/s]

using VectorFunction = std::function<Eigen::Vector3d(double)>;
using PoseFunction = std::function<StampedPose(double)>;

// A sum of sines along one axis.
class Waves {
 public:
  // `count` frequencies spread over [low, high] Hz. Each adds equal speed, so amplitudes fall with frequency.
  Waves(Random& random, int count, double low, double high, double weight) {
    for (int i = 0; i < count; ++i) {
      const double f = low + (high - low) * (i + random.uniform()) / count;
      waves_.push_back(
          {weight * random.uniform(0.7, 1.3) / f, 2.0 * M_PI * f, random.uniform(0.0, 2.0 * M_PI)});
    }
  }
  double operator()(double t) const {
    double sum = 0.0;
    for (const Wave& w : waves_) sum += w.amplitude * std::sin(w.rate * t + w.phase);
    return sum;
  }

 private:
  struct Wave {
    double amplitude, rate, phase;
  };
  std::vector<Wave> waves_;
};

VectorFunction waves(Random& random, int count, double low, double high, const Eigen::Vector3d& weights) {
  const Waves x(random, count, low, high, weights.x());
  const Waves y(random, count, low, high, weights.y());
  const Waves z(random, count, low, high, weights.z());
  return [x, y, z](double t) { return Eigen::Vector3d(x(t), y(t), z(t)); };
}

VectorFunction scaled(const VectorFunction& f, double scale) {
  return [f, scale](double t) -> Eigen::Vector3d { return scale * f(t); };
}

VectorFunction sum(const VectorFunction& f, const VectorFunction& g) {
  return [f, g](double t) -> Eigen::Vector3d { return f(t) + g(t); };
}

// The bounce of walking: twice per stride up and down, once sideways.
VectorFunction stepBounce(double step_rate, double height) {
  return [=](double t) -> Eigen::Vector3d {
    return {0.0, 0.5 * height * std::sin(M_PI * step_rate * t),
            height * std::sin(2.0 * M_PI * step_rate * t)};
  };
}

// Angles are (roll, pitch, yaw).
Eigen::Quaterniond attitude(const Eigen::Vector3d& angles) {
  return Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX());
}

double peakSpeed(const VectorFunction& position, double duration) {
  double peak = 0.0;
  for (double t = 0.0; t < duration; t += kSampleStep) {
    peak = std::max(peak, (position(t + kSampleStep) - position(t)).norm() / kSampleStep);
  }
  return peak;
}

double peakRate(const VectorFunction& angles, double duration) {
  double peak = 0.0;
  Eigen::Quaterniond before = attitude(angles(0.0));
  for (double t = kSampleStep; t < duration; t += kSampleStep) {
    const Eigen::Quaterniond now = attitude(angles(t));
    peak = std::max(peak, so3::log(before.conjugate() * now).norm() / kSampleStep);
    before = now;
  }
  return peak;
}

VectorFunction withPeakSpeed(const VectorFunction& position, double peak, double duration) {
  return scaled(position, peak / peakSpeed(position, duration));
}

VectorFunction withPeakRate(const VectorFunction& angles, double peak, double duration) {
  // Not linear in the angles (pitch couples roll and yaw), so the scale is refined a few times.
  double scale = 1.0;
  for (int i = 0; i < 6; ++i) scale *= peak / peakRate(scaled(angles, scale), duration);
  return scaled(angles, scale);
}

PoseFunction combine(const VectorFunction& position, const VectorFunction& angles) {
  return [=](double t) {
    StampedPose pose;
    pose.p_W = position(t);
    pose.q_WI = attitude(angles(t));
    return pose;
  };
}

struct HandHeld {
  double speed;        // peak [m/s]
  double rate;         // peak [rad/s]
  double position_hz;  // highest frequency of the position
  double attitude_hz;  // and of the attitude
  double bounce;       // [m]
};

PoseFunction handHeld(const HandHeld& how, Random& random, double duration) {
  const VectorFunction path =
      sum(withPeakSpeed(waves(random, 4, 0.3 * how.position_hz, how.position_hz, {1.0, 1.0, 0.35}), how.speed,
                        duration),
          stepBounce(1.8, how.bounce));
  const VectorFunction angles = waves(random, 4, 0.25 * how.attitude_hz, how.attitude_hz, {0.45, 0.45, 1.0});
  return combine(withPeakSpeed(path, how.speed, duration), withPeakRate(angles, how.rate, duration));
}

// One lap of an oval hall, back to where it began, with the sensor looking along the path.
PoseFunction gymLoop(Random& random, double duration) {
  const double length = 2.1 * duration / (2.0 * M_PI);  // half axes for about 1 m/s
  const double a = 0.63 * length;
  const double b = 0.30 * length;
  const VectorFunction bounce = stepBounce(1.8, 0.012);
  const VectorFunction sway = withPeakRate(waves(random, 3, 0.2, 0.9, {0.5, 0.5, 1.0}), 0.5, duration);
  const VectorFunction drift = withPeakSpeed(waves(random, 3, 0.05, 0.2, {1.0, 1.0, 0.5}), 0.15, duration);
  return combine(
      [=](double t) -> Eigen::Vector3d {
        const double phi = 2.0 * M_PI * t / duration;
        return Eigen::Vector3d(a * std::sin(phi), b * (1.0 - std::cos(phi)), 0.0) + bounce(t) + drift(t);
      },
      [=](double t) -> Eigen::Vector3d {
        const double phi = 2.0 * M_PI * t / duration;
        // Heading of the oval, unwrapped: atan2 of the part that circles around phi itself.
        const double heading =
            phi + std::atan2(b * std::sin(phi) * std::cos(phi) - a * std::cos(phi) * std::sin(phi),
                             a * std::cos(phi) * std::cos(phi) + b * std::sin(phi) * std::sin(phi));
        return sway(t) + Eigen::Vector3d(0.0, 0.0, heading);
      });
}

// Leans into its acceleration as a multicopter must.
PoseFunction drone(Random& random, double duration) {
  const VectorFunction position = withPeakSpeed(waves(random, 4, 0.04, 0.2, {1.0, 1.0, 0.4}), 3.0, duration);
  const Waves yaw(random, 3, 0.03, 0.12, 0.08);
  return [=](double t) {
    const double h = 0.02;
    const Eigen::Vector3d p = position(t);
    const Eigen::Vector3d a = (position(t + h) - 2.0 * p + position(t - h)) / (h * h);
    const Eigen::Vector3d thrust = a + Eigen::Vector3d(0.0, 0.0, 9.81);
    StampedPose pose;
    pose.p_W = p;
    pose.q_WI = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), thrust) *
                Eigen::AngleAxisd(yaw(t), Eigen::Vector3d::UnitZ());
    return pose;
  };
}

// Dead reckoning of a speed and a yaw rate in the plane by the midpoint rule, straight between the samples.
PoseFunction planar(const std::function<double(double)>& speed, const std::function<double(double)>& yaw_rate,
                    double duration) {
  // One pose a sample and one to spare.
  std::vector<StampedPose> poses(static_cast<std::size_t>(duration / kSampleStep) + 3);
  double heading = 0.0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].p_W = p;
    poses[i].q_WI = attitude({0.0, 0.0, heading});
    const double t = (static_cast<double>(i) + 0.5) * kSampleStep;
    const double yaw_step = yaw_rate(t) * kSampleStep;
    const double middle = heading + 0.5 * yaw_step;
    p += speed(t) * kSampleStep * Eigen::Vector3d(std::cos(middle), std::sin(middle), 0.0);
    heading += yaw_step;
  }
  return [poses](double t) {
    const std::size_t i = std::min(poses.size() - 2, static_cast<std::size_t>(t / kSampleStep));
    const double u = t / kSampleStep - static_cast<double>(i);
    StampedPose pose;
    pose.p_W = (1.0 - u) * poses[i].p_W + u * poses[i + 1].p_W;
    pose.q_WI = poses[i].q_WI.slerp(u, poses[i + 1].q_WI);
    return pose;
  };
}

// Planar, no side slip, up to 5 m/s.
PoseFunction groundVehicle(Random& random, double duration) {
  const Waves pace(random, 3, 0.02, 0.1, 1.0);
  const Waves turn(random, 3, 0.02, 0.12, 1.0);
  double pace_peak = 0.0;
  double turn_peak = 0.0;
  for (double t = 0.0; t < duration; t += kSampleStep) {
    pace_peak = std::max(pace_peak, std::abs(pace(t)));
    turn_peak = std::max(turn_peak, std::abs(turn(t)));
  }
  return planar([&](double t) { return 3.0 + 2.0 * pace(t) / pace_peak; },
                [&](double t) { return 0.45 * turn(t) / turn_peak; }, duration);
}

// A stretch of a path in the plane.
struct Section {
  double start, length;    // [s]
  double yaw_rate = 0.0;   // [rad/s] in the middle; zero: it is straight
  double top_speed = 0.0;  // [m/s] in the middle, if that differs from section to section

  // Rises from 0 to 1 in the middle and falls again; its mean is a half.
  double shape(double t) const {
    const double s = std::sin(M_PI * (t - start) / length);
    return s * s;
  }
};
// Each section begins at the end of the one before.
using Course = std::vector<Section>;

const Section& sectionAt(const Course& course, double t) {
  const auto next = std::find_if(course.begin() + 1, course.end(),
                                 [t](const Section& section) { return section.start > t; });
  return *(next - 1);
}

double yawRateAt(const Course& course, double t) {
  const Section& section = sectionAt(course, t);
  return section.yaw_rate * section.shape(t);
}

// Straight stretches with turns of about a right angle between them, at walking pace `pace` [m/s].
Course corridors(Random& random, double duration, double pace) {
  Course course;
  double end = 0.0;
  const auto add = [&](double length, double yaw_rate) {
    course.push_back({end, length, yaw_rate});
    end += length;
  };
  while (end < duration) {
    add(random.uniform(2.0, 14.0) / pace, 0.0);
    const double angle = random.uniform(75.0, 105.0) * kDegree;
    const double peak = random.uniform(0.7, 0.9);
    add(2.0 * angle / peak, random.chance(0.5) ? peak : -peak);
  }
  add(1.0, 0.0);  // the samples run a little past the end
  return course;
}

// A sensor held in front of somebody who walks through a building. Steps heave it by 2.5 cm from lowest to
// highest, and nod, swing and roll it; their rate wanders about 2 Hz.
PoseFunction walk(Random& random, double duration, double pace) {
  const Course course = corridors(random, duration, pace);
  const Waves hurry(random, 3, 0.02, 0.1, 0.003);
  const auto speed = [&](double t) {  // slower in the turns
    const Section& section = sectionAt(course, t);
    return pace * (section.yaw_rate != 0.0 ? 1.0 - 0.3 * section.shape(t) : 1.0) + hurry(t);
  };
  const PoseFunction body = planar(
      speed, [&](double t) { return yawRateAt(course, t); }, duration);
  const Waves stride(random, 3, 0.02, 0.1, 0.005);
  const VectorFunction sway = withPeakRate(waves(random, 3, 0.2, 0.9, {0.5, 0.5, 1.0}), 0.15, duration);
  return [=](double t) {
    const double step = 2.0 * M_PI * (2.0 * t + stride(t));
    const double swing = std::sin(0.5 * step);  // left and right foot
    StampedPose pose = body(t);
    pose.p_W += pose.q_WI * Eigen::Vector3d(0.0, 0.012 * swing, 0.0125 * std::sin(step));
    pose.q_WI = pose.q_WI * attitude(sway(t) + Eigen::Vector3d(0.015 * swing, 0.008 * std::cos(step), 0.0));
    return pose;
  };
}

// Straights between bends and loops, as one drives a kart round a hall: it speeds up on each straight and
// brakes before the next bend.
PoseFunction kart(Random& random, double duration) {
  constexpr double kBendSpeed = 1.2;  // [m/s]
  Course course;
  double end = 0.0;
  const auto add = [&](double length, double yaw_rate, double top_speed) {
    course.push_back({end, length, yaw_rate, top_speed});
    end += length;
  };
  while (end < duration + 1.0) {  // the samples run a little past the end
    const double top_speed = random.uniform(2.2, 2.9);
    const double straight = random.uniform(4.0, 9.0);  // [m]
    add(straight / (0.5 * (kBendSpeed + top_speed)), 0.0, top_speed);
    // Bends to the left make laps, which stay in a hall; every fourth is a full loop to the right.
    const bool loop = course.size() % 8 == 5;
    const double angle = (loop ? 360.0 : random.uniform(60.0, 150.0)) * kDegree;
    const double radius = random.uniform(1.2, 1.8);  // [m] where it is narrowest
    const double peak = kBendSpeed / radius;
    add(2.0 * angle / peak, loop ? -peak : peak, kBendSpeed);
  }
  const auto speed = [&](double t) {
    const Section& section = sectionAt(course, t);
    return kBendSpeed + (section.top_speed - kBendSpeed) * section.shape(t);
  };
  return planar(
      speed, [&](double t) { return yawRateAt(course, t); }, duration);
}

PoseFunction constantSpeed(double speed) {
  return [=](double t) {
    StampedPose pose;
    pose.p_W = {speed * t, 0.0, 0.0};
    return pose;
  };
}

PoseFunction poseFunction(const MotionRequest& request, Random& random, double duration) {
  const std::string& name = request.name;
  if (name == "easy") return handHeld({0.7, 0.5, 0.30, 0.30, 0.0}, random, duration);
  if (name == "medium" || name == "start_in_motion") {
    return handHeld({1.0, 1.0, 0.45, 0.45, 0.006}, random, duration);
  }
  if (name == "difficult") return handHeld({2.0, 3.0, 0.80, 0.90, 0.012}, random, duration);
  if (name == "gym_loop") return gymLoop(random, duration);
  if (name == "drone") return drone(random, duration);
  if (name == "ground_vehicle") return groundVehicle(random, duration);
  if (name == "kart") return kart(random, duration);
  if (name == "walk") return walk(random, duration, request.speed.value_or(kWalkingPace));
  return constantSpeed(request.speed.value_or(kStraightSpeed));
}

}  // namespace

const std::vector<MotionDescription>& builtInMotions() {
  static const std::vector<MotionDescription> motions = {
      {"easy", "hand-held, slow: up to 0.7 m/s and 0.5 rad/s", 90.0},
      {"medium", "hand-held walk: up to 1 m/s and 1 rad/s", 90.0},
      {"difficult", "hand-held, wild: up to 2 m/s, 3 rad/s and over 5 m/s^2", 90.0},
      {"gym_loop", "one walked lap of a hall, about 1 m/s, ends where it began", 100.0},
      {"walk", "hand-held, through corridors: 1.3 m/s, a turn every 5 to 20 m, steps that heave 2.5 cm",
       300.0},
      {"drone", "multicopter: up to 3 m/s, leans into its acceleration", 90.0},
      {"ground_vehicle", "planar, 1 to 5 m/s, up to 0.45 rad/s about the vertical", 90.0},
      {"kart", "go-kart in a hall: planar, 1 to 3 m/s, brakes for bends and loops of 1.2 to 1.8 m radius",
       100.0},
      {"constant_speed", "straight line without rotation, at 1 m/s or --speed", 90.0},
      {"start_in_motion", "medium, but moving from the first sample on", 90.0},
  };
  return motions;
}

Motion makeMotion(const MotionRequest& request) {
  const std::vector<MotionDescription>& known = builtInMotions();
  const auto found = std::find_if(known.begin(), known.end(),
                                  [&](const MotionDescription& m) { return m.name == request.name; });
  if (found == known.end()) {
    std::string names;
    for (const MotionDescription& m : known) names += (names.empty() ? "" : ", ") + m.name;
    throw std::invalid_argument("motion '" + request.name + "' is not known; known are: " + names);
  }
  if (request.speed && request.name != "constant_speed" && request.name != "walk") {
    throw std::invalid_argument("speed: only the motions constant_speed and walk can be given one, '" +
                                request.name + "' has its own");
  }
  if (request.speed && !(*request.speed > 0.0)) throw std::invalid_argument("speed: must be positive");
  MotionRestOptions rest = request.rest;
  if (request.name == "start_in_motion") rest.static_start = 0.0;
  const double duration = request.duration > 0.0 ? request.duration : found->default_duration;
  const double path_duration = Motion::pathDuration(duration, rest);
  if (path_duration < 5.0) {
    throw std::invalid_argument("motion: a duration of " + std::to_string(duration) +
                                " s leaves less than 5 s between the rests");
  }
  if (path_duration > kLongest)
    throw std::invalid_argument(formatted("--duration: %g s; expected at most %g s", duration, kLongest));

  Random random(request.seed, kMotionStream);
  const PoseFunction pose_at = poseFunction(request, random, path_duration);
  Trajectory poses;
  const auto count = static_cast<std::size_t>(std::ceil(path_duration / kSampleStep));
  const Eigen::Vector3d origin = pose_at(0.0).p_W;
  for (std::size_t i = 0; i <= count; ++i) {
    // The last pose ends the path exactly where the duration asks for it.
    const double t = std::min(path_duration, static_cast<double>(i) * kSampleStep);
    StampedPose pose = pose_at(t);
    pose.time = Time::fromSeconds(t);
    pose.p_W -= origin;
    if (!poses.empty() && pose.time <= poses.back().time) break;
    poses.push_back(pose);
  }
  constexpr double kCutoff = 25.0;  // [Hz] high, since the poses have no noise
  return Motion(TrajectorySpline(poses, kCutoff), rest);
}

}  // namespace rio_t::simulation
