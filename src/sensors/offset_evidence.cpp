#include "rio_t/sensors/offset_evidence.h"

#include <algorithm>
#include <cmath>

#include "rio_t/factors/offset_derivative.h"

namespace rio_t {
namespace {

/// [s] How strong motion and vibration are changes with the kind of motion.
constexpr double kMemory = 20.0;

}  // namespace

OffsetDerivative offsetDerivative(const ImuBuffer& imu, Time tau, const StateBlock& x,
                                  const Eigen::Vector3d& g_W, const Extrinsics& T_IR) {
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  const Eigen::Quaterniond q_IW = x.q_WI().conjugate();
  const auto over = [&](Time time, double half_width) {
    return Eigen::Vector3d(-R_RI * velocityRate(imu.mean(time, half_width), x.b_g(), x.b_a(),
                                                q_IW * x.v_W(), q_IW * g_W, T_IR.l_I)
                                       .a_I);
  };
  constexpr double kQuarter = 0.5 * kOffsetHalfWidth;
  OffsetDerivative result;
  result.mean = over(tau, kOffsetHalfWidth);
  result.before = over(tau - kQuarter, kQuarter);
  result.after = over(tau + kQuarter, kQuarter);
  return result;
}

void OffsetEvidence::add(Time stamp, const OffsetDerivative& derivative, const Eigen::Matrix3d& weight) {
  const double fade = std::exp(-std::clamp(stamp - last_, 0.0, 10.0 * kMemory) / kMemory);
  last_ = stamp;
  const double product = derivative.before.dot(weight * derivative.after);
  motion_ = fade * motion_ + product - weight.cwiseProduct(derivative.shared).sum();
  motion_variance_ = fade * fade * motion_variance_ + product * product;
  all_ = fade * all_ + derivative.mean.dot(weight * derivative.mean);
}

double OffsetEvidence::gain() const {
  // One sigma less: noise alone passes it by little and seldom.
  const double sure = motion_ - std::sqrt(motion_variance_);
  return sure > 0.0 && all_ > 0.0 ? std::min(1.0, sure / all_) : 0.0;
}

}  // namespace rio_t
