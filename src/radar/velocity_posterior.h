#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rio_t/radar/doppler_likelihood.h"
#include "rio_t/radar/velocity_prior.h"

namespace rio_t {

/// Mean of u u' over the points.
Eigen::Matrix3d meanOuterProduct(const std::vector<RadarDirection>& points);

/// [s^2/m^2] This factor times meanOuterProduct() is the information that the bins give the velocity. The
/// source derives it.
double binInformation(double doppler_step, double doppler_variance);

struct LikeliestVelocity {
  Eigen::Vector3d v_R;
  VelocityCost cost;  ///< there, with that of the prior
};

/// The likeliest velocity of a scan whose `prior`, if any, knows nothing of it. The search begins at `v_R`.
LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R);

struct VelocityPosterior {
  Eigen::Vector3d v_R;
  Eigen::Matrix3d covariance;
};

/// The likeliest velocity of the `points` of a scan, and what they and the prior leave open. The search
/// begins at `v_R`.
VelocityPosterior findPosterior(const std::vector<RadarDirection>& points, const PointVariances& noise,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R);

}  // namespace rio_t
