#pragma once

#include <Eigen/Core>
#include <optional>

#include "rio_t/radar/doppler_likelihood.h"
#include "rio_t/radar/velocity_prior.h"

namespace rio_t {

struct LikeliestVelocity {
  Eigen::Vector3d v_R;
  double cost = 0.0;            ///< minus the logarithm of the likelihood and of the prior
  Eigen::Matrix3d information;  ///< of the points, of their bins and of the prior; may be singular
};

/// The likeliest velocity of a scan whose `prior`, if any, knows nothing of it. The search begins at `v_R`.
LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R);

}  // namespace rio_t
