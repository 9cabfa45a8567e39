#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "../text.h"
#include "inspect_radar.h"
#include "rio_t/imu/clock_jump_detector.h"
#include "rio_t/imu/input_check.h"

namespace rio_t {
namespace {

/// Returns the axis of the IMU, with its sign, that is nearest to a direction.
Eigen::Vector3d nearestAxis(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, direction[axis]) * Eigen::Vector3d::Unit(axis);
}

std::string axisName(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::string(direction[axis] < 0.0 ? "-" : "+") + "xyz"[axis];
}

/// The samples whose stamps are in order, and counts of the others.
struct StampedInOrder {
  ImuTopic kept;
  std::size_t zero = 0, duplicates = 0, ahead = 0, behind = 0;
  bool jumped = false;  ///< the clock jumped
};

/// Whether the IMU paused between two messages. Then the record times show the pause, too; if the clock
/// jumped, they do not.
bool isPause(const MessageTimes& before, const MessageTimes& after, double tolerance) {
  const double step = after.stamp - before.stamp;
  return step > 0.0 && std::abs(after.record - before.record - step) < tolerance;
}

/// Drops the samples that the odometry drops. If the clock jumps, keeps the longest part without a jump.
StampedInOrder stampedInOrder(const ImuTopic& topic) {
  const ImuInputCheckOptions odometry;
  ClockJumpDetector stamps(odometry.max_bridged_gap, odometry.jump_patience);
  StampedInOrder result;
  std::vector<ImuTopic> parts(1);
  for (std::size_t i = 0; i < topic.times.size(); ++i) {
    const MessageTimes& times = topic.times[i];
    if (times.stamp == Time()) {
      ++result.zero;
      continue;
    }
    switch (stamps.check(times.stamp)) {
      case ClockJumpDetector::Verdict::kGood:
        break;
      case ClockJumpDetector::Verdict::kBehind:
        ++(times.stamp == parts.back().times.back().stamp ? result.duplicates : result.behind);
        continue;
      case ClockJumpDetector::Verdict::kAhead:
        if (isPause(parts.back().times.back(), times, odometry.jump_patience)) break;
        ++result.ahead;
        continue;
      case ClockJumpDetector::Verdict::kRestart:
        if (isPause(parts.back().times.back(), times, odometry.jump_patience)) break;
        result.jumped = true;
        parts.emplace_back();
        break;
    }
    parts.back().written.push_back(topic.written[i]);
    parts.back().times.push_back(times);
  }
  result.kept =
      std::move(*std::max_element(parts.begin(), parts.end(), [](const ImuTopic& a, const ImuTopic& b) {
        return a.times.size() < b.times.size();
      }));
  result.kept.topic = topic.topic;
  return result;
}

void describeOrder(const StampedInOrder& order, std::size_t messages, ImuInspection* imu) {
  std::string why;
  const auto tell = [&](std::size_t count, const std::string& text) {
    if (count > 0) appendItem(&why, std::to_string(count) + " " + text);
  };
  tell(order.zero, "with a stamp of zero");
  tell(order.ahead, "stamped more than " + fixedText(ImuInputCheckOptions().jump_patience, 1) +
                        " s ahead of the last good one");
  tell(order.behind, "stamped before the last good one");
  if (order.jumped)
    appendItem(&why, "the clock jumped, and only the longest part without a jump is used", "; ");
  if (why.empty()) return;
  const std::size_t left_out = messages - order.kept.times.size() - order.duplicates;
  imu->odd("IMU stamps", "check_bag leaves out " + std::to_string(left_out) + " of " +
                             std::to_string(messages) + " samples: " + why);
}

/// Says why the stamps cannot be used; empty if all but a few can.
std::string faultOf(const StreamTiming& timing) {
  if (10 * timing.zero >= timing.messages)
    return std::to_string(timing.zero) + " of " + std::to_string(timing.messages) + " stamps are zero";
  if (timing.constant) return "all stamps are the same";
  if (10 * timing.backwards >= timing.messages)
    return std::to_string(timing.backwards) + " of " + std::to_string(timing.messages) + " stamps run back";
  return "";
}

void describeRate(const StreamTiming& timing, ImuInspection* imu) {
  constexpr double kSlow = 50.0;  // [Hz]
  const bool bursts = timing.burst > 0.0;
  const bool odd =
      bursts || timing.rate < kSlow || timing.gaps > 0 || 20 * timing.duplicates > timing.messages;
  imu->tell(odd ? FindingLevel::kOdd : FindingLevel::kOk, "IMU",
            imu->topic + ": " + rateText(timing, timing.rate < 20.0 ? 1 : 0, true) +
                (timing.rate < kSlow ? ", slower than the 50 Hz that a hand-held platform needs" : "") +
                (bursts ? ": the stamps come in bursts of " + fixedText(timing.burst, 0) +
                              ", one burst each " + fixedText(timing.burst_period, 3) +
                              " s. No sample is lost: the driver stamps them when it reads them. Let it give "
                              "each sample the time at which it was measured"
                        : ""));
}

void describeUnits(ImuInspection* imu) {
  const ImuReport& r = imu->report;
  const bool in_g = r.units.acceleration == AccelerationUnit::kStandardGravity;
  const bool in_degrees = r.units.rate == RateUnit::kDegreesPerSecond;
  if (in_g) {
    imu->keys.set("imu_acceleration_unit", "g",
                  "The median size of the acceleration is " + fixedText(r.written_norm, 2) + ".");
    imu->odd("IMU unit",
             "the acceleration is in g (median size " + fixedText(r.written_norm, 2) + "), not in m/s^2");
  }
  if (in_degrees) {
    imu->keys.set("imu_rate_unit", "deg/s", "The turns of gravity fit these rates only in degrees.");
    imu->odd("IMU unit", "the angular velocity is in deg/s, not in rad/s");
  }
  for (const std::string& fault : {r.acceleration_fault, r.rate_fault}) {
    if (fault.empty()) continue;
    imu->missing("IMU", fault + " (median size as written " + fixedText(r.written_norm, 2) + ")",
                 "Set the IMU driver to raw acceleration in m/s^2 and angular velocity in rad/s, with the "
                 "axes of one right-handed frame, and record again.");
  }
}

void describeRest(ImuInspection* imu) {
  const ImuReport& r = imu->report;
  if (r.rests_at_start) {
    const OdometryOptions options;
    const double norm = r.rest_acceleration.norm(), error = std::abs(norm - options.gravity);
    const double allowed = options.initialization.max_gravity_error;
    imu->tell(error < 0.3 ? FindingLevel::kOk : FindingLevel::kOdd, "rest",
              "at rest from " + fixedText(r.rest_begin, 1) + " s; gravity " + fixedText(norm, 2) +
                  " m/s^2, up is " + axisName(r.rest_acceleration) + "; gyro bias " +
                  fixedText(r.rest_rate.norm(), 4) + " rad/s");
    if (error > 0.9 * allowed)
      imu->keys.set("init_max_gravity_error", ParameterValue{rounded(error + allowed, 10.0)},
                    "At rest the accelerometer shows " + fixedText(norm, 2) + " m/s^2.");
  } else {
    imu->odd("rest",
             "the IMU shows no rest in the first 10 s, so the odometry starts in motion; 3 s at rest give a "
             "better start. If the platform did rest, it vibrates: mount the IMU softer");
    imu->keys.set("init_mode", "motion", "There is no rest at the start.");
  }
}

/// Reports an IMU whose z axis is not up: base_link is the IMU by default, and REP-103 wants base_link with z
/// up.
void describeUp(ImuInspection* imu) {
  const std::optional<Eigen::Vector3d> up = upOf(imu->report);
  if (!up) return;
  const Eigen::Vector3d axis = nearestAxis(*up);
  if (axis.z() > 0.0) return;
  // A half turn about x keeps x forward.
  const Eigen::Quaterniond q_BI = axis.z() < 0.0
                                      ? Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0)
                                      : Eigen::Quaterniond::FromTwoVectors(axis, Eigen::Vector3d::UnitZ());
  imu->odd(
      "IMU axes",
      "gravity is on " + axisName(*up) +
          ". Either z of the IMU is not up: then the odometry is right, but rviz shows base_link tilted, "
          "since it is the IMU by default. Give base_link by tf, or set base_extrinsics_rotation_xyzw: [" +
          fixedTexts(q_BI.coeffs(), 4) +
          "] to make its z up (docs/frames.md). Or the accelerometer is negated (it measures gravity, not "
          "the "
          "specific force): then the track is a mirror image, so correct the driver of the IMU. " +
          howToTellNegated(imu->report));
}

