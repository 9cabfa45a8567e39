#include "rio_t/sensors/offset_evidence.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [s] The sums fade with this time constant: another kind of motion has other accelerations and vibrations.
constexpr double kMemory = 20.0;
/// [sigma] Noise of the IMU alone exceeds this once in 70,000 scans (chi-squared, 3 degrees of freedom).
constexpr double kCertain = 5.0;

/// Correlation of the white noise in two means whose weights fall linearly over `half_width` to either side.
double correlation(double apart, double half_width) {
  const double x = std::abs(apart) / (2.0 * half_width);
  if (x >= 1.0) return 0.0;
  return x < 0.5 ? 1.0 - 6.0 * x * x * (1.0 - x) : 2.0 * (1.0 - x) * (1.0 - x) * (1.0 - x);
}

}  // namespace

Eigen::Matrix3d OffsetScan::R_WR() const { return (x.q_WI() * T_IR.q_IR).toRotationMatrix(); }

Eigen::Matrix3d OffsetScan::share() const { return predicted * (predicted + measured).inverse(); }

Eigen::Vector3d OffsetScan::follow(const Eigen::Vector3d& J, Eigen::Vector3d& followed) const {
  Eigen::Vector3d unfollowed = J - R_WR().transpose() * followed;
  followed += R_WR() * share() * unfollowed;
  return unfollowed;
}

bool OffsetDerivative::isCertain() const { return mean.squaredNorm() > kCertain * kCertain * variance; }

OffsetDerivative offsetDerivative(const ImuBuffer& imu, Time tau, const StateBlock& x,
                                  const Eigen::Vector3d& g_W, const Extrinsics& T_IR, double half_width) {
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  const Eigen::Quaterniond q_IW = x.q_WI().conjugate();
  const auto rateOf = [&](const ImuMean& mean) {
    return velocityRate(mean, x.b_g(), x.b_a(), q_IW * x.v_W(), q_IW * g_W, T_IR.l_I);
  };
  // The means of each side must not reach beyond the samples: they would then take in some of the other side.
  const auto quarter = [&](double reach) { return 0.5 * std::clamp(reach, 0.0, half_width); };
  const double before = quarter(tau - imu.oldest());
  const double after = quarter(imu.newest() - tau);
  const ImuMean mean = imu.mean(tau, half_width);
  const VelocityRate rate = rateOf(mean);
  OffsetDerivative result;
  result.mean = -R_RI * rate.a_I;
  result.before = -R_RI * rateOf(imu.mean(tau - before, before)).a_I;
  result.after = -R_RI * rateOf(imu.mean(tau + after, after)).a_I;
  result.half_width = half_width;
  result.variance = rate.variance;
  result.omega_I = mean.angular_velocity - x.b_g();
  if (mean.duration > 0.0) result.omega_variance = mean.gyro_variance / mean.duration;
  return result;
}

double OffsetEvidence::varianceOfChange(Time tau, const OffsetDerivative& derivative, double share) {
  const double sigma = std::sqrt(derivative.variance);
  while (!scans_.empty() && tau - scans_.front().tau > 2.0 * derivative.half_width) scans_.pop_front();
  double both = 0.0;  // covariance of the noise in the mean and in what is followed
  for (const Followed& scan : scans_)
    both += scan.weight * scan.sigma * sigma * correlation(tau - scan.tau, derivative.half_width);
  const double of_change = derivative.variance - 2.0 * both + noise_;

  const double kept = 1.0 - share;
  noise_ = kept * kept * noise_ + 2.0 * kept * share * both + share * share * derivative.variance;
  for (Followed& scan : scans_) scan.weight *= kept;
  scans_.push_back({tau, share, sigma});
  return of_change;
}

void OffsetEvidence::add(const OffsetScan& scan, const OffsetDerivative& derivative) {
  const double fade = fading(last_, scan.tau, kMemory);
  last_ = std::max(last_, scan.tau);
  const Eigen::Matrix3d W = (scan.predicted + scan.measured).inverse();
  const Eigen::Vector3d mean = scan.follow(derivative.mean, mean_);
  const Eigen::Vector3d before = scan.follow(derivative.before, before_);
  const Eigen::Vector3d after = scan.follow(derivative.after, after_);
  const double share = scan.share().trace() / 3.0;
  const double variance = varianceOfChange(scan.tau, derivative, share);
  const double unfollowed = 1.0 - constant_;
  constant_ += share * unfollowed;

  const double all = mean.dot(W * mean);
  const bool is_certain = derivative.isCertain();
  const double product = is_certain ? all - variance * W.trace() : before.dot(W * after);
  motion_ = fade * motion_ + product - unfollowed * unfollowed * W.cwiseProduct(scan.shared).sum();
  motion_variance_ = fade * fade * motion_variance_ + (is_certain ? 0.0 : product * product);
  all_ = fade * all_ + all;
}

double OffsetEvidence::gain() const {
  // The motion minus one sigma: noise alone then seldom exceeds zero, and only a little.
  const double sure = motion_ - std::sqrt(motion_variance_);
  return sure > 0.0 && all_ > 0.0 ? std::min(1.0, sure / all_) : 0.0;
}

void OffsetWidths::add(const OffsetScan& scan) {
  for (std::size_t i = 0; i < widths_.size(); ++i) {
    std::deque<OffsetScan>& waiting = widths_[i].waiting;
    const double half_width = kOffsetHalfWidths[i];
    waiting.push_back(scan);
    // The IMU reaches kOffsetHalfWidth past a scan. With later samples, the order of messages would matter.
    const double left = half_width - kOffsetHalfWidth;
    for (; !waiting.empty() && scan.tau - waiting.front().tau >= left; waiting.pop_front()) {
      const OffsetScan& next = waiting.front();
      if (next.tau - imu_->oldest() < half_width) continue;
      widths_[i].evidence.add(next, offsetDerivative(*imu_, next.tau, next.x, g_W_, next.T_IR, half_width));
    }
  }
}

OffsetDerivative OffsetWidths::derivative(const OffsetScan& scan) const {
  return offsetDerivative(*imu_, scan.tau, scan.x, g_W_, scan.T_IR, kOffsetHalfWidths[best()]);
}

std::size_t OffsetWidths::best() const {
  const auto less = [](const Width& a, const Width& b) {
    return a.evidence.information() < b.evidence.information();
  };
  return static_cast<std::size_t>(std::max_element(widths_.begin(), widths_.end(), less) - widths_.begin());
}

}  // namespace rio_t
