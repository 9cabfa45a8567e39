#include "rio_t/simulation/trajectory_spline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace rio_t::simulation {
namespace {

constexpr int kSplineDegree = 5;
constexpr int kOrder = kSplineDegree + 1;  // coefficients that act at one time

using Weights = Eigen::Matrix<double, kOrder, 1>;
using Vector7d = Eigen::Matrix<double, 7, 1>;

// Weights of the uniform B-spline of `degree` at u in [0, 1] of a segment; those beyond `degree` are zero.
Weights uniformBasis(int degree, double u) {
  Weights w = Weights::Zero();
  w[0] = 1.0;
  for (int d = 1; d <= degree; ++d) {
    for (int j = d; j >= 0; --j) {
      const double left = j > 0 ? (u + d - j) * w[j - 1] : 0.0;
      const double right = j < d ? (1.0 - u + j) * w[j] : 0.0;
      w[j] = (left + right) / d;
    }
  }
  return w;
}

// Derivative with respect to u of a spline of one degree more: differences of neighbouring weights.
Weights difference(const Weights& w) {
  Weights d;
  for (int j = 0; j < kOrder; ++j) d[j] = (j > 0 ? w[j - 1] : 0.0) - w[j];
  return d;
}

// `order`-th derivative of the weights with respect to u.
Weights basisDerivative(int order, double u) {
  Weights w = uniformBasis(kSplineDegree - order, u);
  for (int i = 0; i < order; ++i) w = difference(w);
  return w;
}

struct Segment {
  int index;
  double u;
};

Segment locate(double t, int segments) {
  const double s = t / TrajectorySpline::kKnotSpacing;
  const int index = std::clamp(static_cast<int>(std::floor(s)), 0, segments - 1);
  return {index, s - index};
}

// Symmetric positive definite matrix of `kSplineDegree` bands below the diagonal, with a Cholesky solver.
class BandMatrix {
 public:
  explicit BandMatrix(int size) : bands_(Eigen::Matrix<double, kOrder, Eigen::Dynamic>::Zero(kOrder, size)) {}

  // Adds a symmetric block whose first row and column is `first`.
  void add(int first, const Eigen::Matrix<double, kOrder, kOrder>& block) {
    for (int c = 0; c < kOrder; ++c) {
      for (int r = c; r < kOrder; ++r) bands_(r - c, first + c) += block(r, c);
    }
  }

  // Solves for the columns of `rhs^T`; destroys the matrix.
  void solve(Eigen::Matrix<double, 7, Eigen::Dynamic>& rhs) {
    const int n = static_cast<int>(bands_.cols());
    for (int c = 0; c < n; ++c) {
      const int below = std::min(kSplineDegree, n - 1 - c);
      bands_(0, c) = std::sqrt(bands_(0, c));
      for (int r = 1; r <= below; ++r) bands_(r, c) /= bands_(0, c);
      for (int k = 1; k <= below; ++k) {
        for (int r = k; r <= below; ++r) bands_(r - k, c + k) -= bands_(r, c) * bands_(k, c);
      }
    }
    for (int c = 0; c < n; ++c) {
      rhs.col(c) /= bands_(0, c);
      for (int r = 1; r <= std::min(kSplineDegree, n - 1 - c); ++r)
        rhs.col(c + r) -= bands_(r, c) * rhs.col(c);
    }
    for (int c = n - 1; c >= 0; --c) {
      for (int r = 1; r <= std::min(kSplineDegree, n - 1 - c); ++r)
        rhs.col(c) -= bands_(r, c) * rhs.col(c + r);
      rhs.col(c) /= bands_(0, c);
    }
  }

