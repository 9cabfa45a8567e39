#pragma once

#include <Eigen/Geometry>
#include <array>

namespace rio_t {

/// State of the platform at one time. The solver has it as two blocks: the motion of each node, and the
/// biases of all nodes of a window (docs/method.md, section 6.2).
///
/// Storage (16): q_WI (x y z w), p_W, v_W, b_g, b_a. Tangent (15), see `boxplus`: theta, p, v, b_g, b_a,
/// where theta perturbs on the right to first order: R_WI <- R_WI Exp(theta).
class StateBlock {
 public:
  static constexpr int kMotion = 10, kBiases = 6;  ///< stored numbers of the two blocks
  static constexpr int kSize = kMotion + kBiases;
  static constexpr int kMotionTangent = 9;
  static constexpr int kTangent = kMotionTangent + kBiases;
  enum Tangent { kTheta = 0, kP = 3, kV = 6, kBg = 9, kBa = 12 };  ///< first index in the tangent
  enum Storage { kQStored = 0, kPStored = 4, kVStored = 7, kBgStored = 10, kBaStored = 13 };

  StateBlock() : values_{{0, 0, 0, 1}} {}

  double* data() { return values_.data(); }
  const double* data() const { return values_.data(); }
  const double* biases() const { return data() + kMotion; }

  Eigen::Map<Eigen::Quaterniond> q_WI() { return Eigen::Map<Eigen::Quaterniond>(data() + kQStored); }
  Eigen::Map<Eigen::Vector3d> p_W() { return Eigen::Map<Eigen::Vector3d>(data() + kPStored); }
  Eigen::Map<Eigen::Vector3d> v_W() { return Eigen::Map<Eigen::Vector3d>(data() + kVStored); }
  Eigen::Map<Eigen::Vector3d> b_g() { return Eigen::Map<Eigen::Vector3d>(data() + kBgStored); }
  Eigen::Map<Eigen::Vector3d> b_a() { return Eigen::Map<Eigen::Vector3d>(data() + kBaStored); }
  Eigen::Map<const Eigen::Quaterniond> q_WI() const {
    return Eigen::Map<const Eigen::Quaterniond>(data() + kQStored);
  }
  Eigen::Map<const Eigen::Vector3d> p_W() const {
    return Eigen::Map<const Eigen::Vector3d>(data() + kPStored);
  }
  Eigen::Map<const Eigen::Vector3d> v_W() const {
    return Eigen::Map<const Eigen::Vector3d>(data() + kVStored);
  }
  Eigen::Map<const Eigen::Vector3d> b_g() const {
    return Eigen::Map<const Eigen::Vector3d>(data() + kBgStored);
  }
  Eigen::Map<const Eigen::Vector3d> b_a() const {
    return Eigen::Map<const Eigen::Vector3d>(data() + kBaStored);
  }

 private:
  std::array<double, kSize> values_;
};

/// Read-only view of the motion of a node inside the solver.
struct MotionView {
  explicit MotionView(const double* motion)
      : q_WI(motion + StateBlock::kQStored),
        p_W(motion + StateBlock::kPStored),
        v_W(motion + StateBlock::kVStored) {}
  Eigen::Map<const Eigen::Quaterniond> q_WI;
  Eigen::Map<const Eigen::Vector3d> p_W, v_W;
};
/// The same with the biases.
struct StateView : MotionView {
  StateView(const double* motion, const double* biases)
      : MotionView(motion), b_g(biases), b_a(biases + (StateBlock::kBaStored - StateBlock::kBgStored)) {}
  explicit StateView(const StateBlock& x) : StateView(x.data(), x.biases()) {}
  Eigen::Map<const Eigen::Vector3d> b_g, b_a;
};

using StateTangent = Eigen::Matrix<double, StateBlock::kTangent, 1>;
/// Covariance of a tangent. Its order: theta (right perturbation of R_WI, in I), p_W, v_W, b_g, b_a.
using StateCovariance = Eigen::Matrix<double, StateBlock::kTangent, StateBlock::kTangent>;

/// x_plus_delta = x [+] delta; in storage and tangent order. x_plus_delta may be x.
///
/// theta is split in W into a turn about the vertical, psi z_W, and a tilt about a horizontal axis, beta:
///   R_WI <- Exp(psi z_W) Exp(beta) R_WI
///   v_W  <- Exp(psi z_W) (v_W + dv - psi z_W x v_W)
/// To first order this is R_WI Exp(theta) and v_W + dv. At any state, a turn of the world about the vertical
/// adds psi to the turn and psi z_W x v_W to dv, and changes nothing else (docs/method.md, eq. 5).
void boxplus(const double* x, const double* delta, double* x_plus_delta);
/// y [-] x: the tangent that takes x to y.
StateTangent boxminus(const double* y, const double* x);

/// Jacobian of a residual with respect to the motion of a node, as the solver wants it: N rows, 10 columns.
///
/// The factors write derivatives with respect to the tangent: columns 0-2 hold theta, column 3 stays zero,
/// and the rest stands where it is stored. `MotionManifold` has the matching "plus Jacobian" (a selection),
/// so the solver sees the exact tangent derivative, and no factor needs quaternion derivatives.
template <int N>
using MotionJacobian = Eigen::Matrix<double, N, StateBlock::kMotion, Eigen::RowMajor>;
/// With respect to the biases: b_g, then b_a.
template <int N>
using BiasJacobian = Eigen::Matrix<double, N, StateBlock::kBiases, Eigen::RowMajor>;

/// Writes the derivative by a block row-major, as the solver wants it. A null `stored` asks for nothing.
template <typename Derivative>
void store(const Eigen::MatrixBase<Derivative>& J,
           double* stored) {  // NOLINT(readability-non-const-parameter): the map writes to it
  constexpr int kRows = Derivative::RowsAtCompileTime, kColumns = Derivative::ColsAtCompileTime;
  constexpr int kOrder = kColumns == 1 ? Eigen::ColMajor : Eigen::RowMajor;  // Eigen has no row-major columns
  if (stored != nullptr) Eigen::Map<Eigen::Matrix<double, kRows, kColumns, kOrder>>{stored} = J;
}

}  // namespace rio_t
