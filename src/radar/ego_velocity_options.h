#pragma once

#include "rio_t/radar/ego_velocity.h"

namespace rio_t {

/// The same options. Throws std::invalid_argument, naming the option, if one is out of its range.
EgoVelocityOptions validated(const EgoVelocityOptions& options);

/// The options with the step that holds, and with the thresholds that were left to it (0).
/// - Inlier: the step rounds by up to half of itself; 2.5 sigma keep 99 % of the noise besides.
/// - Zero: within the zero bin. If the noise is larger than that, 1.5 sigma keep 87 % of the points at rest,
///   and zero_velocity_outlier_fraction of them may lie beyond.
/// A sigma of 0 counts as PointNoise::kMinStartDopplerSigma.
EgoVelocityOptions withStep(EgoVelocityOptions options, double step);

}  // namespace rio_t
