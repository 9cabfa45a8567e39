#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/radar/doppler_grid.h"
#include "rio_t/radar/doppler_likelihood.h"
#include "rio_t/radar/doppler_span.h"
#include "rio_t/radar/point_noise.h"
#include "rio_t/radar/scan.h"
#include "rio_t/radar/velocity_prior.h"

namespace rio_t {

/// How the velocity is solved for from the RANSAC inliers.
enum class EgoVelocitySolver {
  kLeastSquares,       ///< plain least squares: all weight on the Doppler, directions taken as exact
  kErrorsInVariables,  ///< weighted by direction noise, and compensated for the attenuation it causes
};

struct EgoVelocityOptions {
  double min_range = 0.25;   ///< [m]
  double max_range = 100.0;  ///< [m]
  double min_snr_db = 3.0;   ///< [dB]
  /// [rad] from the y (forward) axis, either side. The noise model weighs points at the edge.
  double max_azimuth = 1.570796;
  double max_elevation = 1.570796;  ///< [rad] either side

  /// [m/s] a Doppler below counts as zero; 0: half the step, or 1.5 doppler_sigma if that is more
  double zero_velocity_threshold = 0.0;
  double zero_velocity_outlier_fraction = 0.25;  ///< share of Dopplers that may exceed it at rest
  double zero_velocity_sigma = 0.025;            ///< [m/s] per axis at rest, besides the Doppler bin

  /// [m/s] Doppler residual of an inlier; 0: half the step and 2.5 doppler_sigma
  double ransac_inlier_threshold = 0.0;
  double ransac_outlier_probability = 0.4;
  double ransac_success_probability = 0.9999;
  double prior_gate = 4.0;        ///< [sigma] a velocity farther than this from the prior contradicts it
  std::uint32_t ransac_seed = 1;  ///< restarted at each scan: same scan, same answer

  std::size_t min_inliers = 5;              ///< a velocity has three unknowns; the other points confirm it
  double min_inlier_fraction = 0.4;         ///< of the points after the filter; fewer agree by chance
  double prior_min_inlier_fraction = 0.15;  ///< likewise, for points that agree with the prior

  EgoVelocitySolver solver = EgoVelocitySolver::kErrorsInVariables;
  // Noise of a point to start with; PointNoise learns on from there. The defaults are what the Doppler
  // residuals of a walk with an IWR6843AOP show (0.022 rad, 0.045 rad, 0.032 m/s), rounded up.
  double azimuth_sigma = 0.03;    ///< [rad]
  double elevation_sigma = 0.05;  ///< [rad]
  double doppler_sigma = 0.035;   ///< [m/s] besides the quantisation

  /// [m/s] step of the radar's Doppler; 0: read off the data, which may show none. See DopplerGrid.
  double doppler_quantization = 0.0;
  double doppler_span = 0.0;  ///< [m/s] Dopplers beyond come back on the other side; 0 = read it off the data
  /// [m/s] right, forward, up; added in quadrature while moving. The solver's covariance is right for noise
  /// that is independent from point to point (its NEES is 3 in simulation). This sigma stands for errors that
  /// points share: things that move so slowly that they pass as inliers, a velocity that changes within the
  /// radar frame (20 ms at 1 m/s^2), multipath. On a walk with an IWR6843AOP the velocity errors are 0.06 m/s
  /// and last for several scans.
  Eigen::Vector3d added_sigma = {0.04, 0.04, 0.04};
  double max_condition_number = 1000.0;  ///< of H'H (unit directions), and of the information
  double max_sigma = 0.5;                ///< [m/s] largest axis of the estimate, in motion
};

/// Knowledge about a radar from its scans so far.
struct RadarKnowledge {
  PointVariances noise;
  KnownDoppler doppler_step, doppler_span;
  KnownDoppler read_doppler_step;  ///< as the data show it, even if another one is given
};

/// Whether a scan gave a velocity and, if not, why.
enum class EgoVelocityStatus {
  kMoving,          ///< solved for from the inliers
  kZeroVelocity,    ///< at rest; the covariance covers the motion that the Doppler bin hides
  kTooFewPoints,    ///< fewer than 3 points after the filter
  kTooFewInliers,   ///< no velocity that enough points agree on
  kIllConditioned,  ///< the directions do not span 3D
  kSigmaTooLarge,   ///< in motion, uncertainty above max_sigma
  kNotEstimated,    ///< not computed
};
bool isValid(EgoVelocityStatus status);          ///< kMoving or kZeroVelocity
std::string toString(EgoVelocityStatus status);  ///< snake case, e.g. "too_few_points"

struct EgoVelocity {
  EgoVelocityStatus status = EgoVelocityStatus::kNotEstimated;
  Eigen::Vector3d v_R = Eigen::Vector3d::Zero();         ///< radar velocity, radar frame [m/s]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< [m^2/s^2], radar frame
  /// The part of the covariance's diagonal that comes from the options, not from the data: `added_sigma`
  /// squared, or zero at rest [m^2/s^2].
  Eigen::Vector3d added_variance = Eigen::Vector3d::Zero();
  /// Points with Dopplers near zero show a slow motion: the platform is not at rest, whatever the IMU shows.
  bool denies_rest = false;
  /// The points that passed the filter: indices into the scan's points, ascending.
  std::vector<std::size_t> points;
  std::vector<std::size_t> inliers;  ///< those of them that agree on the velocity
};

/// Whether most points of the scan agree on the velocity, so that it needs no prior.
bool hasMajority(const EgoVelocity& velocity);
/// Whether so many points agree that they must be the static world: no object fills as much of the view.
bool isUnanimous(const EgoVelocity& velocity);

/// Ego-velocity of one scan: filter, zero-velocity test, 3-point RANSAC, least squares.
/// A static target in direction u gives v_d = -u . v_R (Kellner et al., ITSC 2013).
class EgoVelocityEstimator {
 public:
  /// The options must be in the ranges of their parameters (docs/parameters.md), which are checked there.
  /// Throws std::invalid_argument if doppler_quantization is negative or not finite.
  explicit EgoVelocityEstimator(const EgoVelocityOptions& options);

