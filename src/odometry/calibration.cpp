#include "rio_t/odometry/calibration.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

/// 2.6 sigma to either side leave a probability of 0.93 %, and so do 2.354 sigma to one side.
constexpr double kOneSided = 2.354;

/// The value that chi-squared exceeds with that probability, by Wilson and Hilferty.
double largestChiSquared(int degrees_of_freedom) {
  const double n = degrees_of_freedom;
  return n * std::pow(1.0 - 2.0 / (9.0 * n) + kOneSided * std::sqrt(2.0 / (9.0 * n)), 3);
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& positive_definite) {
  const Eigen::LLT<Eigen::MatrixXd> factor(positive_definite);
  if (factor.info() != Eigen::Success)
    throw std::runtime_error("calibration: a covariance is not positive definite");
  return factor.solve(Eigen::MatrixXd::Identity(positive_definite.rows(), positive_definite.cols()));
}

/// A run's information about a direction, in units of the prior's sigma: cost 0.5 information x^2 - pull x.
struct Direction {
  Eigen::VectorXd unit;
  double information;  // 1: as much as the prior
  double pull;
};

/// Cost 0.5 x' A x - b' x.
struct InformationSum {
  explicit InformationSum(Eigen::Index size)
      : A(Eigen::MatrixXd::Zero(size, size)), b(Eigen::VectorXd::Zero(size)) {}
  void add(const Direction& direction) {
    A += direction.information * direction.unit * direction.unit.transpose();
    b += direction.pull * direction.unit;
  }

  Eigen::MatrixXd A;
  Eigen::VectorXd b;
};

std::vector<Direction> directionsOf(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
  std::vector<Direction> directions;
  for (Eigen::Index i = 0; i < b.size(); ++i) {
    const Eigen::VectorXd unit = eigen.eigenvectors().col(i);
    directions.push_back({unit, eigen.eigenvalues()[i], unit.dot(b)});
  }
  return directions;
}

/// Chi-squared of the runs about their common minimum, over the directions that each has observed.
Agreement agreementOf(const std::vector<std::vector<Direction>>& runs, Eigen::Index size) {
  // A run that observes a direction adds at least so much information.
  constexpr double kLeast = 1.0 / (kObservedSigmaShare * kObservedSigmaShare) - 1.0;
  constexpr double kRounding = 1e-6;
  InformationSum sum(size);
  Agreement agreement;
  for (const std::vector<Direction>& run : runs) {
    for (const Direction& direction : run) {
      if (direction.information < kLeast) continue;
      sum.add(direction);
      agreement.chi_squared += direction.pull * direction.pull / direction.information;
      ++agreement.degrees_of_freedom;
    }
  }
  for (const Direction& direction : directionsOf(sum.A, sum.b)) {
    if (direction.information < kRounding * kLeast) continue;  // no run observed it
    agreement.chi_squared -= direction.pull * direction.pull / direction.information;
    --agreement.degrees_of_freedom;
  }
  return agreement;
}

/// The estimate in the tangent at `origin`.
Gaussian inTangent(const ExtrinsicsManifold& manifold, const ExtrinsicsEstimate& estimate,
                   const Eigen::VectorXd& origin) {
  const Eigen::VectorXd x = stored(estimate.T_IR);
  const Eigen::MatrixXd J = manifold.minusJacobian(x.data(), origin.data());
  return {manifold.minus(x.data(), origin.data()), J * estimate.covariance * J.transpose()};
}

Gaussian asGaussian(const OffsetEstimate& offset) {
  return {Eigen::VectorXd::Constant(1, offset.t_O),
          Eigen::MatrixXd::Constant(1, 1, offset.sigma * offset.sigma)};
}

Verdict verdictOf(double sigma, double configured_sigma) {
  if (configured_sigma == 0.0) return Verdict::kNotEstimated;
  return sigma <= kObservedSigmaShare * configured_sigma ? Verdict::kObserved : Verdict::kNotObserved;
}

/// The mean over the runs that observed the offset. Each run has its own, and the sigma covers them.
OffsetEstimate scattered(double configured_sigma, const std::vector<OffsetEstimate>& runs) {
  std::vector<OffsetEstimate> observed;
  for (const OffsetEstimate& run : runs)
    if (verdictOf(run.sigma, configured_sigma) == Verdict::kObserved) observed.push_back(run);
  const auto count = static_cast<double>(observed.size());
  OffsetEstimate result;
  for (const OffsetEstimate& run : observed) result.t_O += run.t_O / count;
  double variance = 0.0;
  for (const OffsetEstimate& run : observed) {
    const double apart = run.t_O - result.t_O;
    variance += apart * apart / (count - 1.0) + run.sigma * run.sigma / count;
  }
  result.sigma = std::sqrt(variance);
  return result;
}

