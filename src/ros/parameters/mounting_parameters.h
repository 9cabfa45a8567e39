#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

/// The rotation of T_IR can be given in three ways: as a quaternion in RIO's axes, as a quaternion in the
/// cloud's axes, or by angles. Only one way counts. The lever arm may be missing.
namespace rio_t {

/// [m] Sigma of a lever arm that nobody has measured: radar and IMU are on one robot, within a metre.
constexpr double kUnmeasuredLeverArm = 0.5;

/// Call it before the entries of a level are set: the top level, or the section of a radar (`section`:
/// "left/"). A mounting in a section replaces that of the top level, even if the two are given in different
/// ways. In one level, the later source counts: --set and the parameter server replace the mounting of the
/// file. Two ways in one source are a fault.
void beginMounting(const ParameterEntries& entries, const std::string& section, Config* config,
                   std::vector<std::string>* faults);

/// Call it once all entries are set: converts them to odometry.radar.T_IR and the sigma of its lever arm.
void resolveMounting(Config* config);

/// Call it next: decides what the estimator estimates of the mountings. If one lever arm is missing, all are
/// estimated. On a vehicle, the rotation of a mounting that the user wants to hold is estimated, too: see
/// refinesHeldMounting.
void resolveEstimate(Config* config);

}  // namespace rio_t
