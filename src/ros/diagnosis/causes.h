#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/ros/diagnosis/diagnosis.h"

namespace rio_t {

// The diagnosis names a cause if it explains at least this share of the evidence. Good runs stay far below:
// on one real and two simulated bags the gate rejected at most 0.2 % of the scans and the filter no point.
inline constexpr double kManyScans = 0.3;
inline constexpr double kManyPoints = 0.6;
/// The diagnosis needs so many scans of a radar: two seconds at ten a second.
inline constexpr std::uint64_t kEnoughScans = 20;
inline constexpr const char* kCheckBag = " Run `rosrun rio_t check_bag BAG`: it finds them.";

inline std::uint64_t pointsOf(const RadarSummary& radar, PointVerdict verdict) {
  return radar.points_by_verdict[static_cast<std::size_t>(verdict)];
}

inline double shareOf(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

/// All points that came, including those that the decoder dropped.
inline std::uint64_t pointsReceived(const RadarSummary& radar) {
  return radar.points + radar.points_not_finite;
}

inline std::string number(double value) { return shortText(value, 3); }

inline std::string timesText(std::uint64_t count) {
  return count == 1 ? "once" : std::to_string(count) + " times";
}
inline std::string outOf(std::uint64_t part, std::uint64_t whole, const std::string& what) {
  return std::to_string(part) + " of " + std::to_string(whole) + " " + what;
}

inline std::string mountingAdvice(const RadarSummary& radar) {
  const auto points = static_cast<double>(radar.points_per_scan[1]);  // 0: not known
  return 0.0 < points && points < kSparsePoints
             ? " Measure the mounting: so few points a scan do not show it to check_bag for sure."
             : kCheckBag;
}

/// Rotation of the mounting from the configured one, in sigmas: of a mounting that is held, as the scans show
/// it; else of the estimate, about the worst axis.
inline double turnSigmas(const RadarSummary& radar, const Config& config) {
  if (radar.errors.turn) return radar.errors.turn->sigmas(kConfiguredSigma);
  return radar.turn.cwiseAbs().maxCoeff() / config.odometry.smoother.extrinsics_rotation_sigma;
}

/// The scale of the Doppler may be off by a tenth at three sigma: an accelerometer, and a mounting that is a
/// few degrees off, show it no better.
inline constexpr double kDopplerScaleSigma = 0.1 / 3.0;

/// Error of the scale of the Doppler, in sigmas.
inline double scaleSigmas(const RadarSummary& radar) { return radar.errors.scale.sigmas(kDopplerScaleSigma); }

/// An offset that is held may be off by 5 ms at three sigma. At 5 m/s^2 this is 0.025 m/s, about the noise of
/// a Doppler.
inline constexpr double kHeldOffsetSigma = 0.005 / 3.0;

/// Error of an offset that is held, in sigmas; 0 if it is estimated.
inline double offsetSigmas(const RadarSummary& radar) {
  return radar.errors.offset ? radar.errors.offset->sigmas(kHeldOffsetSigma) : 0.0;
}

/// A lever arm that is held may be off by a centimetre, as a tape measures it.
inline constexpr double kHeldLeverArmSigma = 0.01;

/// Error of a lever arm that is held, in sigmas; 0 if it is estimated.
inline double leverArmSigmas(const RadarSummary& radar) {
  return radar.errors.lever_arm ? radar.errors.lever_arm->sigmas(kHeldLeverArmSigma) : 0.0;
}

/// Adds the causes that one radar shows.
void addCausesOfRadar(const RadarSummary& radar, const Config& config, std::vector<Cause>* causes);

/// The diagnosis names a fault of the IMU if more than this share of the samples has it.
inline constexpr double kManySamples = 0.05;

/// Share of the IMU samples that have faults, at most 1.
double shareOfImuFaults(const RunEvidence& evidence);

/// Adds the causes that the samples of the IMU show: their faults and their noise.
void addCausesOfImu(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes);

}  // namespace rio_t
