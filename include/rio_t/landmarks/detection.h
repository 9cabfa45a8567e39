#pragma once

#include <Eigen/Core>

#include "rio_t/core/time.h"
#include "rio_t/factors/landmark_factor.h"
#include "rio_t/graph/window.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

/// A point of a scan that looks static by its Doppler.
struct Detection {
  PolarMeasurement z;
  double snr_db = 0.0;
};

/// A detection as a term of the window needs it.
struct Sighting {
  Time node_time;
  ImuDelta delta;               ///< from the node to the time of measurement
  Block* extrinsics = nullptr;  ///< of the radar that saw it
  PolarMeasurement z;
};

/// [dB] Scatter of the echo of one reflector from scan to scan: the power of many small reflectors is
/// exponentially distributed (Swerling), and 10 log10 of that has this standard deviation.
constexpr double kEchoScatter = 5.57;

}  // namespace rio_t
