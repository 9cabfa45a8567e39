#pragma once

#include <Eigen/Geometry>
#include <array>

namespace rio_t {

/// State of the platform at one time, as one block of parameters for the solver.
///
/// Storage (16): q_WI (x y z w), p_W, v_W, b_g, b_a. Tangent (15), see `boxplus`: theta, p, v, b_g, b_a,
/// where theta perturbs on the right to first order: R_WI <- R_WI Exp(theta). The time offset t_O is a block
/// of its own.
class StateBlock {
 public:
  static constexpr int kSize = 16;
  static constexpr int kTangent = 15;
  enum Tangent { kTheta = 0, kP = 3, kV = 6, kBg = 9, kBa = 12 };  ///< first index in the tangent
  enum Storage { kQStored = 0, kPStored = 4, kVStored = 7, kBgStored = 10, kBaStored = 13 };

  StateBlock() : values_{{0, 0, 0, 1}} {}

  double* data() { return values_.data(); }
  const double* data() const { return values_.data(); }

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

/// Read-only view of a state block inside the solver.
struct StateView {
  explicit StateView(const double* x)
      : q_WI(x + StateBlock::kQStored),
        p_W(x + StateBlock::kPStored),
        v_W(x + StateBlock::kVStored),
        b_g(x + StateBlock::kBgStored),
        b_a(x + StateBlock::kBaStored) {}
  Eigen::Map<const Eigen::Quaterniond> q_WI;
  Eigen::Map<const Eigen::Vector3d> p_W, v_W, b_g, b_a;
};

using StateTangent = Eigen::Matrix<double, StateBlock::kTangent, 1>;
/// Covariance of a tangent. Its order: theta (right perturbation of R_WI, in I), p_W, v_W, b_g, b_a.
using StateCovariance = Eigen::Matrix<double, StateBlock::kTangent, StateBlock::kTangent>;

/// x_plus_delta = x [+] delta; all of them in storage and tangent order. May alias.
///
/// theta is split in W into a turn about the vertical, psi z_W, and a tilt about a horizontal axis, beta:
///   R_WI <- Exp(psi z_W) Exp(beta) R_WI
///   v_W  <- Exp(psi z_W) (v_W + dv - psi z_W x v_W)
/// To first order this is R_WI Exp(theta) and v_W + dv. Whatever the state, a turn of the world about the
/// vertical adds to psi and psi z_W x v_W and changes nothing else (docs/method.md, eq. 5).
void boxplus(const double* x, const double* delta, double* x_plus_delta);
/// y [-] x: the tangent that takes x to y.
StateTangent boxminus(const double* y, const double* x);

/// Jacobian of a residual with respect to a state block, as the solver wants it: N rows, 16 columns.
///
/// The factors write derivatives with respect to the tangent: columns 0-2 hold theta, column 3 stays zero,
/// and the rest stands where it is stored. `StateManifold` has the matching "plus Jacobian" (a selection), so
/// the solver sees the exact tangent derivative, and no factor needs quaternion derivatives.
template <int N>
using StateJacobian = Eigen::Matrix<double, N, StateBlock::kSize, Eigen::RowMajor>;

}  // namespace rio_t
