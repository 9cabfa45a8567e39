#pragma once

#include "parameter_list.h"

/// The sections of the registry. Each function adds its keys: with their unit, range, member and text.
namespace rio_t {

inline Range anyNumber() { return {}; }
inline Range atLeast(double min) { return {min, anyNumber().max, false, false}; }
inline Range above(double min) { return {min, anyNumber().max, true, false}; }
inline Range above(double min, double max) { return {min, max, true, false}; }
inline Range between(double min, double max) { return {min, max, false, false}; }
inline Range inside(double min, double max) { return {min, max, true, true}; }
inline Range below(double min, double max) { return {min, max, false, true}; }  ///< min itself counts

// Input, and where the sensors are.
void listTopics(ParameterList& list, Config& config);
void listRadars(ParameterList& list, Config& config);
void listStamps(ParameterList& list, Config& config);
void listFrames(ParameterList& list, Config& config);
void listPointCloud(ParameterList& list, Config& config);
void listExtrinsics(ParameterList& list, Config& config);
void listEstimateExtrinsics(ParameterList& list, Config& config);

// The sensors.
void listImu(ParameterList& list, Config& config);
void listGaps(ParameterList& list, Config& config);
void listEgoVelocity(ParameterList& list, Config& config);
void listFeasibility(ParameterList& list, Config& config);

// The estimate.
void listInitialization(ParameterList& list, Config& config);
void listRest(ParameterList& list, Config& config);
void listTimeOffset(ParameterList& list, Config& config);
void listSmoother(ParameterList& list, Config& config);
void listHealth(ParameterList& list, Config& config);
void listLandmarks(ParameterList& list, Config& config);

// Ground vehicle, barometer.
void listPlatform(ParameterList& list, Config& config);
void listBarometer(ParameterList& list, Config& config);

// The programs.
void listLiveNode(ParameterList& list, Config& config);
void listBag(ParameterList& list, Config& config);

}  // namespace rio_t
