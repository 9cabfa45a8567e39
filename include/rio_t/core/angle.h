#pragma once

#include <cmath>

namespace rio_t {

constexpr double kDegree = M_PI / 180.0;  ///< [rad]

}  // namespace rio_t