void describeNoise(ImuInspection* imu) {
  const ImuReport& r = imu->report;
  const double vibration = r.accel_density_median / std::max(r.accel_density_quiet, 1e-9);
  const bool vibrates = r.accel_density_median > 0.04;
  imu->tell(vibrates ? FindingLevel::kOdd : FindingLevel::kOk, "noise",
            "accelerometer " + fixedText(r.accel_density_quiet, 4) + " m/s^2/sqrt(Hz)" +
                (vibration > 2.0 ? ", in motion " + fixedText(r.accel_density_median, 4) : "") + "; gyro " +
                fixedText(r.gyro_density_quiet, 5) + " rad/s/sqrt(Hz)" +
                (vibrates ? ": the frame vibrates; mount the IMU softer if you can" : ""));
  // A quiet IMU needs no key, since the diagnosis warns only about an IMU that is noisier than configured.
  constexpr double kMost = 10.0;  // [m/s^2/sqrt(Hz)] largest value of the parameter
  if (vibrates)
    imu->keys.set("imu_accel_noise_density",
                  ParameterValue{rounded(std::min(r.accel_density_median, kMost), 1e3)},
                  "The frame vibrates: more than the default expects.");
  if (r.saturated > 0)
    imu->odd("range", std::to_string(r.saturated) + " samples are at the end of the range (largest " +
                          fixedText(r.largest_acceleration, 1) + " m/s^2, " + fixedText(r.largest_rate, 2) +
                          " rad/s)");
}