void calibrateOffset(const OffsetEstimate& configured, const std::vector<OffsetEstimate>& runs,
                     RadarCalibration* calibration) {
  AxisCalibration& axis = calibration->axes[static_cast<std::size_t>(CalibrationAxis::kOffset)];
  axis.configured = axis.found = configured.t_O;
  calibration->offset = configured;
  if (configured.sigma == 0.0) return;
  const Combined<OffsetEstimate> combined = combine(configured, runs);
  calibration->offset_agreement = combined.agreement;
  axis.found = combined.estimate.t_O;
  axis.sigma = combined.estimate.sigma;
  axis.configured_sigma = configured.sigma;
  // Runs that disagree have each observed it.
  axis.verdict = combined.agreement.agree() ? verdictOf(axis.sigma, configured.sigma) : Verdict::kObserved;
  if (axis.verdict == Verdict::kObserved) calibration->offset = combined.estimate;
}

void calibrateExtrinsics(const ExtrinsicsEstimate& configured, const std::vector<ExtrinsicsEstimate>& runs,
                         RadarCalibration* calibration) {
  constexpr auto kTurn = static_cast<std::size_t>(CalibrationAxis::kTurnX);
  constexpr auto kLever = static_cast<std::size_t>(CalibrationAxis::kLeverX);
  calibration->T_IR = configured.T_IR;
  for (std::size_t i = 0; i < 3; ++i) {
    AxisCalibration& lever = calibration->axes[kLever + i];
    lever.configured = lever.found = configured.T_IR.l_I[static_cast<Eigen::Index>(i)];
  }
  if (configured.covariance.rows() == 0) return;
  const Combined<ExtrinsicsEstimate> combined = combine(configured, runs);
  calibration->extrinsics_agreement = combined.agreement;

  const Eigen::Vector3d found = turnBetween(configured.T_IR, combined.estimate.T_IR);
  Eigen::Vector3d unobserved = Eigen::Vector3d::Zero();  // the part of `found` about unobserved axes
  bool any_observed = false;
  for (Eigen::Index i = 0; i < configured.covariance.rows(); ++i) {
    const std::size_t first = i < 3 ? kTurn : kLever;
    const Eigen::Index k = i % 3;
    AxisCalibration& axis = calibration->axes[first + static_cast<std::size_t>(k)];
    axis.found = i < 3 ? found[k] : combined.estimate.T_IR.l_I[k];
    axis.sigma = std::sqrt(combined.estimate.covariance(i, i));
    axis.configured_sigma = std::sqrt(configured.covariance(i, i));
    axis.verdict = verdictOf(axis.sigma, axis.configured_sigma);
    const bool is_observed = axis.verdict == Verdict::kObserved;
    if (i >= 3) {
      if (is_observed) calibration->T_IR.l_I[k] = axis.found;
    } else if (is_observed) {
      any_observed = true;
    } else {
      unobserved[k] = axis.found;
    }
  }
  // Takes back the unobserved turns. The other turns keep what the runs found, also to second order.
  if (any_observed)
    calibration->T_IR.q_IR = (so3::exp(-unobserved) * combined.estimate.T_IR.q_IR).normalized();
}

}  // namespace

bool Agreement::agree() const {
  return degrees_of_freedom == 0 || chi_squared <= largestChiSquared(degrees_of_freedom);
}

double Agreement::widening() const { return agree() ? 1.0 : std::sqrt(chi_squared / degrees_of_freedom); }

