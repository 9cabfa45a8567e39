#include "rio_t/odometry/motion_initializer.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <utility>

#include "rio_t/core/format.h"
#include "rio_t/core/quantile.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/graph/marginalization.h"
#include "rio_t/graph/solver.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/imu/static_initializer.h"
#include "rio_t/odometry/navigation_state.h"
#include "rio_t/odometry/options.h"
#include "rio_t/sensors/offset_evidence.h"

namespace rio_t {
namespace {

constexpr double kMinSpan = 0.8;              // share of the window that the velocities must cover
constexpr std::size_t kMinVelocities = 8;     // the line has 6 unknowns
constexpr std::size_t kMaxVelocities = 1000;  // bounds the memory
constexpr double kMaxLatency = 1.0;           // [s] of a scan; the IMU is kept for this time
constexpr int kMaxIterations = 15;
constexpr int kMaxRounds = 10;         // each finds the state, and then which scans inform the offset
constexpr double kOffsetHolds = 1e-3;  // [s] a smaller change of the offset does not change its derivatives
constexpr double kConverged = 1.0e-4;  // [sigma]
constexpr double kOutlier = 4.0;       // [sigma]
constexpr int kScaleRounds = 3;        // each finds the state, and then the scale of the errors
constexpr double kUnknowns = 7.0;      // that the velocities determine: velocity, gravity in I, t_O

/// Whether all gains are within 0.01 of each other. A smaller difference does not matter.
bool areNear(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), [](double x, double y) { return std::abs(x - y) < 0.01; });
}

/// The anchor with its tilt replaced: the shortest turn that makes `g_I` point down.
Eigen::Quaterniond withGravity(const Eigen::Quaterniond& q_WI, const Eigen::Vector3d& g_I) {
  const Eigen::Vector3d up_W = q_WI * -g_I;
  return (levelingRotation(up_W) * q_WI).normalized();
}

}  // namespace

MotionInitializer::MotionInitializer(const OdometryOptions& options, const CalibrationPrior& radar)
    : options_(options.motion_initialization),
      smoother_(options.smoother),
      g_W_(0.0, 0.0, -options.gravity),
      radar_(radar),
      noise_(options.imu_noise) {}

double MotionInitializer::imuHistory() const {
  return options_.window + 2.0 * smoother_.max_time_offset + kMaxLatency;
}

void MotionInitializer::clear() {
  velocities_.clear();
  tried_at_.reset();
}

void MotionInitializer::add(Time stamp, const EgoVelocity& velocity) {
  if (!isValid(velocity.status)) return;
  const auto after = std::lower_bound(velocities_.begin(), velocities_.end(), stamp,
                                      [](const Velocity& z, Time t) { return z.stamp < t; });
  if (after != velocities_.end() && after->stamp == stamp) return;
  velocities_.insert(after, Velocity{{{stamp}, velocity.v_R, velocity.covariance}, velocity.added_variance});
  if (velocities_.size() > kMaxVelocities) velocities_.erase(velocities_.begin());
}

std::optional<bool> MotionInitializer::isMoving(Time from, Time to, double max_speed) const {
  std::vector<double> axes[3];
  for (const Velocity& z : velocities_) {
    if (z.stamp < from || to < z.stamp) continue;
    for (int i = 0; i < 3; ++i) axes[i].push_back(z.v_R[i]);
  }
  if (axes[0].empty()) return std::nullopt;
  Eigen::Vector3d median;
  for (int i = 0; i < 3; ++i) median[i] = quantile(axes[i], 0.5);
  return median.norm() > max_speed;
}

