#include <algorithm>
#include <cmath>

#include "inspect_radar.h"
#include "rio_t/ros/bag/run_output.h"

namespace rio_t {
namespace {

std::string axisName(const Eigen::Vector3d& direction) {
  int axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::string(direction[axis] < 0.0 ? "-" : "+") + "xyz"[axis];
}

std::string rateText(const StreamTiming& timing) {
  std::string text = fixedText(timing.rate, timing.rate < 20.0 ? 1 : 0) + " Hz";
  if (timing.gaps > 0)
    text +=
        ", gaps: " + std::to_string(timing.gaps) + " (longest " + fixedText(timing.longest_gap, 2) + " s)";
  if (timing.duplicates > 0) text += ", duplicate stamps: " + std::to_string(timing.duplicates);
  if (timing.backwards > 0) text += ", stamps that run back: " + std::to_string(timing.backwards);
  return text;
}

void checkStamps(const StreamTiming& timing, ImuInspection* imu) {
  std::string fault;
  if (timing.zero > 0) {
    fault = std::to_string(timing.zero) + " of " + std::to_string(timing.messages) + " stamps are zero";
  } else if (timing.constant) {
    fault = "all stamps are the same";
  } else if (!timing.stampsAreUsable()) {
    fault = std::to_string(timing.backwards) + " of " + std::to_string(timing.messages) + " stamps run back";
  }
  if (fault.empty()) return;
  imu->findings.push_back(
      {FindingLevel::kMissing, "IMU stamps", fault + "; rio_t needs the time of each sample"});
  imu->to_do = "Let the IMU driver set header.stamp, and record again.";
}

void describe(ImuInspection* imu) {
  const ImuReport& r = imu->report;
  const auto tell = [&](FindingLevel level, const std::string& subject, const std::string& text) {
    imu->findings.push_back({level, subject, text});
  };
  const bool in_g = r.units.acceleration == AccelerationUnit::kStandardGravity;
  const bool in_degrees = r.units.rate == RateUnit::kDegreesPerSecond;
  if (in_g) {
    imu->keys.set("imu_acceleration_unit", "g",
                  "The median size of the acceleration is " + fixedText(r.written_norm, 2) + ".");
    tell(FindingLevel::kOdd, "IMU unit",
         "the acceleration is in g (median size " + fixedText(r.written_norm, 2) + "), not in m/s^2");
  }
  if (in_degrees) {
    imu->keys.set("imu_rate_unit", "deg/s", "The turns of gravity fit these rates only in degrees.");
    tell(FindingLevel::kOdd, "IMU unit", "the angular velocity is in deg/s, not in rad/s");
  }
  for (const std::string& fault : {r.acceleration_fault, r.rate_fault}) {
    if (fault.empty()) continue;
    tell(FindingLevel::kMissing, "IMU",
         fault + " (median size as written " + fixedText(r.written_norm, 2) + ")");
    imu->to_do =
        "Set the IMU driver to raw acceleration in m/s^2 and angular velocity in rad/s, with the axes of "
        "one right-handed frame, and record again.";
  }
  if (r.rests_at_start) {
    const double norm = r.rest_acceleration.norm();
    tell(std::abs(norm - 9.81) < 0.3 ? FindingLevel::kOk : FindingLevel::kOdd, "rest",
         "at rest from " + fixedText(r.rest_begin, 1) + " s; gravity " + fixedText(norm, 2) +
             " m/s^2, up is " + axisName(r.rest_acceleration) + "; gyro bias " +
             fixedText(r.rest_rate.norm(), 4) + " rad/s");
    if (std::abs(norm - 9.81) > 0.45)
      imu->keys.set("init_max_gravity_error", fixedText(std::abs(norm - 9.81) + 0.5, 1),
                    "At rest the accelerometer shows " + fixedText(norm, 2) + " m/s^2.");
  } else {
    tell(FindingLevel::kOdd, "rest",
         "no rest in the first 10 s, so the odometry starts in motion; 3 s at rest give a better start");
    imu->keys.set("init_mode", "motion", "There is no rest at the start.");
  }
  const double vibration = r.accel_density_median / std::max(r.accel_density_quiet, 1e-9);
  const bool vibrates = r.accel_density_median > 0.04;
  tell(vibrates ? FindingLevel::kOdd : FindingLevel::kOk, "noise",
       "accelerometer " + fixedText(r.accel_density_quiet, 4) + " m/s^2/sqrt(Hz)" +
           (vibration > 2.0 ? ", in motion " + fixedText(r.accel_density_median, 4) : "") + "; gyro " +
           fixedText(r.gyro_density_quiet, 5) + " rad/s/sqrt(Hz)" +
           (vibrates ? ": the frame vibrates; mount the IMU softer if you can" : ""));
  if (r.saturated > 0)
    tell(FindingLevel::kOdd, "range",
         std::to_string(r.saturated) + " samples are at the end of the range (largest " +
             fixedText(r.largest_acceleration, 1) + " m/s^2, " + fixedText(r.largest_rate, 2) + " rad/s)");
  if (r.not_finite > 0)
    tell(FindingLevel::kOdd, "IMU",
         std::to_string(r.not_finite) + " samples are not finite; they are left out");
}

}  // namespace

ImuInspection inspectImuTopic(const ImuTopic& topic) {
  ImuInspection imu;
  imu.topic = &topic;
  const StreamTiming timing = inspectTiming(topic.times);
  imu.keys.set("imu_topic", topic.topic, "");
  constexpr double kSlow = 50.0;  // [Hz]
  const bool odd = timing.rate < kSlow || timing.gaps > 0 || timing.backwards > 0 ||
                   20 * timing.duplicates > timing.messages;
  imu.findings.push_back(
      {odd ? FindingLevel::kOdd : FindingLevel::kOk, "IMU",
       topic.topic + ": " + rateText(timing) +
           (timing.rate < kSlow ? ", slower than the 50 Hz that a hand-held platform needs" : "")});
  checkStamps(timing, &imu);
  if (!imu.to_do.empty()) return imu;
  for (const ImuMeasurement& sample : topic.written) {
    if (imu.samples.empty() || sample.time > imu.samples.back().time) imu.samples.push_back(sample);
  }
  imu.report = inspectImu(imu.samples);
  std::vector<ImuMeasurement> finite;
  for (const ImuMeasurement& sample : imu.samples) {
    if (sample.acceleration.allFinite() && sample.angular_velocity.allFinite())
      finite.push_back(converted(sample, imu.report.units));
  }
  imu.samples = std::move(finite);
  describe(&imu);
  return imu;
}

}  // namespace rio_t
