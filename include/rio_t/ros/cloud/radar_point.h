#pragma once

#include <pcl/point_types.h>
#include <pcl/register_point_struct.h>

#include <Eigen/Core>

namespace rio_t {

/// The SNR of a point whose SNR is not known. It is above every sensible minimum, so that the filter keeps
/// the point.
constexpr float kUnknownSnrDb = 1000.0F;

/// One detection as a PCL point, in metres. Decoded, it has RIO axes: x right, y forward, z up; in `~points`
/// and `~inliers`, x is forward, y left, z up. PCL's own templates take it (`pcl::transformPointCloud`,
/// filters, `pcl::fromROSMsg` of those topics); those that PCL ships compiled need
/// `#define PCL_NO_PRECOMPILE` before the first include of PCL.
struct EIGEN_ALIGN16 RadarPointPcl {
  PCL_ADD_POINT4D            // x, y, z; data[3] is 1
      float doppler = 0.0F;  ///< range rate [m/s], positive = receding
  float snr_db = 0.0F;       ///< [dB]; kUnknownSnrDb if the driver gives no signal-to-noise ratio

  // `data` shares its memory with x, y, z.
  RadarPointPcl() : data{0.0F, 0.0F, 0.0F, 1.0F} {}  // NOLINT(cppcoreguidelines-pro-type-member-init)
  PCL_MAKE_ALIGNED_OPERATOR_NEW
};

}  // namespace rio_t

POINT_CLOUD_REGISTER_POINT_STRUCT(rio_t::RadarPointPcl,
                                  (float, x, x)(float, y, y)(float, z, z)(float, doppler,
                                                                          doppler)(float, snr_db, snr_db))