std::optional<Initialization> MotionInitializer::solve(const ImuBuffer& imu,
                                                       const std::function<PoseAnchor(Time)>& anchorAt) {
  if (velocities_.empty() || imu.empty()) return std::nullopt;
  const auto outOfReach = [&](const Velocity& z) { return std::abs(z.stamp - imu.newest()) > imuHistory(); };
  velocities_.erase(std::remove_if(velocities_.begin(), velocities_.end(), outOfReach), velocities_.end());
  // The IMU must cover the time of measurement for any offset within the bound.
  const Time covered = imu.newest() - smoother_.max_time_offset;
  const auto after = std::upper_bound(velocities_.begin(), velocities_.end(), covered,
                                      [](Time t, const Velocity& z) { return t < z.stamp; });
  if (after == velocities_.begin() || std::prev(after)->stamp == tried_at_) return std::nullopt;
  const Time time = std::prev(after)->stamp;
  tried_at_ = time;
  const Velocities window = windowUntil(time, imu);
  if (window.empty()) return std::nullopt;
  const double span = time - window.front().stamp;
  if (span < kMinSpan * options_.window || window.size() < kMinVelocities) {
    // A reason that was reported stays until there is a new window.
    if (waiting_for_.obstacle != StartObstacle::kContradiction) {
      waiting_for_.text = formatted("radar velocities in motion: %.1f of %.1f s seen", span, options_.window);
    }
    return std::nullopt;
  }

  if (std::optional<Initialization> found = initialize(window, time, imu, anchorAt)) {
    clear();
    return found;
  }
  velocities_.erase(velocities_.begin(),
                    std::find_if(velocities_.begin(), velocities_.end(),
                                 [&](const auto& z) { return z.stamp > time - 0.5 * options_.window; }));
  return std::nullopt;
}

std::optional<Initialization> MotionInitializer::initialize(const Velocities& window, Time time,
                                                            const ImuBuffer& imu,
                                                            const std::function<PoseAnchor(Time)>& anchorAt) {
  const Line line = fitLine(window, time, imu);
  if (std::abs(line.g_I.norm() - g_W_.norm()) >= options_.max_gravity_error) {
    waiting_for_ = {
        StartObstacle::kContradiction,
        formatted(
            "radar and IMU that agree: together they show %.2f m/s^2 as gravity instead of %.2f: units, "
            "extrinsics, Doppler sign?",
            line.g_I.norm(), g_W_.norm())};
    return std::nullopt;
  }
  const NodePrior known = priorOf(line, anchorAt(time));
  Initialization result;
  result.time = time;
  result.from = InitializedFrom::kMotion;
  for (int round = 0; round < kScaleRounds; ++round) {
    result.prior = known;
    const std::optional<double> outliers = refine(window, time, imu, result.model_error_scale, result.prior);
    if (!outliers) {
      waiting_for_ = {StartObstacle::kTooFewData,
                      "motion: the radar velocities do not determine tilt and velocity"};
      return std::nullopt;
    }
    if (*outliers > options_.max_outlier_fraction) {
      waiting_for_ = {
          StartObstacle::kContradiction,
          formatted("radar and IMU that agree: %.0f %% of the radar velocities do not fit the IMU, at most "
                    "%.0f %% allowed: extrinsics, Doppler sign, units?",
                    100.0 * *outliers, 100.0 * options_.max_outlier_fraction)};
      return std::nullopt;
    }
  }
  waiting_for_ = {};
  return result;
}

NodePrior MotionInitializer::priorOf(const Line& line, const PoseAnchor& anchor) const {
  NodePrior prior;
  StateBlock& x = prior.x0;
  x.q_WI() = withGravity(anchor.q_WI, line.g_I);
  x.p_W() = anchor.p_W;
  x.v_W() = x.q_WI() * line.v_I;
  prior.t_O0 = radar_.time_offset_initial;
  prior.T_IR0 = radar_.T_IR;
  const Eigen::VectorXd calibration = calibrationSigmas(smoother_, radar_);
  const Eigen::Index size = StateBlock::kTangent + calibration.size();
  Eigen::MatrixXd& J = prior.root.J;
  J = Eigen::MatrixXd::Zero(size, size);
  prior.root.r0 = Eigen::VectorXd::Zero(size);
  Eigen::Matrix4d covariance = anchor.covariance;
  covariance(0, 0) += smoother_.prior_sigma_yaw * smoother_.prior_sigma_yaw;
  covariance.diagonal().tail<3>().array() += smoother_.prior_sigma_position * smoother_.prior_sigma_position;
  J.topLeftCorner<4, StateBlock::kTangent>() = covariance.llt().matrixL().solve(poseInW(x.q_WI()));
  J.diagonal().segment<3>(StateBlock::kBg).setConstant(1.0 / options_.sigma_gyro_bias);
  J.diagonal().segment<3>(StateBlock::kBa).setConstant(1.0 / options_.sigma_accel_bias);
  J.diagonal().tail(calibration.size()) = calibration.cwiseInverse();
  return prior;
}

std::string toString(InitializedFrom from) { return from == InitializedFrom::kRest ? "rest" : "motion"; }

