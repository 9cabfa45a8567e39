#include "ego_velocity_options.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace rio_t {
namespace {

void require(bool holds, const char* option, const char* expected) {
  if (!holds) throw std::invalid_argument(std::string("ego velocity: ") + option + " must be " + expected);
}

}  // namespace

EgoVelocityOptions validated(const EgoVelocityOptions& o) {
  // Written so that NaN fails.
  require(o.min_range >= 0.0, "min_range", "at least 0 m");
  require(o.max_range > o.min_range, "max_range", "above min_range");
  require(std::isfinite(o.min_snr_db), "min_snr_db", "finite");
  require(o.max_azimuth > 0.0 && o.max_azimuth <= M_PI, "max_azimuth", "above 0 and at most pi rad");
  require(o.max_elevation > 0.0 && o.max_elevation <= M_PI_2, "max_elevation",
          "above 0 and at most pi/2 rad");
  require(o.zero_velocity_threshold >= 0.0, "zero_velocity_threshold", "at least 0 m/s");
  require(o.zero_velocity_outlier_fraction >= 0.0 && o.zero_velocity_outlier_fraction < 1.0,
          "zero_velocity_outlier_fraction", "in [0, 1)");
  require(o.zero_velocity_sigma > 0.0, "zero_velocity_sigma", "above 0 m/s");
  require(o.ransac_inlier_threshold >= 0.0, "ransac_inlier_threshold", "at least 0 m/s");
  require(o.ransac_outlier_probability >= 0.0 && o.ransac_outlier_probability < 1.0,
          "ransac_outlier_probability", "in [0, 1)");
  require(o.ransac_success_probability > 0.0 && o.ransac_success_probability < 1.0,
          "ransac_success_probability", "in (0, 1)");
  require(o.prior_gate > 0.0, "prior_gate", "above 0");
  require(o.min_inlier_fraction >= 0.0 && o.min_inlier_fraction <= 1.0, "min_inlier_fraction", "in [0, 1]");
  require(o.azimuth_sigma >= 0.0 && o.azimuth_sigma < 0.5, "azimuth_sigma", "in [0, 0.5) rad");
  require(o.elevation_sigma >= 0.0 && o.elevation_sigma < 0.5, "elevation_sigma", "in [0, 0.5) rad");
  require(o.doppler_sigma >= 0.0, "doppler_sigma", "at least 0 m/s");
  require(o.doppler_quantization >= 0.0 && std::isfinite(o.doppler_quantization), "doppler_quantization",
          "finite and at least 0 m/s");
  require(o.doppler_span >= 0.0, "doppler_span", "at least 0 m/s");
  require((o.added_sigma.array() >= 0.0).all(), "added_sigma", "at least 0 m/s");
  require(o.max_condition_number > 1.0, "max_condition_number", "above 1");
  require(o.max_sigma > 0.0, "max_sigma", "above 0 m/s");
  return o;
}

EgoVelocityOptions withStep(EgoVelocityOptions o, double step) {
  const double sigma = std::max(o.doppler_sigma, PointNoise::kMinStartDopplerSigma);
  o.doppler_quantization = step;
  if (o.ransac_inlier_threshold == 0.0) o.ransac_inlier_threshold = 0.5 * step + 2.5 * sigma;
  if (o.zero_velocity_threshold == 0.0) o.zero_velocity_threshold = std::max(0.5 * step, 1.5 * sigma);
  return o;
}

}  // namespace rio_t
