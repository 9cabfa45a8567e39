#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "rio_t/core/so3.h"
#include "rio_t/factors/state_block.h"
#include "rio_t/imu/buffer.h"

namespace rio_t {

/// A smooth motion with closed-form derivatives, for tests: position is a sum of sines, orientation a spin
/// about a fixed axis with a varying angle after a constant tilt. Biases are constant.
struct SyntheticMotion {
  Eigen::Vector3d g_W{0.0, 0.0, -9.81};
  Eigen::Vector3d b_g{0.004, -0.003, 0.002};
  Eigen::Vector3d b_a{0.05, 0.02, -0.04};
  Eigen::Vector3d amplitude{0.6, 0.4, 0.2};
  Eigen::Vector3d rate{1.9, 2.7, 3.4};  ///< [rad/s]
  Eigen::Vector3d axis = Eigen::Vector3d(0.4, -0.2, 0.9).normalized();
  Eigen::Quaterniond tilt = so3::exp({0.2, -0.1, 0.7});
  Time start = Time::fromNanoseconds(1700000000000000000);

  Time time(double t) const { return start + t; }
  double angle(double t) const { return 0.9 * std::sin(1.6 * t); }
  double angleRate(double t) const { return 0.9 * 1.6 * std::cos(1.6 * t); }
  Eigen::Quaterniond q_WI(double t) const { return tilt * so3::exp(angle(t) * axis); }
  Eigen::Vector3d omega_I(double t) const { return angleRate(t) * axis; }
  Eigen::Vector3d p_W(double t) const { return amplitude.cwiseProduct((rate * t).array().sin().matrix()); }
  Eigen::Vector3d v_W(double t) const {
    return amplitude.cwiseProduct(rate).cwiseProduct((rate * t).array().cos().matrix());
  }
  Eigen::Vector3d a_W(double t) const { return -rate.cwiseAbs2().cwiseProduct(p_W(t)); }

  StateBlock state(double t) const {
    StateBlock x;
    x.q_WI() = q_WI(t);
    x.p_W() = p_W(t);
    x.v_W() = v_W(t);
    x.b_g() = b_g;
    x.b_a() = b_a;
    return x;
  }

  ImuMeasurement imuSample(double t) const {
    return {time(t), omega_I(t) + b_g, q_WI(t).conjugate() * (a_W(t) - g_W) + b_a};
  }

  /// Samples at `rate_hz` from `from` to `to` [s].
  ImuBuffer imu(double from, double to, double rate_hz) const {
    ImuBuffer buffer;
    const int count = static_cast<int>(std::lround((to - from) * rate_hz));
    for (int i = 0; i <= count; ++i) buffer.add(imuSample(from + i / rate_hz));
    return buffer;
  }

  Eigen::Vector3d radarVelocity(double t, const Eigen::Matrix3d& R_RI, const Eigen::Vector3d& l_I) const {
    return R_RI * (q_WI(t).conjugate() * v_W(t) + omega_I(t).cross(l_I));
  }
};

}  // namespace rio_t