Combined<Gaussian> combine(const Gaussian& prior, const std::vector<Gaussian>& posteriors) {
  if (posteriors.empty()) throw std::invalid_argument("calibration: nothing to combine");
  // In units of the prior's sigma, about its mean: the prior has information 1 in each direction.
  const Eigen::LLT<Eigen::MatrixXd> root(prior.covariance);
  if (root.info() != Eigen::Success)
    throw std::invalid_argument("calibration: the covariance of what is configured is not positive definite");
  const auto whitened = [&](const Eigen::MatrixXd& x) -> Eigen::MatrixXd { return root.matrixL().solve(x); };
  const Eigen::Index size = prior.mean.size();
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(size, size);
  std::vector<std::vector<Direction>> runs;
  InformationSum sum(size);
  for (const Gaussian& posterior : posteriors) {
    const Eigen::MatrixXd L_i = inverse(whitened(whitened(posterior.covariance).transpose()));
    runs.push_back(directionsOf(L_i - one, L_i * whitened(posterior.mean - prior.mean)));
    for (const Direction& direction : runs.back())
      if (direction.information > 0.0)
        sum.add(direction);  // less than the prior is rounding, or a step of the offset
  }
  Combined<Gaussian> result;
  result.agreement = agreementOf(runs, size);
  const double factor = std::pow(result.agreement.widening(), 2);
  const Eigen::MatrixXd covariance = inverse(one + sum.A / factor);
  const Eigen::MatrixXd L = root.matrixL();
  result.estimate.mean = prior.mean + L * (covariance * (sum.b / factor));
  result.estimate.covariance = L * covariance * L.transpose();
  return result;
}

Combined<ExtrinsicsEstimate> combine(const ExtrinsicsEstimate& prior,
                                     const std::vector<ExtrinsicsEstimate>& posteriors) {
  if (posteriors.empty()) throw std::invalid_argument("calibration: nothing to combine");
  const ExtrinsicsManifold manifold(prior.covariance.rows() == 3 ? EstimateExtrinsics::kRotation
                                                                 : EstimateExtrinsics::kPose);
  const Eigen::VectorXd origin = stored(posteriors.front().T_IR);
  std::vector<Gaussian> tangents;
  tangents.reserve(posteriors.size());
  for (const ExtrinsicsEstimate& posterior : posteriors)
    tangents.push_back(inTangent(manifold, posterior, origin));
  const Combined<Gaussian> combined = combine(inTangent(manifold, prior, origin), tangents);
  Eigen::VectorXd x = origin;
  manifold.plus(origin.data(), combined.estimate.mean.data(), x.data());
  // The step from the first run is small, so its tangent serves at the mean, too.
  return {{toExtrinsics(x.data()), combined.estimate.covariance}, combined.agreement};
}

Combined<OffsetEstimate> combine(const OffsetEstimate& prior, const std::vector<OffsetEstimate>& posteriors) {
  std::vector<Gaussian> gaussians;
  gaussians.reserve(posteriors.size());
  for (const OffsetEstimate& posterior : posteriors) gaussians.push_back(asGaussian(posterior));
  const Combined<Gaussian> combined = combine(asGaussian(prior), gaussians);
  if (!combined.agreement.agree()) return {scattered(prior.sigma, posteriors), combined.agreement};
  return {{combined.estimate.mean[0], std::sqrt(combined.estimate.covariance(0, 0))}, combined.agreement};
}

std::string toString(Verdict verdict) {
  constexpr const char* kNames[] = {"observed", "not observed", "not estimated"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Verdict::kNotEstimated) + 1);
  return kNames[static_cast<std::size_t>(verdict)];
}

std::string whatToMove(CalibrationAxis axis) {
  constexpr const char* kMotions[] = {
      "change speed or turn quickly",         "change speed along y or z of the IMU",
      "change speed along x or z of the IMU", "change speed along x or y of the IMU",
      "rotate about y or z of the IMU",       "rotate about x or z of the IMU",
      "rotate about x or y of the IMU"};
  static_assert(std::size(kMotions) == kCalibrationAxes);
  return kMotions[static_cast<std::size_t>(axis)];
}

double RadarCalibration::largestSigma(CalibrationAxis first) const {
  double largest = 0.0;
  for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(first) + 3; ++i)
    largest =
        std::max(largest, axes[i].verdict == Verdict::kObserved ? axes[i].sigma : axes[i].configured_sigma);
  return largest;
}

double AxisCalibration::farFromConfigured() const {
  return verdict == Verdict::kNotEstimated ? 0.0 : std::abs(found - configured) / configured_sigma;
}

RadarCalibration calibrate(const OffsetEstimate& offset, const ExtrinsicsEstimate& mounting,
                           const std::vector<OffsetEstimate>& offsets,
                           const std::vector<ExtrinsicsEstimate>& mountings) {
  RadarCalibration calibration;
  calibrateOffset(offset, offsets, &calibration);
  calibrateExtrinsics(mounting, mountings, &calibration);
  return calibration;
}

}  // namespace rio_t
