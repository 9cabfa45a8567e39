#pragma once

#include <map>
#include <string>
#include <vector>

#include "rio_t/simulation/barometer_model.h"
#include "rio_t/simulation/imu_model.h"
#include "rio_t/simulation/radar_model.h"

namespace rio_t::simulation {

/// A rig with one radar, the base RadarSetup, unless `radars` names several.
struct SimulationOptions : RadarSetup {
  std::uint64_t seed = 0;
  Time start = Time::fromNanoseconds(1'700'000'000'000'000'000);  ///< stamp of the first IMU sample
  ImuModelOptions imu;
  BarometerModelOptions barometer;
  /// By name: lower case letters, digits and underscores. If it is not empty, these are all radars of the
  /// rig.
  std::map<std::string, RadarSetup> radars;
};

/// What the sensors of one rig measure on one motion.
struct SensorData {
  ImuData imu;
  std::vector<SimulatedPressure> pressures;                  ///< empty without a barometer
  std::vector<SimulatedScan> scans;                          ///< of the one radar; empty if radars have names
  std::map<std::string, std::vector<SimulatedScan>> radars;  ///< of those with names
};

/// The same motion and options give the same data, bit for bit. Each radar with a name has reflectors,
/// persons and ghosts of its own. Seed and name pick its sequence, so it does not depend on the other radars,
/// nor does the IMU depend on any. Throws std::invalid_argument for options out of range; the message names
/// the radar.
SensorData simulate(const Motion& motion, const SimulationOptions& options);

/// True poses at `rate` [Hz] from the start to the end.
Trajectory groundTruth(const Motion& motion, double rate, Time start);

}  // namespace rio_t::simulation