  /// A prior distinguishes the static world from a moving object that fills half of the view; one scan alone
  /// cannot. If the RANSAC velocity contradicts the prior, and `prior_min_inlier_fraction` of the points
  /// agree with a velocity that does not, those points are the inliers. The velocity and its covariance come
  /// from the points alone, so fusing the result with the prior counts nothing twice.
  EgoVelocity estimate(const RadarScan& scan, const std::optional<VelocityPrior>& prior = std::nullopt) const;

  /// As EgoVelocity::denies_rest, for a scan with the points of many scans that have one velocity.
  bool deniesRest(const RadarScan& scan) const;
  /// The scan with only those points that pass the filter and read zero or the bin beside it.
  RadarScan slowPoints(const RadarScan& scan) const;

  /// Learns the step of the Doppler, the thresholds that follow from it, its span, and how far the directions
  /// spread. Call it once per scan, before `estimate`, whether the scan is used or not. Returns false and
  /// learns nothing if the scan repeats the points of the last one under a new stamp. Scans at rest are
  /// exempt: only while the radar moves, no two scans are the same to the last bit.
  bool observe(const RadarScan& scan);

  /// Compares a scan that has no velocity of its own with a prior. The inliers are the points within three
  /// sigma of the prior. The result is valid if the inliers are the majority of the points; one point is
  /// enough. v_R is that of the prior, and there is no covariance.
  EgoVelocity around(const RadarScan& scan, const VelocityPrior& prior) const;
  /// The velocity and the points of the static world. In general this is `estimated`. If the steps of the
  /// Doppler are wider than the threshold of the inliers, it is the prior with the points that agree with it,
  /// as long as these are the majority. The reason: an estimate from such Dopplers lies near the middle of a
  /// bin. Its inliers leave out points that read the next bin, and the others are all too slow.
  EgoVelocity staticWorld(const RadarScan& scan, const EgoVelocity& estimated,
                          const std::optional<VelocityPrior>& prior) const;
  /// Likelihood of the Dopplers of some points. These look static at about `v_R` [m/s].
  DopplerLikelihood likelihood(const RadarScan& scan, const std::vector<std::size_t>& points,
                               const Eigen::Vector3d& v_R) const;

  /// Learns the noise of the points from the result of `estimate` for this scan, for the scans to come. Only
  /// the errors-in-variables solver uses it. Call it once per scan, in motion, if the velocity was used.
  /// A `prior` that is independent of the scan shows noise that the bins hide. `world` is the likelihood of
  /// `staticWorld`, if the caller has it.
  void learn(const RadarScan& scan, const EgoVelocity& estimated,
             const std::optional<VelocityPrior>& prior = std::nullopt,
             const DopplerLikelihood* world = nullptr);
  RadarKnowledge knowledge() const { return {noise(), grid_.step(), span_.known(), grid_.read()}; }
  const PointVariances& noise() const { return noise_.variances(); }
  /// The options in use. Thresholds that were given as 0 have the values that follow from the step.
  const EgoVelocityOptions& options() const { return options_; }

 private:
  void learnSpan(const std::vector<RadarDirection>& points);

  EgoVelocityOptions given_;  // read-only after construction
  int ransac_iterations_;     // read-only after construction
  DopplerGrid grid_;
  DopplerSpan span_;
  RadarScan observed_;                 ///< the last scan, to recognise a repeated one
  std::optional<TwoReadings> before_;  ///< of the last scan, if it may show the span
  EgoVelocityOptions options_;         // given_, with what follows from the step
  PointNoise noise_;
};

}  // namespace rio_t
