#include "mounting_cost.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/quantile.h"
#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kWindow = 3.0;            // [s]
constexpr std::size_t kMinVelocities = 6;  // of a window: two of them fix its own six unknowns
constexpr double kMinMotion = 0.25;        // [m/s] that a window must exceed to count as motion
constexpr double kGravity = 9.81;          // [m/s^2] anywhere on earth to 0.03
constexpr double kLeverArmSigma = 0.5;     // [m] per axis, around zero
constexpr double kVelocitySigma = 0.08;    // [m/s] errors that no covariance of radar or IMU contains
constexpr double kGravitySigma = 0.5;      // [m/s^2] of gravity by the mean specific force: 3 degrees
constexpr double kRestGravitySigma = 0.1;  // [m/s^2] of gravity by a rest: the bias of the accelerometer
constexpr double kGyroDrift = 3.0e-4;  // [rad/s] what is left of the gyro's bias turns gravity from a rest
constexpr double kOutlier = 3.0;       // [sigma] a velocity that is farther off counts less than half

/// Each window has six unknowns besides the mounting: its first velocity in G, and gravity in G.
constexpr Eigen::Index kMounting = kMountingM + kMountingL, kOwn = 6, kUnknowns = kMounting + kOwn;

/// A velocity gives three rows, A x = y + w + noise, with x = (M, l, v_w, g_w). Each velocity has its own
/// noise; w is the random walk of the IMU's noise since the beginning of the window.
struct Rows {
  MatrixXd Ay = MatrixXd::Zero(3, kUnknowns + 1);  ///< A, and y as the last column
  Matrix3d covariance;                             ///< of the velocity's own noise
  double walked = 0.0;                             ///< variance that w gained since the velocity before
};

/// Returns the covariance of a velocity in G. It is known in R. Without an estimate of M, its mean serves for
/// all axes.
Matrix3d covariance(const RadarVelocity& velocity, const Matrix3d& R_GI, const std::optional<Matrix3d>& M) {
  const Matrix3d model = kVelocitySigma * kVelocitySigma * Matrix3d::Identity();
  if (!M) return model + velocity.covariance.trace() / 3.0 * Matrix3d::Identity();
  const Matrix3d T = R_GI * *M;
  return model + T * velocity.covariance * T.transpose();
}

std::vector<Rows> rowsOf(const VelocityWindow& window, double offset, const std::optional<Matrix3d>& M,
                         const MountingProblem& problem) {
  const double density = problem.options.accel_density * problem.options.accel_density;
  const Time begin = window.front().velocity->stamp - offset;
  const Vector3d impulse = problem.track.impulse(begin);
  std::vector<Rows> all;
  Time last = begin;
  for (const WeightedVelocity& each : window) {
    const RadarVelocity& velocity = *each.velocity;
    const Time time = velocity.stamp - offset;
    const Matrix3d R = problem.track.rotation(time).toRotationMatrix();
    Rows rows;
    for (int j = 0; j < 3; ++j) rows.Ay.middleCols<3>(3L * j) = velocity.v_R[j] * R;
    rows.Ay.block<3, 3>(0, kMountingM) = -R * so3::hat(problem.track.rate(time));
    rows.Ay.block<3, 3>(0, kMounting) = -Matrix3d::Identity();
    rows.Ay.block<3, 3>(0, kMounting + 3) = -(time - begin) * Matrix3d::Identity();
    rows.Ay.col(kUnknowns) = problem.track.impulse(time) - impulse;
    rows.covariance = covariance(velocity, R, M) / each.weight;
    rows.walked = density * std::max(0.0, time - last);  // a few stamps may run back
    last = time;
    all.push_back(std::move(rows));
  }
  return all;
}

double gravitySigma(Time time, const MountingSearchOptions& options) {
  if (!options.gravity_G) return kGravitySigma;
  const double tilt = kGyroDrift * std::abs(time - options.rest_end);
  return std::min(kGravitySigma, std::hypot(kRestGravitySigma, kGravity * tilt));
}

/// Returns the cost of all unknowns of a window. Its velocities share the random walk w. A Kalman filter of w
/// makes their innovations independent. The sum of squares of these equals the cost with the covariance of
/// the whole window, but the time is linear in their number, not cubic.
Quadratic costOf(const VelocityWindow& window, double offset, const std::optional<Matrix3d>& M,
                 const MountingProblem& problem) {
  MatrixXd sum = MatrixXd::Zero(kUnknowns + 1, kUnknowns + 1);
  MatrixXd walk = MatrixXd::Zero(3, kUnknowns + 1);  // expected, as the rows: of A x, and of y
  Matrix3d P = Matrix3d::Zero();                     // its covariance
  for (const Rows& rows : rowsOf(window, offset, M, problem)) {
    P.diagonal().array() += rows.walked;
    const Eigen::LLT<Matrix3d> root(P + rows.covariance);
    MatrixXd innovation = rows.Ay - walk;
    walk += P * root.solve(innovation);
    P = P * root.solve(rows.covariance);
    root.matrixL().solveInPlace(innovation);
    sum.noalias() += innovation.transpose() * innovation;
  }
  Quadratic cost(kUnknowns);
  cost.H = sum.topLeftCorner(kUnknowns, kUnknowns);
  cost.b = sum.topRightCorner(kUnknowns, 1);
  cost.c = sum(kUnknowns, kUnknowns);
  const Time begin = window.front().velocity->stamp - offset;
  const Vector3d g_G = problem.options.gravity_G.value_or(problem.track.gravity(begin, kGravity));
  const double sigma = gravitySigma(begin, problem.options);
  const double known = 1.0 / (sigma * sigma);
  cost.H.bottomRightCorner<3, 3>() += known * Matrix3d::Identity();
  cost.b.tail<3>() += known * g_G;
  cost.c += known * g_G.squaredNorm();
  return cost;
}

}  // namespace

