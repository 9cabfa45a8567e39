#pragma once

#include "rio_t/simulation/imu_model.h"
#include "rio_t/simulation/radar_model.h"

namespace rio_t::simulation {

struct SimulationOptions {
  std::uint64_t seed = 0;
  Time start = Time::fromNanoseconds(1'700'000'000'000'000'000);  ///< stamp of the first IMU sample
  ImuModelOptions imu;
  RadarModelOptions radar;
  TimeOffsetProfile time_offset;
  Extrinsics T_IR{Eigen::Vector3d(0.03, 0.03, -0.06),
                  Eigen::Quaterniond(0.00524, 0.69946, 0.71461, 0.00723).normalized()};  ///< of the IRS rig
};

/// What the sensors of one rig measure on one motion.
struct SensorData {
  ImuData imu;
  std::vector<SimulatedScan> scans;
};

/// The same motion and options give the same data, bit for bit.
SensorData simulate(const Motion& motion, const SimulationOptions& options);

/// True poses at `rate` [Hz] from the start to the end.
Trajectory groundTruth(const Motion& motion, double rate, Time start);

}  // namespace rio_t::simulation
