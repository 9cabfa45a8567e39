#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/radar/point_noise.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

/// The noise told, with more Doppler noise if the errors of the points at `v_R` surely scatter by more than
/// it says. A radar may be noisier than it was said to be, and what is learned comes late.
PointVariances withScatter(const PointVariances& told, const std::vector<RadarDirection>& points,
                           const Eigen::Vector3d& v_R);

}  // namespace rio_t
