#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/parameters/parameters.h"

/// The rotation of T_IR can be given in three ways: as a quaternion of RIO's axes, as one of the cloud's
/// axes, or in words. One way counts. The lever arm may be missing.
namespace rio_t {

/// [m] Sigma of a lever arm that nobody has measured: radar and IMU are on one robot, within a metre.
constexpr double kUnmeasuredLeverArm = 0.5;

/// Call it before the entries of a level are set: the top level, or the section of a radar (`section`:
/// "left/"). A mounting in a section replaces the mounting of the top level, whichever way each is given. In
/// one level, the later source counts: --set and the parameter server replace what the file says. Two ways in
/// one source are a fault.
void beginMounting(const ParameterEntries& entries, const std::string& section, Config* config,
                   std::vector<std::string>* faults);

/// Call it once all entries are set: what was given becomes odometry.radar.T_IR, with the sigma of its lever
/// arm.
void resolveMounting(Config* config);

/// Call it next: what is estimated of the mountings. If one lever arm is missing, all are estimated.
/// On a vehicle it also estimates the rotation of a mounting that is to be held: see refinesHeldMounting.
void resolveEstimate(Config* config);

}  // namespace rio_t
