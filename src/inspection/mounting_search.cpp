#include "rio_t/inspection/mounting_search.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "rio_t/core/so3.h"

namespace rio_t {
namespace {

// Dynamic sizes: they compile in a tenth of the time.
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kPi = 3.14159265358979323846;
constexpr double kWindow = 3.0;            // [s]
constexpr std::size_t kMinVelocities = 6;  // of a window: two lines take four
constexpr double kMinMotion = 0.25;        // [m/s] that a window must exceed to count as motion
constexpr double kMinDuration = 3.0;       // [s] of motion, below which nothing is said
constexpr double kGravitySigma = 0.5;      // [m/s^2] of the mean specific force: 3 degrees
constexpr double kRestGravitySigma = 0.1;  // [m/s^2] of the gravity from a rest: bias of the accelerometer
constexpr double kGyroDrift = 3.0e-4;      // [rad/s] with which the gyro loses it: what is left of its bias
constexpr double kOffsetStep = 0.01;       // [s]
constexpr double kLevelSigma = 0.17;       // [rad] of the roll, if nothing else is known
constexpr double kAheadSigma = 0.5;        // [rad] of the pitch, likewise
constexpr double kUprightWeight = 9.0;     // [sigma^2] half of what upside down costs
constexpr double kOutlier = 3.0;           // [sigma] from which on a velocity counts less
constexpr double kClear = 25.0;            // [sigma^2] from which on a sign is taken for known
constexpr double kAlike = 2.0;             // errors of a window are alike: they count as half as many
constexpr double kOffsetFactor = 3.0;  // velocities of noisy points draw the bottom of the curve to the side
constexpr int kM = 9, kL = 3, kShared = kM + kL, kAll = kShared + 6;

/// cost(M, l) = x' H x - 2 b' x + c with x = (columns of M, l).
struct Quadratic {
  MatrixXd H = MatrixXd::Zero(kShared, kShared);
  VectorXd b = VectorXd::Zero(kShared);
  double c = 0.0;
};

/// A velocity with its weight in G.
struct Weighted {
  const RadarVelocity* velocity;
  double weight = 1.0;  // of a robust loss
};
using VelocityWindow = std::vector<Weighted>;

/// Rows A x = y of one velocity: x = (M, l, v_w, g_w).
struct Rows {
  MatrixXd A = MatrixXd::Zero(3, kAll);
  Vector3d y;
};

Rows rowsOf(const RadarVelocity& velocity, double offset, Time begin, const InertialTrack& track) {
  const Time time = velocity.stamp - offset;
  const Matrix3d R = track.rotation(time).toRotationMatrix();
  Rows rows;
  for (int j = 0; j < 3; ++j) rows.A.middleCols<3>(3L * j) = velocity.v_R[j] * R;
  rows.A.block<3, 3>(0, kM) = -R * so3::hat(track.rate(time));
  rows.A.block<3, 3>(0, kShared) = -Matrix3d::Identity();
  rows.A.block<3, 3>(0, kShared + 3) = -(time - begin) * Matrix3d::Identity();
  rows.y = track.impulse(time) - track.impulse(begin);
  return rows;
}

/// Covariance of a velocity in G. It is known in R; before M is, its mean stands for all axes.
Matrix3d covariance(const RadarVelocity& velocity, const Matrix3d& R_GI, const Matrix3d* M, double sigma) {
  const Matrix3d model = sigma * sigma * Matrix3d::Identity();
  if (M == nullptr) return model + velocity.covariance.trace() / 3.0 * Matrix3d::Identity();
  const Matrix3d T = R_GI * *M;
  return model + T * velocity.covariance * T.transpose();
}

struct Problem {
  const InertialTrack& track;
  const MountingSearchOptions& options;
  std::vector<VelocityWindow> windows;
};

struct WindowSystem {
  MatrixXd H = MatrixXd::Zero(kAll, kAll);
  VectorXd b = VectorXd::Zero(kAll);
  double c = 0.0;
};

/// All rows of a window, and their covariance: that of each velocity, and the random walk of the IMU's noise
/// since the beginning, which all later ones share.
struct WindowRows {
  MatrixXd A;
  VectorXd y;
  MatrixXd covariance;
};

WindowRows rowsOf(const VelocityWindow& window, double offset, const Matrix3d* M, const Problem& problem) {
  const Eigen::Index count = static_cast<Eigen::Index>(window.size());
  const Time begin = window.front().velocity->stamp - offset;
  const double density = problem.options.accel_density * problem.options.accel_density;
  WindowRows all{MatrixXd(3 * count, kAll), VectorXd(3 * count), MatrixXd::Zero(3 * count, 3 * count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const Weighted& each = window[static_cast<std::size_t>(i)];
    const Rows rows = rowsOf(*each.velocity, offset, begin, problem.track);
    all.A.middleRows(3 * i, 3) = rows.A;
    all.y.segment(3 * i, 3) = rows.y;
    const Matrix3d R_GI = problem.track.rotation(each.velocity->stamp - offset).toRotationMatrix();
    all.covariance.block(3 * i, 3 * i, 3, 3) =
        covariance(*each.velocity, R_GI, M, problem.options.velocity_sigma) / each.weight;
    const double walked = density * (each.velocity->stamp - window.front().velocity->stamp);
    for (Eigen::Index k = i; k < count; ++k) {
      all.covariance.block(3 * i, 3 * k, 3, 3).diagonal().array() += walked;
      if (k != i) all.covariance.block(3 * k, 3 * i, 3, 3).diagonal().array() += walked;
    }
  }
  return all;
}

double gravitySigma(Time time, const MountingSearchOptions& options) {
  if (!options.gravity_G) return kGravitySigma;
  const double tilt = kGyroDrift * std::abs(time - options.rest_end);
  return std::min(kGravitySigma, std::hypot(kRestGravitySigma, options.gravity * tilt));
}

WindowSystem systemOf(const VelocityWindow& window, double offset, const Matrix3d* M,
                      const Problem& problem) {
  WindowRows rows = rowsOf(window, offset, M, problem);
  const Eigen::LLT<MatrixXd> root(rows.covariance);
  root.matrixL().solveInPlace(rows.A);
  root.matrixL().solveInPlace(rows.y);
  WindowSystem system;
  system.H.noalias() = rows.A.transpose() * rows.A;
  system.b.noalias() = rows.A.transpose() * rows.y;
  system.c = rows.y.squaredNorm();
  const Time begin = window.front().velocity->stamp - offset;
  const Vector3d g_G =
      problem.options.gravity_G.value_or(problem.track.gravity(begin, problem.options.gravity));
  const double sigma = gravitySigma(begin, problem.options);
  const double known = 1.0 / (sigma * sigma);
  system.H.bottomRightCorner<3, 3>() += known * Matrix3d::Identity();
  system.b.tail<3>() += known * g_G;
  system.c += known * g_G.squaredNorm();
  return system;
}

/// The windows without their own unknowns, and with the prior on the lever arm.
Quadratic quadraticOf(double offset, const Matrix3d* M, const Problem& problem) {
  Quadratic total;
  for (const VelocityWindow& window : problem.windows) {
    const WindowSystem s = systemOf(window, offset, M, problem);
    const MatrixXd nuisance = s.H.bottomRightCorner(6, 6);
    const MatrixXd cross = s.H.bottomLeftCorner(6, kShared);
    const Eigen::LDLT<MatrixXd> solver(nuisance);
    total.H += s.H.topLeftCorner(kShared, kShared) - cross.transpose() * solver.solve(cross);
    const VectorXd own = solver.solve(s.b.tail(6));
    total.b += s.b.head(kShared) - cross.transpose() * own;
    total.c += s.c - s.b.tail(6).dot(own);
  }
  const double sigma = problem.options.lever_arm_sigma;
  total.H.bottomRightCorner(kL, kL) += Matrix3d::Identity() / (sigma * sigma);
  return total;
}

VectorXd columnsOf(const Matrix3d& M) { return Eigen::Map<const VectorXd>(M.data(), kM); }

/// The quadratic in M alone, and what is known of it beforehand.
struct RotationCost {
  MatrixXd H = MatrixXd::Zero(kM, kM);
  VectorXd b = VectorXd::Zero(kM);
  double c = 0.0;

  double operator()(const Matrix3d& M) const {
    const VectorXd m = columnsOf(M);
    return m.dot(H * m) - 2.0 * b.dot(m) + c;
  }
};

RotationCost withoutLeverArm(const Quadratic& q) {
  const MatrixXd lever = q.H.bottomRightCorner(kL, kL);
  const MatrixXd cross = q.H.bottomLeftCorner(kL, kM);
  const Eigen::LDLT<MatrixXd> solver(lever);
  const VectorXd own = solver.solve(q.b.tail(kL));
  RotationCost cost;
  cost.H = q.H.topLeftCorner(kM, kM) - cross.transpose() * solver.solve(cross);
  cost.b = q.b.head(kM) - cross.transpose() * own;
  cost.c = q.c - q.b.tail(kL).dot(own);
  return cost;
}

/// Without a motion that shows it, a radar stands upright, does not roll and looks ahead: its right axis is
/// level, its forward axis nearly so. In M = sign R a level axis costs the same for both signs.
RotationCost withUpright(RotationCost cost, const Vector3d& up_I, int sign) {
  VectorXd level = VectorXd::Zero(kM), ahead = VectorXd::Zero(kM), upright = VectorXd::Zero(kM);
  level.head<3>() = up_I;
  ahead.segment<3>(3) = up_I;
  upright.tail<3>() = sign * up_I;
  cost.H += level * level.transpose() / (kLevelSigma * kLevelSigma);
  cost.H += ahead * ahead.transpose() / (kAheadSigma * kAheadSigma);
  cost.b += kUprightWeight * upright;
  return cost;
}

/// d vec(M) / d theta for M = sign R Exp(theta).
MatrixXd tangent(const Matrix3d& M) {
  MatrixXd J(kM, 3);
  for (int k = 0; k < 3; ++k) {
    const Matrix3d D = M * so3::hat(Vector3d::Unit(k));
    J.col(k) = columnsOf(D);
  }
  return J;
}

/// The rotation nearby that costs least, by Levenberg-Marquardt.
Matrix3d descend(const RotationCost& cost, int sign, const Matrix3d& start) {
  Eigen::Quaterniond q(start);
  double lambda = 1e-3;
  double now = cost(sign * start);
  for (int i = 0; i < 50; ++i) {
    const Matrix3d M = sign * q.toRotationMatrix();
    const MatrixXd J = tangent(M);
    const Vector3d gradient = J.transpose() * (cost.H * columnsOf(M) - cost.b);
    Matrix3d hessian = J.transpose() * cost.H * J;
    hessian.diagonal().array() += lambda * (hessian.trace() / 3.0 + 1e-9);
    const Vector3d step = -hessian.ldlt().solve(gradient);
    const Eigen::Quaterniond next = (q * so3::exp(step)).normalized();
    const double then = cost(sign * next.toRotationMatrix());
    if (then <= now) {
      q = next;
      lambda = std::max(lambda * 0.2, 1e-9);
      if (now - then < 1e-9 * (1.0 + std::abs(now)) && step.norm() < 1e-7) break;
      now = then;
    } else {
      lambda *= 10.0;
      if (lambda > 1e9) break;
    }
  }
  return q.toRotationMatrix();
}

struct Found {
  int sign = 1;
  Matrix3d R = Matrix3d::Identity();
  double cost = std::numeric_limits<double>::infinity();  // with what is known beforehand
};

Found best(const RotationCost& cost, const std::optional<Vector3d>& up_I, int sign) {
  const RotationCost whole = up_I ? withUpright(cost, *up_I, sign) : cost;
  Found found;
  found.sign = sign;
  for (const Matrix3d& turn : axisTurns()) {
    const Matrix3d R = descend(whole, sign, turn);
    const double value = whole(sign * R);
    if (value < found.cost) found = {sign, R, value};
  }
  return found;
}

/// Windows with motion, of velocities that the IMU covers with any offset.
std::vector<VelocityWindow> windowsOf(const std::vector<RadarVelocity>& velocities,
                                      const InertialTrack& track, double reach) {
  std::vector<VelocityWindow> windows;
  VelocityWindow window;
  const auto finish = [&] {
    const bool moves = std::any_of(window.begin(), window.end(), [](const Weighted& each) {
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

std::size_t countOf(const std::vector<VelocityWindow>& windows) {
  std::size_t count = 0;
  for (const VelocityWindow& window : windows) count += window.size();
  return count;
}

/// Sets the weights of a robust (Cauchy) loss, and returns the mean square of the residuals, in sigma^2.
double reweigh(double offset, const Matrix3d& M, const Vector3d& l, Problem* problem, double* residual) {
  std::vector<double> squares;
  std::vector<double> residuals;
  for (VelocityWindow& window : problem->windows) {
    const WindowSystem s = systemOf(window, offset, &M, *problem);
    VectorXd all(kAll);
    all << columnsOf(M), l, VectorXd::Zero(6);
    const MatrixXd nuisance = s.H.bottomRightCorner(6, 6);
    const VectorXd left = s.b.tail(6) - s.H.bottomLeftCorner(6, kShared) * all.head(kShared);
    all.tail(6) = nuisance.ldlt().solve(left);
    const WindowRows rows = rowsOf(window, offset, &M, *problem);
    const VectorXd errors = rows.A * all - rows.y;
    for (std::size_t i = 0; i < window.size(); ++i) {
      const auto at = static_cast<Eigen::Index>(3 * i);
      const Vector3d e = errors.segment(at, 3);
      const Matrix3d own = rows.covariance.block(at, at, 3, 3);
      const double square = e.dot(own.ldlt().solve(e)) / 3.0;
      squares.push_back(square);
      residuals.push_back(e.squaredNorm() / 3.0);
      window[i].weight = 1.0 / (1.0 + square / (kOutlier * kOutlier));
    }
  }
  const auto median = [](std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  constexpr double kMeanOverMedian = 1.27;  // of a mean of three squares: chi-squared has its median at 2.37
  *residual = std::sqrt(kMeanOverMedian * median(residuals));
  return std::max(1.0, kMeanOverMedian * median(squares));
}

/// Whether another mounting, far off, fits as well: a vehicle that only drives ahead does not show whether
/// its radar is upside down.
void findOtherMounting(const RotationCost& cost, double square, MountingSearch* result) {
  constexpr double kFar = 1.0;  // [rad]
  const Matrix3d R = result->q_IR.toRotationMatrix();
  const double least = cost(result->sign * descend(cost, result->sign, R));
  for (const Matrix3d& turn : axisTurns()) {
    const Matrix3d other = descend(cost, result->sign, turn);
    const Vector3d between = so3::log(Eigen::Quaterniond(other * R.transpose()).normalized());
    if (between.norm() < kFar || (cost(result->sign * other) - least) / square > kClear) continue;
    for (int k = 0; k < 3; ++k) {
      if (std::abs(between[k]) > 0.5 * between.norm()) result->rotation_sigma[k] = kPi;
    }
  }
}

}  // namespace

const std::array<Matrix3d, 24>& axisTurns() {
  static const std::array<Matrix3d, 24> all = [] {
    std::array<Matrix3d, 24> turns;
    std::size_t n = 0;
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        if (a == b) continue;
        for (const double s : {1.0, -1.0}) {
          for (const double t : {1.0, -1.0}) {
            Matrix3d R;
            R.col(0) = s * Vector3d::Unit(a);
            R.col(1) = t * Vector3d::Unit(b);
            R.col(2) = R.col(0).cross(R.col(1));
            turns[n++] = R;
          }
        }
      }
    }
    return turns;
  }();
  return all;
}

MountingSearch searchMounting(const std::vector<RadarVelocity>& velocities, const InertialTrack& track,
                              const MountingSearchOptions& options) {
  MountingSearch result;
  Problem problem{track, options, windowsOf(velocities, track, options.max_offset + 0.05)};
  for (const VelocityWindow& window : problem.windows)
    result.duration += window.back().velocity->stamp - window.front().velocity->stamp;
  result.velocities = countOf(problem.windows);
  if (result.duration < kMinDuration) return result;
  result.enough = true;
  std::vector<double> speeds;
  for (const VelocityWindow& window : problem.windows)
    for (const Weighted& each : window) speeds.push_back(each.velocity->v_R.norm());
  std::sort(speeds.begin(), speeds.end());
  result.speed = speeds[speeds.size() * 9 / 10];

  // Sign and rotation as they fit best: of the offsets, of the two signs.
  const Matrix3d* M = nullptr;
  Matrix3d M_found = Matrix3d::Identity();
  double scale = 1.0;
  std::array<Found, 2> by_sign;  // receding, approaching
  const int steps = static_cast<int>(std::lround(options.max_offset / kOffsetStep));
  constexpr int kRounds = 3, kNear = 5;
  int bottom_before = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::array<double, 2> least = {std::numeric_limits<double>::infinity(),
                                   std::numeric_limits<double>::infinity()};
    std::array<std::vector<double>, 2> curves;
    // The first round looks at all offsets, the later ones around the bottom.
    const int first = round == 0 ? -steps : std::max(-steps, bottom_before - kNear);
    const int last = round == 0 ? steps : std::min(steps, bottom_before + kNear);
    for (int k = first; k <= last; ++k) {
      const RotationCost cost = withoutLeverArm(quadraticOf(k * kOffsetStep, M, problem));
      for (std::size_t s = 0; s < 2; ++s) {
        const int sign = s == 0 ? 1 : -1;
        const Found found = round == 0 ? best(cost, options.up_I, sign) : [&] {
          const RotationCost whole = options.up_I ? withUpright(cost, *options.up_I, sign) : cost;
          const Matrix3d R = descend(whole, sign, by_sign[s].R);
          return Found{sign, R, whole(sign * R)};
        }();
        curves[s].push_back(found.cost);
        if (found.cost < least[s]) {
          least[s] = found.cost;
          by_sign[s] = found;
        }
      }
    }
    const double difference = (least[1] - least[0]) / (kAlike * scale);  // positive: receding fits better
    result.sign_significance = std::abs(difference);
    // Against the ranges the IMU must be twice as sure.
    const int likelier = difference < 0.0 ? -1 : 1;
    const bool contradicts = options.sign_from_ranges != 0 && options.sign_from_ranges != likelier;
    const int by_imu = std::abs(difference) > (contradicts ? 4.0 * kClear : kClear) ? likelier : 0;
    const int class_sign =
        by_imu != 0 ? by_imu : (options.sign_from_ranges != 0 ? options.sign_from_ranges : 1);
    result.sign = class_sign;
    result.mirrored = by_imu != 0 && options.sign_from_ranges != 0 && by_imu != options.sign_from_ranges;
    const std::size_t s = class_sign == 1 ? 0 : 1;

    // The offset at the bottom of the curve, and its sigma from the curvature there.
    const std::vector<double>& curve = curves[s];
    const auto bottom = static_cast<int>(std::min_element(curve.begin(), curve.end()) - curve.begin());
    bottom_before = first + bottom;
    const int inner = std::clamp(bottom, 1, static_cast<int>(curve.size()) - 2);
    const auto at = [&](int i) { return curve[static_cast<std::size_t>(i)]; };
    const double curvature = (at(inner - 1) - 2.0 * at(inner) + at(inner + 1)) / (kOffsetStep * kOffsetStep);
    const double slope = (at(inner + 1) - at(inner - 1)) / (2.0 * kOffsetStep);
    const double step = curvature > 0.0 ? std::clamp(-slope / curvature, -kOffsetStep, kOffsetStep) : 0.0;
    result.offset = (first + inner) * kOffsetStep + step;
    const bool at_the_end = std::abs(bottom_before) == steps;
    result.offset_sigma =
        curvature > 0.0 && !at_the_end ? std::sqrt(2.0 * scale / curvature) : options.max_offset;

    const Quadratic q = quadraticOf(result.offset, M, problem);
    const RotationCost bare = withoutLeverArm(q);
    const RotationCost whole = options.up_I ? withUpright(bare, *options.up_I, class_sign) : bare;
    const Matrix3d R = descend(whole, class_sign, by_sign[s].R);
    by_sign[s].R = R;
    M_found = class_sign * R;
    M = &M_found;
    const Matrix3d H_l = q.H.bottomRightCorner(kL, kL);
    const Vector3d b_l = q.b.tail(kL) - q.H.bottomLeftCorner(kL, kM) * columnsOf(M_found);
    result.lever_arm_I = H_l.inverse() * b_l;
    scale = reweigh(result.offset, M_found, result.lever_arm_I, &problem, &result.residual);
    result.q_IR = Eigen::Quaterniond(R);

    // About the axes of I, from the data alone. Errors of a window are alike: they count as half as many.
    const MatrixXd J = tangent(M_found);
    const Matrix3d in_R = J.transpose() * bare.H * J / (kAlike * scale);
    const Matrix3d in_I = R * in_R * R.transpose();
    const Matrix3d covariance = (in_I + Matrix3d::Identity() / (kPi * kPi)).inverse();
    result.rotation_sigma = covariance.diagonal().cwiseSqrt();
    result.lever_arm_sigma = (std::sqrt(kAlike * scale) * H_l.inverse().diagonal().cwiseSqrt());

    result.offset_sigma = std::max(kOffsetFactor * result.offset_sigma, 0.002);

    if (round + 1 < kRounds) continue;
    findOtherMounting(bare, kAlike * scale, &result);
    for (const int sign : {1, -1}) {
      for (const Matrix3d& turn : axisTurns())
        result.hypotheses.push_back({sign, turn, bare(sign * turn) / (kAlike * scale)});
    }
    const double floor = bare(M_found) / (kAlike * scale);
    for (AxesHypothesis& each : result.hypotheses)
      each.misfit = (each.misfit - floor) / static_cast<double>(result.velocities);
    std::stable_sort(result.hypotheses.begin(), result.hypotheses.end(),
                     [](const AxesHypothesis& a, const AxesHypothesis& b) { return a.misfit < b.misfit; });
  }
  return result;
}

}  // namespace rio_t
