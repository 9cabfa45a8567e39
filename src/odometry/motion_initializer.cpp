#include "rio_t/odometry/motion_initializer.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>

#include "rio_t/factors/offset_derivative.h"
#include "rio_t/imu/preintegration.h"
#include "rio_t/odometry/options.h"
#include "rio_t/smoother/batch_smoother.h"
#include "rio_t/smoother/chain.h"

namespace rio_t {
namespace {

constexpr double kMinSpan = 0.8;              // of the window, that the velocities must reach over
constexpr std::size_t kMinVelocities = 8;     // 6 unknowns to start with, and witnesses
constexpr std::size_t kMaxVelocities = 1000;  // bounds the memory
constexpr double kMaxLatency = 1.0;           // [s] of a scan, that the IMU is kept for
constexpr int kMaxIterations = 15;
constexpr double kConverged = 1.0e-4;  // [sigma]
constexpr double kOutlier = 4.0;       // [sigma]
constexpr int kScaleRounds = 3;        // of finding the state and the size of the errors around it
constexpr double kUnknowns = 7.0;      // that the velocities determine: velocity, gravity in I, t_O

std::string format(const char* text, double value, double limit) {
  char line[200];
  std::snprintf(line, sizeof line, text, value, limit);
  return line;
}

/// The anchor with its tilt replaced: the shortest turn that makes `g_I` point down.
Eigen::Quaterniond withGravity(const Eigen::Quaterniond& q_WI, const Eigen::Vector3d& g_I) {
  const Eigen::Vector3d up_W = q_WI * -g_I;
  return (Eigen::Quaterniond::FromTwoVectors(up_W, Eigen::Vector3d::UnitZ()) * q_WI).normalized();
}

}  // namespace

MotionInitializer::MotionInitializer(const OdometryOptions& options)
    : options_(options.motion_initialization),
      smoother_(options.smoother),
      noise_(options.imu_noise),
      g_W_(0.0, 0.0, -options.gravity),
      R_RI_(options.T_IR.q_IR.conjugate().toRotationMatrix()),
      l_I_(options.T_IR.l_I) {}

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
  velocities_.insert(
      after, Velocity{{stamp, velocity.v_R, velocity.covariance, R_RI_, l_I_}, velocity.told_variance});
  if (velocities_.size() > kMaxVelocities) velocities_.erase(velocities_.begin());
}

bool MotionInitializer::isMoving(Time from, Time to, double max_speed) const {
  std::vector<double> axes[3];
  for (const Velocity& z : velocities_) {
    if (z.stamp < from || to < z.stamp) continue;
    for (int i = 0; i < 3; ++i) axes[i].push_back(z.v_R[i]);
  }
  if (axes[0].empty()) return false;
  Eigen::Vector3d median;
  for (int i = 0; i < 3; ++i) {
    const auto middle = axes[i].begin() + static_cast<std::ptrdiff_t>(axes[i].size() / 2);
    std::nth_element(axes[i].begin(), middle, axes[i].end());
    median[i] = *middle;
  }
  return median.norm() > max_speed;
}

std::optional<MotionInitialization> MotionInitializer::solve(
    const ImuBuffer& imu, const std::function<PoseAnchor(Time)>& anchorAt) {
  if (velocities_.empty() || imu.empty()) return std::nullopt;
  const auto outOfReach = [&](const Velocity& z) { return std::abs(z.stamp - imu.newest()) > imuHistory(); };
  velocities_.erase(std::remove_if(velocities_.begin(), velocities_.end(), outOfReach), velocities_.end());
  // Any offset within the bound must be covered by the IMU.
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
    if (waiting_for_.rfind("radar and IMU", 0) != 0) {
      waiting_for_ = format("radar velocities in motion: %.1f of %.1f s seen", span, options_.window);
    }
    return std::nullopt;
  }

  const Line line = fitLine(window, time, imu);
  const double gravity_error = line.g_I.norm() + g_W_.z();
  double outliers = 1.0;
  MotionInitialization result;
  result.time = time;
  if (std::abs(gravity_error) < options_.max_gravity_error) {
    const PoseAnchor anchor = anchorAt(time);
    StateBlock& x = result.prior.x0;
    x.q_WI() = withGravity(anchor.q_WI, line.g_I);
    x.p_W() = anchor.p_W;
    x.v_W() = x.q_WI() * line.v_I;
    result.prior.t_O0 = smoother_.time_offset_initial;
    const auto set = [&](int first, double sigma) {
      result.prior.J.diagonal().segment<3>(first).setConstant(1.0 / sigma);
    };
    // Of the attitude only the heading; theta lives in I. Of the velocity nothing.
    result.prior.J.block<1, 3>(StateBlock::kTheta, StateBlock::kTheta) =
        x.q_WI().toRotationMatrix().row(2) / anchor.sigma_yaw;
    set(StateBlock::kP, anchor.sigma_position);
    set(StateBlock::kBg, options_.sigma_gyro_bias);
    set(StateBlock::kBa, options_.sigma_accel_bias);
    result.prior.J(StateBlock::kTangent, StateBlock::kTangent) = 1.0 / smoother_.time_offset_sigma;
    const NodePrior known = result.prior;
    for (int round = 0; round < kScaleRounds && (round == 0 || outliers <= options_.max_outlier_fraction);
         ++round) {
      result.prior = known;
      outliers = refine(window, time, imu, result.model_error_scale, result.prior);
    }
    if (outliers <= options_.max_outlier_fraction) {
      waiting_for_.clear();
      clear();
      return result;
    }
    waiting_for_ = format(
        "radar and IMU that agree: %.0f %% of the radar velocities do not fit the IMU, at most %.0f %% "
        "allowed: extrinsics, Doppler sign, units?",
        100.0 * outliers, 100.0 * options_.max_outlier_fraction);
  } else {
    waiting_for_ = format(
        "radar and IMU that agree: together they show %.2f m/s^2 as gravity instead of %.2f: units, "
        "extrinsics, Doppler sign?",
        line.g_I.norm(), -g_W_.z());
  }
  velocities_.erase(velocities_.begin(),
                    std::find_if(velocities_.begin(), velocities_.end(),
                                 [&](const auto& z) { return z.stamp > time - 0.5 * options_.window; }));
  return std::nullopt;
}

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
    const Time tau = z.stamp - smoother_.time_offset_initial;
    ImuDelta delta;
    imu.forEachInterval(time, tau, [&](double dt, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
      delta.step(dt, gyro, accel);
    });
    const Eigen::Vector3d v_I = R_RI_.transpose() * z.v_R - imu.at(tau).angular_velocity.cross(l_I_);
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