MotionInitializer::Velocities MotionInitializer::windowUntil(Time time, const ImuBuffer& imu) const {
  const double reach = smoother_.max_time_offset;
  Time covered = imu.oldest();  // without a gap from here on
  bool in_gap = false;
  imu.forEachSample(imu.oldest(), imu.newest(), [&](const ImuMeasurement& sample) {
    if (in_gap || sample.is_bridge) covered = sample.time;
    in_gap = sample.is_bridge;
  });
  const Time first = std::max(time - options_.window, covered + reach);
  Velocities result;
  for (const Velocity& z : velocities_) {
    if (first <= z.stamp && z.stamp <= time) result.push_back(z);
  }
  return result;
}

MotionInitializer::Line MotionInitializer::fitLine(const Velocities& velocities, Time time,
                                                   const ImuBuffer& imu) const {
  // Means over the scans of T, T^2, y and T y, with y = dR v_k - dv.
  double mean_T = 0.0;
  double mean_TT = 0.0;
  Eigen::Vector3d mean_y = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_Ty = Eigen::Vector3d::Zero();
  for (const Velocity& z : velocities) {
    const Time tau = z.stamp - radar_.time_offset_initial;
    const ImuDelta delta = integrate(imu, time, tau, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
    const Eigen::Vector3d v_I =
        radar_.T_IR.q_IR * z.v_R - imu.at(tau).angular_velocity.cross(radar_.T_IR.l_I);
    const Eigen::Vector3d y = delta.dR * v_I - delta.dv;
    mean_T += delta.dt;
    mean_TT += delta.dt * delta.dt;
    mean_y += y;
    mean_Ty += delta.dt * y;
  }
  const double n = static_cast<double>(velocities.size());
  mean_T /= n;
  mean_TT /= n;
  mean_y /= n;
  mean_Ty /= n;
  Line line;
  line.g_I = (mean_Ty - mean_T * mean_y) / (mean_TT - mean_T * mean_T);
  line.v_I = mean_y - mean_T * line.g_I;
  return line;
}

std::optional<double> MotionInitializer::refine(const Velocities& velocities, Time time, const ImuBuffer& imu,
                                                ModelErrorScale& scale, NodePrior& prior) const {
  Window window;
  Block& motion = window.addNode(time, std::make_shared<MotionManifold>(), storedMotion(prior.x0));
  const std::shared_ptr<Block> biases =
      window.addCalibration(std::make_shared<VectorManifold>(StateBlock::kBiases), storedBiases(prior.x0));
  const std::shared_ptr<Block> offset =
      window.addCalibration(std::make_shared<VectorManifold>(1), Eigen::VectorXd::Constant(1, prior.t_O0));
  offset->bound = smoother_.max_time_offset;
  const EstimateExtrinsics estimate = smoother_.estimate_extrinsics;
  const std::shared_ptr<Block> extrinsics =
      window.addCalibration(std::make_shared<ExtrinsicsManifold>(estimate), stored(prior.T_IR0));
  std::vector<Block*> blocks = {&motion, biases.get(), offset.get()};
  if (estimate == EstimateExtrinsics::kNone) {
    window.setConstant(*extrinsics, true);
  } else {
    blocks.push_back(extrinsics.get());
  }
  addPrior(window, blocks, prior.root);
  const std::shared_ptr<ceres::LossFunction> loss = huberLoss(smoother_.huber_threshold);
  const RadarMotionModel model{TimeOffsetModel::kImu, smoother_.max_time_offset, g_W_, &imu};

  std::vector<CarriedCovariance> covariances;
  for (const Velocity& z : velocities) covariances.push_back(carriedCovariance(z, time, imu, scale.value()));
  // The state determines which scans inform the offset, and these scans determine the state.
  std::vector<const Term*> terms;
  OffsetGains offset_gains;
  double linear_from = offset->x[0];  // [s]
  for (int round = 0; round < kMaxRounds; ++round) {
    const OffsetGains last = std::exchange(
        offset_gains, offsetGains(velocities, time, imu, stateOf(motion, *biases), offset->x[0]));
    const std::vector<double>& gains = offset_gains.gains;
    const bool holds = std::abs(offset->x[0] - linear_from) < kOffsetHolds;
    if (round > 0 && holds && areNear(gains, last.gains)) break;
    linear_from = offset->x[0];
    for (const Term* term : terms) window.remove(*term);
    terms.clear();
    for (std::size_t i = 0; i < velocities.size(); ++i) {
      RadarVelocityMeasurement z = velocities[i];
      z.covariance = covariances[i].whole;
      z.offset_gain = gains[i];
      z.offset_half_width = offset_gains.half_width;
      z.linear_from_t_O = std::make_shared<const double>(linear_from);
      terms.push_back(&window.add(std::make_unique<RadarVelocityFactor>(z, time, model),
                                  {&motion, biases.get(), offset.get(), extrinsics.get()}, loss));
    }
    try {
      rio_t::solve(window, {kMaxIterations, kConverged * kConverged}, smoother_.solver);
    } catch (const std::runtime_error&) {
      return std::nullopt;
    }
  }

  const double n = static_cast<double>(velocities.size());
  double outliers = 0.0;
  double mean_square = 0.0;
  double mean_share = 0.0;
  for (std::size_t i = 0; i < velocities.size(); ++i) {
    const double* values[] = {motion.x.data(), biases->x.data(), offset->x.data(), extrinsics->x.data()};
    Eigen::Vector3d e;
    terms[i]->cost->Evaluate(values, e.data(), nullptr);
    const double square = std::min(e.squaredNorm(), kOutlier * kOutlier);
    if (e.norm() > kOutlier) outliers += 1.0 / n;
    mean_square += square / n;
    mean_share += covariances[i].whole.ldlt().solve(covariances[i].scaled).trace() / (3.0 * n);
  }
  const SquareRoot root = eliminateFirst(linearize(window), 0);
  prior = {stateOf(motion, *biases), offset->x[0], toExtrinsics(extrinsics->x.data()), root};
  // The solution fits the velocities, so their residuals scatter less than their errors.
  const double left = 3.0 * n / (3.0 * n - kUnknowns);
  for (std::size_t i = 0; i < velocities.size(); ++i) scale.add(time, left * mean_square, mean_share);
  return outliers;
}

MotionInitializer::OffsetGains MotionInitializer::offsetGains(const Velocities& velocities, Time time,
                                                              const ImuBuffer& imu, const StateBlock& x,
                                                              double t_O) const {
  OffsetGains result;
  result.gains.resize(velocities.size(), 0.0);
  if (!smoother_.estimate_time_offset) return result;
  OffsetWidths widths(imu, g_W_);
  std::vector<OffsetScan> scans;
  for (const Velocity& z : velocities) {
    OffsetScan scan;
    scan.tau = z.stamp - t_O;
    scan.x = carried(x, time, scan.tau, imu, g_W_);
    scan.T_IR = radar_.T_IR;
    scan.measured = z.covariance;
    widths.add(scan);
    scans.push_back(scan);
  }
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const OffsetDerivative derivative = widths.derivative(scans[i]);
    result.half_width = derivative.half_width;
    if (derivative.mean.norm() > smoother_.time_offset_min_acceleration) result.gains[i] = widths.gain();
  }
  return result;
}