 private:
  Eigen::Matrix<double, kOrder, Eigen::Dynamic> bands_;
};

// Integral over one segment of the products of the third derivatives (by time) of the weights. They are
// polynomials of degree 4, for which three Gauss points are exact.
Eigen::Matrix<double, kOrder, kOrder> jerkProducts() {
  Eigen::Matrix<double, kOrder, kOrder> products = Eigen::Matrix<double, kOrder, kOrder>::Zero();
  const double offset = 0.5 * std::sqrt(0.6);
  const std::array<double, 3> nodes = {0.5 - offset, 0.5, 0.5 + offset};
  const std::array<double, 3> node_weights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  for (std::size_t g = 0; g < nodes.size(); ++g) {
    const Weights w = basisDerivative(3, nodes[g]);
    products += node_weights[g] * w * w.transpose();
  }
  return products / std::pow(TrajectorySpline::kKnotSpacing, 5);
}

// Poses as vectors, quaternions with the sign that keeps neighbours close.
std::vector<Vector7d> poseVectors(const Trajectory& poses) {
  std::vector<Vector7d> vectors;
  vectors.reserve(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    Vector7d v;
    v << poses[i].p_W, poses[i].q_WI.normalized().coeffs();
    if (i > 0) {
      const double cos_half = v.tail<4>().dot(vectors.back().tail<4>());
      if (cos_half < 0.0) v.tail<4>() *= -1.0;
      if (std::abs(cos_half) < std::cos(M_PI / 4.0)) {
        throw std::invalid_argument("trajectory: poses " + std::to_string(i) + " and " +
                                    std::to_string(i + 1) +
                                    " are more than 90 degrees apart, too far for a spline");
      }
      if (poses[i].time <= poses[i - 1].time) {
        throw std::invalid_argument("trajectory: stamp of pose " + std::to_string(i + 1) +
                                    " is not after the one before");
      }
    }
    vectors.push_back(v);
  }
  return vectors;
}

}  // namespace

TrajectorySpline::TrajectorySpline(const Trajectory& poses, double cutoff) {
  // The penalty leaves parabolas free, which take three poses to fix; the fourth is one to smooth.
  if (poses.size() < 4) {
    throw std::invalid_argument("trajectory: " + std::to_string(poses.size()) +
                                " poses, a spline needs four or more");
  }
  if (!(cutoff > 0.0)) throw std::invalid_argument("spline: the cut-off frequency must be positive");
  const std::vector<Vector7d> vectors = poseVectors(poses);
  duration_ = poses.back().time - poses.front().time;
  const int segments = std::max(1, static_cast<int>(std::ceil(duration_ / kKnotSpacing)));
  const int size = segments + kSplineDegree;

  BandMatrix normal(size);
  coefficients_.setZero(7, size);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Segment s = locate(poses[i].time - poses.front().time, segments);
    const Weights w = uniformBasis(kSplineDegree, s.u);
    normal.add(s.index, w * w.transpose());
    coefficients_.middleCols<kOrder>(s.index) += vectors[i] * w.transpose();
  }
  const double pose_rate = static_cast<double>(poses.size() - 1) / duration_;
  const double penalty = pose_rate / std::pow(2.0 * M_PI * cutoff, 6);
  const Eigen::Matrix<double, kOrder, kOrder> jerk = penalty * jerkProducts();
  for (int s = 0; s < segments; ++s) normal.add(s, jerk);
  normal.solve(coefficients_);
  if (!coefficients_.allFinite())
    throw std::invalid_argument("trajectory: no finite spline through the poses");

  double position2 = 0.0;
  double rotation2 = 0.0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const MotionState state = at(poses[i].time - poses.front().time);
    position2 += (state.p_W - poses[i].p_W).squaredNorm();
    const double angle = state.q_WI.angularDistance(poses[i].q_WI.normalized());
    rotation2 += angle * angle;
  }
  position_residual_ = std::sqrt(position2 / static_cast<double>(poses.size()));
  rotation_residual_ = std::sqrt(rotation2 / static_cast<double>(poses.size()));
}

MotionState TrajectorySpline::at(double t) const {
  constexpr double kGrace = 1e-6;
  if (!(t >= -kGrace && t <= duration_ + kGrace)) {
    throw std::out_of_range("spline: time " + std::to_string(t) + " s is outside [0, " +
                            std::to_string(duration_) + "]");
  }
  const Segment s = locate(t, static_cast<int>(coefficients_.cols()) - kSplineDegree);
  const auto active = coefficients_.middleCols<kOrder>(s.index);
  const Vector7d x = active * uniformBasis(kSplineDegree, s.u);
  const Vector7d dx = active * basisDerivative(1, s.u) / kKnotSpacing;
  const Vector7d ddx = active * basisDerivative(2, s.u) / (kKnotSpacing * kKnotSpacing);

  MotionState state;
  state.p_W = x.head<3>();
  state.v_W = dx.head<3>();
  state.a_W = ddx.head<3>();
  // With q = Q / |Q|: omega_I = 2 vec(Q* dQ) / |Q|^2, because the part of dQ along Q only changes the length.
  const Eigen::Quaterniond Q(x.tail<4>().eval());
  const Eigen::Quaterniond dQ(dx.tail<4>().eval());
  state.q_WI = Q.normalized();
  state.omega_I = 2.0 * (Q.conjugate() * dQ).vec() / Q.squaredNorm();
  return state;
}

}  // namespace rio_t::simulation