double MotionInitializer::refine(const Velocities& velocities, Time time, const ImuBuffer& imu,
                                 ModelErrorScale& scale, NodePrior& prior) const {
  const PriorFactor known(prior);
  StateBlock x = prior.x0;
  double t_O = prior.t_O0;
  NodeInformation information;
  const double n = static_cast<double>(velocities.size());
  double outliers = 1.0;
  double mean_square = 0.0;
  double mean_share = 0.0;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const double* blocks[] = {x.data(), &t_O};
    ChainSystem system(1);
    system.addStateAndOffset(0, known, x.data(), &t_O, nullptr, false);
    information = {system.diagonal[0], system.gradient[0]};
    outliers = 0.0;
    mean_square = 0.0;
    mean_share = 0.0;
    for (Velocity z : velocities) {
      // What the IMU adds over the way from the state: noise of the accelerometer, and of the tilt.
      const double T = std::abs(z.stamp - time);
      const double tilt = noise_.gyro_density * g_W_.norm();
      const double measured = imu.mean(z.stamp, T).accel_variance;
      const double told = scale.value() * noise_.accel_density * noise_.accel_density;
      Eigen::Vector3d scaled = scale.value() * z.told_variance;
      if (told > measured) scaled.array() += told * T;
      Eigen::Matrix3d covariance = z.covariance;
      covariance.diagonal() += scaled - z.told_variance;
      covariance.diagonal().array() += tilt * tilt * T * T * T / 3.0 + (told > measured ? 0.0 : measured * T);
      const Eigen::LDLT<Eigen::Matrix3d> whitening = covariance.ldlt();
      z.covariance.setIdentity();
      const Time tau = z.stamp - t_O;
      const VelocityRate rate = velocityRate(imu, tau, carried(x, time, tau, imu, g_W_), g_W_, z.l_I);
      if (!smoother_.estimate_time_offset || !rate.informsOffset(smoother_.time_offset_min_acceleration))
        z.held_t_O = t_O;
      Eigen::Vector3d e;
      StateJacobian<3> J_x;
      Eigen::Vector3d J_t;
      double* jacobians[] = {J_x.data(), J_t.data()};
      ImuRadarFactor(z, time, imu, smoother_.max_time_offset, g_W_).Evaluate(blocks, e.data(), jacobians);
      Eigen::Matrix<double, 3, kNodeTangent> J;
      J << J_x.leftCols<3>(), J_x.rightCols<StateBlock::kTangent - 3>(), J_t;
      const Eigen::Matrix<double, 3, kNodeTangent> weighted_J = whitening.solve(J);
      const double distance = std::sqrt(e.dot(whitening.solve(e)));
      if (distance > kOutlier) outliers += 1.0 / n;
      mean_share += whitening.solve(Eigen::Matrix3d(scaled.asDiagonal())).trace() / (3.0 * n);
      mean_square += std::min(distance, kOutlier) * std::min(distance, kOutlier) / n;
      const double huber = smoother_.huber_threshold;
      const double weight = huber > 0.0 && distance > huber ? huber / distance : 1.0;
      information.S += weight * J.transpose() * weighted_J;
      information.s += weight * weighted_J.transpose() * e;
    }
    const NodeVector step = -information.S.ldlt().solve(information.s);
    if (!step.allFinite()) return 1.0;
    if (std::sqrt(step.dot(information.S * step)) < kConverged) break;
    boxplus(x.data(), step.data(), x.data());
    t_O = std::clamp(t_O + step[StateBlock::kTangent], -smoother_.max_time_offset, smoother_.max_time_offset);
  }
  prior = priorFromInformation(information, x, t_O);
  // The solution is drawn towards the velocities: what is left scatters less.
  const double left = 3.0 * n / (3.0 * n - kUnknowns);
  for (std::size_t i = 0; i < velocities.size(); ++i) scale.add(time, left * mean_square, mean_share);
  return outliers;
}

}  // namespace rio_t
