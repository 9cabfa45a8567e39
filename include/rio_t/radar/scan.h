#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/core/time.h"

namespace rio_t {

/// One detection, in the radar frame R of the calibration T_IR (RIO axes: x right, y forward, z up).
struct RadarPoint {
  Eigen::Vector3d position_R = Eigen::Vector3d::Zero();  ///< [m]
  double doppler = 0.0;  ///< range rate [m/s]: positive = receding, so v_d = -u . v_R for a static target
  double snr_db = 0.0;   ///< signal to noise [dB]; or the intensity if the driver gives no SNR
  bool is_ambiguous = false;  ///< the radar could not tell the direction, see markAmbiguous()
};

/// [m/s] A larger Doppler is a special value of the driver, like -999 for "no Doppler".
constexpr double kLargestDoppler = 100.0;

/// One scan of the radar. All points are finite, and none is padding (the decoder drops and counts those).
struct RadarScan {
  Time stamp;  ///< as stamped, in the IMU clock; measured at stamp - t_O
  std::vector<RadarPoint> points;
  std::size_t radar = 0;  ///< index of its radar, see Estimator
};

/// Whether a radar may have this name. Keys, topics and files contain it.
inline bool isRadarName(const std::string& text) {
  return !text.empty() &&
         text.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_") == std::string::npos;
}

/// A detection as the solvers see it.
struct RadarDirection {
  Eigen::Vector3d u_R;    ///< unit vector to the target
  double doppler = 0;     ///< range rate [m/s]
  std::size_t index = 0;  ///< into the scan's points
};

}  // namespace rio_t
