#include "rio_t/sensors/offset_evidence.h"

#include <algorithm>
#include <cmath>

#include "rio_t/factors/offset_derivative.h"

namespace rio_t {
namespace {

/// [s] The sums forget after this time: another kind of motion has other accelerations and vibrations.
constexpr double kMemory = 20.0;
/// [sigma] Noise of the IMU alone exceeds this once in 70,000 scans (chi-squared, 3 degrees of freedom).
constexpr double kCertain = 5.0;

}  // namespace

bool OffsetDerivative::isCertain() const { return mean.squaredNorm() > kCertain * kCertain * variance; }

OffsetDerivative offsetDerivative(const ImuBuffer& imu, Time tau, const StateBlock& x,
                                  const Eigen::Vector3d& g_W, const Extrinsics& T_IR) {
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  const Eigen::Quaterniond q_IW = x.q_WI().conjugate();
  const auto over = [&](Time time, double half_width) {
    return velocityRate(imu.mean(time, half_width), x.b_g(), x.b_a(), q_IW * x.v_W(), q_IW * g_W, T_IR.l_I);
  };
  const double half_width = offsetHalfWidth(imu, tau);
  // A mean around a time without samples would move to the next sample, and take in some of the other side.
  const auto quarter = [&](double reach) { return 0.5 * std::clamp(reach, 0.0, half_width); };
  const double before = quarter(tau - imu.oldest());
  const double after = quarter(imu.newest() - tau);
  OffsetDerivative result;
  const VelocityRate mean = over(tau, half_width);
  result.mean = -R_RI * mean.a_I;
  result.before = -R_RI * over(tau - before, before).a_I;
  result.after = -R_RI * over(tau + after, after).a_I;
  result.variance = mean.variance;
  return result;
}

void OffsetEvidence::add(Time stamp, const OffsetDerivative& derivative, const Eigen::Matrix3d& weight) {
  const double fade = std::exp(-std::clamp(stamp - last_, 0.0, 10.0 * kMemory) / kMemory);
  last_ = stamp;
  const double all = derivative.mean.dot(weight * derivative.mean);
  const bool is_certain = derivative.isCertain();
  const double product = is_certain ? all - derivative.variance * weight.trace()
                                    : derivative.before.dot(weight * derivative.after);
  motion_ = fade * motion_ + product - weight.cwiseProduct(derivative.shared).sum();
  motion_variance_ = fade * fade * motion_variance_ + (is_certain ? 0.0 : product * product);
  all_ = fade * all_ + all;
}

double OffsetEvidence::gain() const {
  // The motion less one sigma: noise alone is seldom above zero then, and only a little.
  const double sure = motion_ - std::sqrt(motion_variance_);
  return sure > 0.0 && all_ > 0.0 ? std::min(1.0, sure / all_) : 0.0;
}

}  // namespace rio_t
