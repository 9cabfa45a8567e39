#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/radar/extrinsics.h"

/// The calibration of a radar from several runs (docs/method.md, section 14).
namespace rio_t {

/// Mean and covariance in a vector space.
struct Gaussian {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// Whether several runs agree. A direction counts only for the runs that observed it.
struct Agreement {
  double chi_squared = 0.0;    ///< of the runs about their common mean
  int degrees_of_freedom = 0;  ///< 0: no direction was observed by two runs, and nothing can disagree

  /// Whether chi_squared is at most as unlikely as 2.6 sigma of one number, which is one case in a hundred.
  bool agree() const;
  /// Factor on the sigmas of the runs that gives chi_squared its expected value; 1 if they agree.
  double widening() const;
};

/// An estimate from several runs.
template <typename Estimate>
struct Combined {
  Estimate estimate;
  Agreement agreement;
};

/// Combines the posteriors of runs that started from the same prior. Each posterior contains the prior, which
/// must count only once: L = L0 + sum (L_i - L0). If the runs disagree, `widening` lowers the sum.
Combined<Gaussian> combine(const Gaussian& prior, const std::vector<Gaussian>& posteriors);

/// Extrinsics with their covariance in the tangent of ExtrinsicsManifold: 3x3 of a turn, or 6x6 with lever.
struct ExtrinsicsEstimate {
  Extrinsics T_IR;
  Eigen::MatrixXd covariance;
};

/// The same for extrinsics, in the tangent at the first posterior.
Combined<ExtrinsicsEstimate> combine(const ExtrinsicsEstimate& prior,
                                     const std::vector<ExtrinsicsEstimate>& posteriors);

/// Time offset of a radar.
struct OffsetEstimate {
  double t_O = 0.0;    ///< [s]
  double sigma = 0.0;  ///< [s]
};

/// If the runs disagree, each may have its own offset: the estimate is their mean, its sigma covers their
/// scatter.
Combined<OffsetEstimate> combine(const OffsetEstimate& prior, const std::vector<OffsetEstimate>& posteriors);

/// A number is observed if its sigma is at most this share of the configured one. The runs then have three
/// times the information of the configuration: 1 / 0.5^2 = 1 + 3. Above it, the configuration dominates.
inline constexpr double kObservedSigmaShare = 0.5;

enum class Verdict {
  kObserved,
  kNotObserved,
  kNotEstimated,  ///< it is as configured
};
std::string toString(Verdict verdict);  ///< "observed", "not observed", "not estimated"

/// The numbers that the calibration of a radar finds. RadarCalibration::axes has them in this order.
enum class CalibrationAxis { kOffset, kTurnX, kTurnY, kTurnZ, kLeverX, kLeverY, kLeverZ };
inline constexpr std::size_t kCalibrationAxes = 7;

/// How the platform has to move to make it observed: "change speed or turn quickly".
std::string whatToMove(CalibrationAxis axis);

struct AxisCalibration {
  double configured = 0.0;  ///< [s], [rad] zero, [m]
  double found = 0.0;       ///< a turn: about the axis of I, from what was configured
  double sigma = 0.0;
  double configured_sigma = 0.0;  ///< zero: not estimated
  Verdict verdict = Verdict::kNotEstimated;

  /// |found - configured| in configured sigmas; 0 if it is not estimated.
  double farFromConfigured() const;
};

struct RadarCalibration {
  std::array<AxisCalibration, kCalibrationAxes> axes;  ///< by CalibrationAxis
  OffsetEstimate offset;                               ///< as configured if it is not observed
  Extrinsics T_IR;                                     ///< likewise, each axis by itself
  Agreement offset_agreement, extrinsics_agreement;

  /// [rad] The largest sigma of a turn of T_IR: as found, or as configured if it is not observed.
  double turnSigma() const { return largestSigma(CalibrationAxis::kTurnX); }
  double leverArmSigma() const { return largestSigma(CalibrationAxis::kLeverX); }  ///< [m] likewise

 private:
  double largestSigma(CalibrationAxis first) const;  ///< of three axes
};

/// `offset` and `mounting` are as configured, `offsets` and `mountings` as the runs found them, at least one.
/// A sigma of zero says that the number is not estimated.
RadarCalibration calibrate(const OffsetEstimate& offset, const ExtrinsicsEstimate& mounting,
                           const std::vector<OffsetEstimate>& offsets,
                           const std::vector<ExtrinsicsEstimate>& mountings);

}  // namespace rio_t
