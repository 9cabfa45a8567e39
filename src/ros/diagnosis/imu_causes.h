#pragma once

#include <vector>

#include "rio_t/ros/diagnosis/diagnosis.h"

namespace rio_t {

/// A fault of the IMU shows if it takes a larger share of the samples.
inline constexpr double kManySamples = 0.05;

/// Share of the IMU samples that have faults, at most 1.
double shareOfImuFaults(const RunEvidence& evidence);

/// Everything that speaks of the samples of the IMU: their faults and their noise.
void addCausesOfImu(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes);

}  // namespace rio_t
