#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rio_t/radar/doppler_likelihood.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/radar/scan.h"

namespace rio_t {

struct LikeliestVelocity {
  Eigen::Vector3d v_R;
  double cost = 0.0;            ///< minus the logarithm of the likelihood and of the prior
  Eigen::Matrix3d information;  ///< of the points, of their bins and of the prior; may be singular
};

/// The likeliest velocity of a scan and an independent `prior`, if any. The search begins at `v_R`.
LikeliestVelocity findLikeliest(const DopplerLikelihood& likelihood,
                                const std::optional<VelocityPrior>& prior, const Eigen::Vector3d& v_R);

struct VelocitySolution {
  bool solved = false;  ///< false: the directions do not span 3D
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< without added_sigma
};

/// [m/s] Sigma along the largest axis of a covariance.
double largestSigma(const Eigen::Matrix3d& covariance);

/// v = -(H'H)^-1 H'd, covariance s^2 (H'H)^-1; s^2 is the variance of the residuals, or q^2/12 if larger.
VelocitySolution solveLeastSquares(const std::vector<RadarDirection>& points,
                                   const EgoVelocityOptions& options);

/// The likeliest velocity; see DopplerLikelihood. The search begins at `v_R`. Residuals that are larger than
/// `noise` predicts widen the covariance.
VelocitySolution solveLikelihood(const std::vector<RadarDirection>& points, const PointVariances& noise,
                                 const Eigen::Vector3d& v_R, const EgoVelocityOptions& options);

/// A velocity with its covariance. Unsolved if the information [s^2/m^2] leaves some direction unseen.
VelocitySolution solutionOf(const Eigen::Vector3d& v_R, const Eigen::Matrix3d& information,
                            const EgoVelocityOptions& options);

}  // namespace rio_t
