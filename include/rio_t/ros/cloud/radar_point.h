#pragma once

#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

namespace rio_t {

/// One detection as a PCL point, in RIO axes: x right, y forward, z up.
struct RadarPointPcl {
  float x = 0.0F;        ///< [m]
  float y = 0.0F;        ///< [m]
  float z = 0.0F;        ///< [m]
  float doppler = 0.0F;  ///< range rate [m/s], positive = receding
  float snr_db = 0.0F;   ///< [dB]; kUnknownSnrDb where the driver gives no signal-to-noise ratio
};

/// Stands for "not known": above every sensible minimum, so that the SNR filter lets such points through.
constexpr float kUnknownSnrDb = 1000.0F;

}  // namespace rio_t

POINT_CLOUD_REGISTER_POINT_STRUCT(rio_t::RadarPointPcl,
                                  (float, x, x)(float, y, y)(float, z, z)(float, doppler,
                                                                          doppler)(float, snr_db, snr_db))
