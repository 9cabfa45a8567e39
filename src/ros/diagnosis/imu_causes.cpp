#include <algorithm>
#include <string>

#include "causes.h"

namespace rio_t {
namespace {

struct ImuFault {
  const char* name;
  std::uint64_t samples;  ///< number that one fault affects
  const char* text;
  const char* remedy;
};
constexpr ImuFault kImuFaults[] = {
    {"imu_not_usable", 1, "IMU messages cannot be used.", "Check the stamps and the values of imu_topic."},
    {"imu_saturated", 1, "IMU samples are at the end of the range.",
     "Take an IMU with a larger range. If the range found is too small, set imu_accel_range and "
     "imu_gyro_range."},
    {"imu_gap", 10, "gaps between IMU samples are longer than max_imu_gap.",
     "Raise max_imu_gap for a slow IMU, or look for what loses its messages."},
    {"imu_out_of_order", 1, "IMU samples are out of order, or came twice.",
     "Look for a second publisher on imu_topic."},
    {"imu_not_finite", 1, "IMU samples are not finite.",
     "Correct the driver of the IMU: it writes NaN or infinity."},
    {"imu_not_plausible", 1, "IMU samples have a reading that no IMU measures.",
     "Check imu_acceleration_unit, imu_rate_unit, imu_accel_range and imu_gyro_range, then the cable and the "
     "driver of the IMU."},
    {"imu_repeated", 1, "IMU samples have the values of the sample before, although the IMU turns.",
     "Let the driver of the IMU publish a sample only if it has read a new one."},
    {"imu_stamp_jump", 1, "IMU samples are stamped far ahead of the one before.",
     "Look at the clock of the driver. For an IMU with pauses, raise imu_jump_patience and "
     "max_bridged_imu_gap above them."},
    {"imu_stuck", 1, "IMU samples have an axis that stays at one reading, or jumps to and fro.",
     "Look at the cable and the driver of the IMU: one of its axes fails."}};

/// Share of the IMU samples that a fault affects.
double shareAffected(const ImuFault& fault, const RunEvidence& evidence) {
  return std::min(1.0,
                  shareOf(countOf(evidence.input_faults, fault.name) * fault.samples, evidence.imu_count));
}

/// Whether the stamps come in bursts: nearly all the time passes in gaps, and yet there are many samples.
bool stampsComeInBursts(const RunEvidence& evidence, const Config& config) {
  constexpr std::uint64_t kEnoughBursts = 10;
  constexpr double kMostOfTheTime = 0.8;
  return evidence.imu_gaps >= kEnoughBursts &&
         evidence.imu_gap_seconds > kMostOfTheTime * evidence.imu_seconds &&
         evidence.imu_seconds < config.odometry.max_imu_gap * static_cast<double>(evidence.imu_steps);
}

void addBursts(const RunEvidence& evidence, double share, std::vector<Cause>* causes) {
  const double gaps = static_cast<double>(evidence.imu_gaps);
  causes->push_back(
      {"imu_bursts",
       "The stamps of the IMU come in bursts of " +
           fixedText(static_cast<double>(evidence.imu_steps) / gaps, 0) + ", one burst each " +
           number(evidence.imu_seconds / gaps) +
           " s: that is longer than max_imu_gap, but no sample is lost.",
       "The driver of the IMU stamps the samples when it reads them: let it give each sample the "
       "time at which it was measured.",
       share});
}

}  // namespace

double shareOfImuFaults(const RunEvidence& evidence) {
  double share = 0.0;
  for (const ImuFault& fault : kImuFaults) share += shareAffected(fault, evidence);
  return std::min(1.0, share);
}

void addCausesOfImu(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  for (const ImuFault& fault : kImuFaults) {
    const double share = shareAffected(fault, evidence);
    if (share <= kManySamples) continue;
    if (fault.name == std::string("imu_gap") && stampsComeInBursts(evidence, config)) {
      addBursts(evidence, share, causes);
      continue;
    }
    causes->push_back({fault.name,
                       std::to_string(countOf(evidence.input_faults, fault.name)) + " " + fault.text,
                       fault.remedy, share});
  }
  // The cause is certain, and each step moves the rest of the trajectory: the share is 1.
  if (const std::uint64_t steps = countOf(evidence.input_faults, "imu_clock_back"))
    causes->push_back({"imu_clock_back",
                       "The clock of the IMU stepped back " + timesText(steps) +
                           ": its stamps went on from an earlier time, and the motion meanwhile is lost.",
                       "Let the clock of the computer slew, not step, while it records (NTP, chrony, PTP).",
                       1.0});
  const ImuNoise& expected = config.odometry.imu_noise;
  const MeasuredImuNoise& noise = evidence.imu_noise;
  const auto noisy = [&](const std::string& sensor, const std::string& key, double measured,
                         const MeasuredImuNoise& alone, double configured) {
    if (!alone.isFarAbove(expected)) return;
    causes->push_back({"imu_noisy",
                       "The " + sensor + " vibrates or is noisier than configured: " + number(measured) +
                           " against " + key + " " + number(configured) + ".",
                       "Mount the IMU softer, or raise this key.", 0.1});
  };
  noisy("accelerometer", "imu_accel_noise_density", noise.accel_density, {noise.accel_density, 0.0},
        expected.accel_density);
  noisy("gyro", "imu_gyro_noise_density", noise.gyro_density, {0.0, noise.gyro_density},
        expected.gyro_density);
}

}  // namespace rio_t