void describe(ImuInspection* imu) {
  const ImuReport& r = imu->report;
  const std::size_t samples = r.samples.size() + r.not_finite + r.repeated;
  if (10 * r.not_finite > samples) {  // the report would describe only the rest
    imu->missing("IMU",
                 std::to_string(r.not_finite) + " of " + std::to_string(samples) + " samples are not finite",
                 "Correct the IMU driver, which writes NaN or infinity, and record again.");
    return;
  }
  describeUnits(imu);
  describeRest(imu);
  describeUp(imu);
  describeNoise(imu);
  if (r.not_finite > 0)
    imu->odd("IMU", std::to_string(r.not_finite) + " samples are not finite; they are left out");
  if (r.repeated > 0)
    imu->odd("repeats", std::to_string(r.repeated) +
                            " samples have the values of the one before, although the IMU turns; they are "
                            "left out. Let the driver publish a sample only if it has read a new one");
}

}  // namespace

std::optional<Eigen::Vector3d> upOf(const ImuReport& report) {
  constexpr double kMostlyUp = 7.5;  // [m/s^2] if the mean is shorter, the IMU turns over
  const Eigen::Vector3d up = report.rests_at_start ? report.rest_acceleration : report.mean_acceleration;
  if (report.mean_acceleration.norm() <= kMostlyUp || up.norm() <= kMostlyUp) return std::nullopt;
  return up.normalized();
}

std::string howToTellNegated(const ImuReport& report) {
  std::string expected = "To tell: at rest, ROS expects +9.81 m/s^2 along the direction that points up";
  const std::optional<Eigen::Vector3d> up = upOf(report);
  if (!up) return expected;
  const std::string axis = axisName(*up);
  return expected + ", and this IMU shows it along " + axis + ". If " + axis +
         " points down, the accelerometer is negated";
}

std::string rateText(const StreamTiming& timing, int decimals, bool with_duplicates) {
  std::string text = fixedText(timing.rate, decimals) + " Hz";
  if (timing.gaps > 0)
    text +=
        ", gaps: " + std::to_string(timing.gaps) + " (longest " + fixedText(timing.longest_gap, 2) + " s)";
  if (with_duplicates && timing.duplicates > 0)
    text += ", duplicate stamps: " + std::to_string(timing.duplicates);
  return text;
}

ImuInspection inspectImuTopic(const ImuTopic& topic) {
  ImuInspection imu;
  imu.topic = topic.topic;
  imu.keys.set("imu_topic", topic.topic);
  const StreamTiming written = inspectTiming(topic.times);
  const std::string fault = faultOf(written);
  if (!fault.empty()) {
    describeRate(written, &imu);
    imu.missing("IMU stamps", fault + "; rio_t needs the time of each sample",
                "Let the IMU driver set header.stamp, and record again.");
    return imu;
  }
  StampedInOrder order = stampedInOrder(topic);
  StreamTiming timing = inspectTiming(order.kept.times);
  timing.duplicates = order.duplicates;
  describeRate(timing, &imu);
  describeOrder(order, written.messages, &imu);
  imu.times = std::move(order.kept.times);
  imu.report = inspectImu(order.kept.written);
  describe(&imu);
  return imu;
}

}  // namespace rio_t