Quadratic withoutLast(const Quadratic& cost, Eigen::Index count) {
  const Eigen::Index kept = cost.b.size() - count;
  const MatrixXd last = cost.H.bottomRightCorner(count, count);
  const MatrixXd cross = cost.H.bottomLeftCorner(count, kept);
  const Eigen::LDLT<MatrixXd> solver(last);
  const VectorXd best = solver.solve(cost.b.tail(count));
  Quadratic left(kept);
  left.H = cost.H.topLeftCorner(kept, kept) - cross.transpose() * solver.solve(cross);
  left.b = cost.b.head(kept) - cross.transpose() * best;
  left.c = cost.c - cost.b.tail(count).dot(best);
  return left;
}

std::vector<VelocityWindow> windowsOf(const std::vector<RadarVelocity>& velocities,
                                      const InertialTrack& track, double reach) {
  std::vector<VelocityWindow> windows;
  VelocityWindow window;
  const auto finish = [&] {
    const bool moves = std::any_of(window.begin(), window.end(), [](const WeightedVelocity& each) {
      return each.velocity->v_R.norm() > kMinMotion;
    });
    const bool long_enough = window.size() >= kMinVelocities &&
                             window.back().velocity->stamp - window.front().velocity->stamp > 0.5 * kWindow;
    if (moves && long_enough &&
        track.isWhole(window.front().velocity->stamp - reach, window.back().velocity->stamp + reach))
      windows.push_back(window);
    window.clear();
  };
  for (const RadarVelocity& velocity : velocities) {
    if (!track.covers(velocity.stamp - reach) || !track.covers(velocity.stamp + reach)) continue;
    if (!window.empty() && std::abs(velocity.stamp - window.front().velocity->stamp) > kWindow) finish();
    window.push_back({&velocity});
  }
  if (!window.empty()) finish();
  return windows;
}

VectorXd columnsOf(const Matrix3d& M) { return Eigen::Map<const VectorXd>(M.data(), kMountingM); }

Quadratic mountingCost(double offset, const std::optional<Matrix3d>& M, const MountingProblem& problem) {
  Quadratic total(kMounting);
  for (const VelocityWindow& window : problem.windows) {
    const Quadratic cost = withoutLast(costOf(window, offset, M, problem), kOwn);
    total.H += cost.H;
    total.b += cost.b;
    total.c += cost.c;
  }
  total.H.bottomRightCorner(kMountingL, kMountingL) +=
      Matrix3d::Identity() / (kLeverArmSigma * kLeverArmSigma);
  return total;
}

double reweigh(double offset, const Matrix3d& M, const Vector3d& l_I, MountingProblem* problem) {
  std::vector<double> squares;
  for (VelocityWindow& window : problem->windows) {
    const Quadratic cost = costOf(window, offset, M, *problem);
    VectorXd x(kUnknowns);
    x << columnsOf(M), l_I, VectorXd::Zero(kOwn);
    const MatrixXd own = cost.H.bottomRightCorner(kOwn, kOwn);
    x.tail(kOwn) =
        own.ldlt().solve(cost.b.tail(kOwn) - cost.H.bottomLeftCorner(kOwn, kMounting) * x.head(kMounting));
    const std::vector<Rows> all = rowsOf(window, offset, M, *problem);
    double walked = 0.0;
    for (std::size_t i = 0; i < window.size(); ++i) {
      const Rows& rows = all[i];
      walked += rows.walked;
      const Vector3d e = rows.Ay.leftCols(kUnknowns) * x - rows.Ay.col(kUnknowns);
      // The covariance without the weight so far.
      const Matrix3d covariance = window[i].weight * rows.covariance + walked * Matrix3d::Identity();
      const double square = e.dot(covariance.ldlt().solve(e)) / 3.0;
      squares.push_back(square);
      window[i].weight = 1.0 / (1.0 + square / (kOutlier * kOutlier));
    }
  }
  constexpr double kMeanOverMedian = 1.27;  // of chi-squared with three degrees of freedom
  return std::max(1.0, kMeanOverMedian * quantile(std::move(squares), 0.5));
}

}  // namespace rio_t
