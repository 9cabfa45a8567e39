#pragma once

#include "parameter_list.h"

/// The sections of the registry, in order. Each function adds keys with their unit, range, member and text.
namespace rio_t {

inline Range anyNumber() { return {}; }
inline Range atLeast(double min) { return {min, anyNumber().max, false, false}; }
inline Range above(double min, double max = anyNumber().max) { return {min, max, true, false}; }
inline Range between(double min, double max) { return {min, max, false, false}; }
inline Range inside(double min, double max) { return {min, max, true, true}; }
inline Range below(double min, double max) { return {min, max, false, true}; }  ///< min itself counts
inline Range zeroOr(double min, double max) { return {min, max, false, false, true}; }

/// Bounds of a standard deviation, in SI units. The solver divides rows by standard deviations. Doubles have
/// 15 digits, and these bounds are 12 digits apart, so three digits remain for the values themselves. Squares
/// stay finite.
constexpr double kLeastSigma = 1e-9;
constexpr double kLargestSigma = 1e3;
inline Range sigma(double max = kLargestSigma) { return between(kLeastSigma, max); }

void listMessages(ParameterList& list, Config& config);
void listFrames(ParameterList& list, Config& config);
void listPointCloud(ParameterList& list, Config& config);
void listExtrinsics(ParameterList& list, Config& config);
void listImu(ParameterList& list, Config& config);
void listStart(ParameterList& list, Config& config);
void listAids(ParameterList& list, Config& config);
void listRadar(ParameterList& list, Config& config);
void listTimeOffset(ParameterList& list, Config& config);
void listSmoother(ParameterList& list, Config& config);
void listHealthAndLandmarks(ParameterList& list, Config& config);
void listPrograms(ParameterList& list, Config& config);

}  // namespace rio_t