/// Covariance that the IMU adds between the state and a scan: noise of the accelerometer, and of the tilt.
MotionInitializer::CarriedCovariance MotionInitializer::carriedCovariance(const Velocity& z, Time time,
                                                                          const ImuBuffer& imu,
                                                                          double scale) const {
  const double T = std::abs(z.stamp - time);
  const double tilt = noise_.gyro_density * g_W_.norm();
  const ImuNoise noise = noise_.scaled(scale);
  const double configured = noise.accel_density * noise.accel_density;
  double accel = 0.0, accel_scaled = 0.0;  // [m^2/s^2]
  imu.forEachInterval(std::min(z.stamp, time), std::max(z.stamp, time),
                      [&](double dt, const auto&, const auto&, const ImuMeasurement& later) {
                        accel += dt * noise.accelVariance(later);
                        if (configured > later.accel_mean_noise) accel_scaled += dt * configured;
                      });
  const Eigen::Vector3d added = scale * z.added_variance;
  CarriedCovariance covariance{z.covariance, (added.array() + accel_scaled).matrix().asDiagonal()};
  covariance.whole.diagonal() += added - z.added_variance;
  covariance.whole.diagonal().array() += accel + tilt * tilt * T * T * T / 3.0;
  return covariance;
}

}  // namespace rio_t
