#include <algorithm>
#include <string>
#include <vector>

#include "../parameters/parameter_list.h"
#include "inspect_keys.h"
#include "rio_t/ros/bag/calibration.h"

namespace rio_t {
namespace {

ProposedKeys keysOf(const ParameterEntries& entries) {
  ProposedKeys keys;
  for (const ParameterEntry& entry : entries)
    if (!isOfOneBag(entry.key)) keys.set(entry.key, entry.value);
  return keys;
}

/// Keeps a configured value to the last digit, and rounds any other.
double written(double value, double configured, double per) {
  return value == configured ? configured : rounded(value, per);
}

ParameterValue writtenList(Eigen::VectorXd values, const Eigen::VectorXd& configured, double per) {
  for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = written(values[i], configured[i], per);
  return listOf(values);
}

/// The keys of a radar that are calibrated.
ProposedKeys calibratedKeys(const RadarCalibration& calibration, const Config& configured, bool pose) {
  constexpr double kMicro = 1e6, kNano = 1e9;  // steps per unit that rounded() keeps
  const CalibrationPrior& prior = configured.odometry.radar;
  const bool offset_found =
      calibration.axes[static_cast<std::size_t>(CalibrationAxis::kOffset)].verdict == Verdict::kObserved;
  ProposedKeys keys;
  keys.set("extrinsics_translation", writtenList(calibration.T_IR.l_I, prior.T_IR.l_I, kMicro));
  if (pose)
    keys.set("extrinsics_translation_sigma",
             ParameterValue{std::max(rounded(calibration.leverArmSigma(), kMicro), 1e-6)},
             "The next run goes on with the estimate from here.");
  keys.set("extrinsics_rotation_xyzw",
           writtenList(calibration.T_IR.q_IR.coeffs(), prior.T_IR.q_IR.coeffs(), kNano));
  // The next run starts from this sigma. It is at least the smallest step that the step detector finds, since
  // the offset of the next run may differ by that.
  const double least = configured.odometry.offset_step_detector.min_change;
  const OffsetEstimate offset =
      offset_found
          ? OffsetEstimate{rounded(calibration.offset.t_O, kMicro),
                           std::max({rounded(calibration.offset.sigma, kMicro), least, 1.0 / kMicro})}
          : OffsetEstimate{prior.time_offset_initial, prior.time_offset_sigma};
  keys.set("time_offset_initial", ParameterValue{offset.t_O});
  keys.set("time_offset_sigma", ParameterValue{offset.sigma});
  return keys;
}

std::string header(const BagCalibration& calibration, const std::string& name) {
  std::string text =
      "Written by rio_t calibrate. It is ready for --config of rio_t_bag, and for the live node.\n";
  text += "It holds the keys of " + name +
          " and of --set, without those of one bag. The comments of that file are not repeated here.\n"
          "Bags that count:\n";
  for (const CalibrationBag& bag : calibration.bags)
    if (bag.failure.empty()) text += "  " + bag.path + "\n";
  for (const CalibrationBag& bag : calibration.bags)
    if (!bag.failure.empty()) text += "This one failed and does not count: " + bag.path + "\n";
  text +=
      "Turns are about the axes of the IMU, from the mounting that was given. What is not observed stays "
      "as given.\n";
  return commented(text, "");
}

/// Returns the keys for the next run, which goes on with the estimate. The mounting is known to `turn_sigma`
/// [rad].
std::string estimateNext(double turn_sigma, bool pose) {
  ProposedKeys keys;
  keys.set("estimate_extrinsics", pose ? "pose" : "rotation",
           "The next run starts from the largest rotation sigma below, and goes on with the estimate. So its "
           "sigmas cover the error that the mounting still has.");
  keys.set("extrinsics_rotation_sigma", ParameterValue{std::max(rounded(turn_sigma, 1e6), 1e-6)});
  return toYaml(keys, "");
}

}  // namespace

std::string calibratedYaml(const BagCalibration& calibration, const Config& config,
                           const ParameterEntries& given, const std::string& name) {
  const std::vector<Config> configured = configsOfRadars(config);
  Config any;
  SortedEntries sorted = sortedEntries(given, parametersOf(any));
  ProposedKeys top_level = keysOf(sorted.top_level);
  // The found mounting is written as a quaternion in RIO's axes. The other keys for the mounting go, since it
  // would count twice.
  for (const char* key :
       {"estimate_extrinsics", "extrinsics_rotation_sigma", "mounting_yaw_pitch_roll_deg", "extrinsics_axes"})
    top_level.remove(key);
  for (const Config& radar : config.radars) top_level.remove(radar.radar_name);  // `left:` and no more
  const bool pose = config.estimate_extrinsics != EstimateExtrinsics::kRotation ||
                    !std::all_of(configured.begin(), configured.end(), hasLeverArm);
  double turn_sigma = 0.0;
  for (const CalibratedRadar& radar : calibration.radars)
    turn_sigma = std::max(turn_sigma, radar.calibration.turnSigma());
  const bool has_sections = !config.radars.empty();
  std::string sections;
  for (std::size_t k = 0; k < configured.size(); ++k) {
    const CalibratedRadar& radar = calibration.radars[k];
    const std::string indent = has_sections ? "  " : "";
    ProposedKeys section = keysOf(sorted.sections[radar.name].entries);
    ProposedKeys& own = has_sections ? section : top_level;
    for (const char* key :
         {"extrinsics_translation", "extrinsics_translation_sigma", "extrinsics_rotation_xyzw",
          "mounting_yaw_pitch_roll_deg", "extrinsics_axes", "time_offset_initial", "time_offset_sigma"})
      own.remove(key);
    if (has_sections) sections += "\n" + radar.name + ":\n" + toYaml(own, indent);
    sections += (has_sections ? "" : "\n") + commented(describeCalibration(radar), indent) + indent +
                "# If the driver's restart changes the offset, raise time_offset_sigma.\n" +
                toYaml(calibratedKeys(radar.calibration, configured[k], pose), indent);
  }
  return header(calibration, name) + "\n" + toYaml(top_level, "") + "\n" + estimateNext(turn_sigma, pose) +
         sections;
}

}  // namespace rio_t
