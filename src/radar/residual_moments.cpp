#include "residual_moments.h"

#include <algorithm>
#include <cmath>

#include "direction_noise.h"

namespace rio_t {
namespace {

using Complex = std::complex<double>;

/// [rad^2] Lower limit of the variance of an angle: without noise, its share would be 0 / 0.
constexpr double kLeastVariance = 1e-6;

/// e^(k s / 2) for a variance s and k = q^2 + 2 p q, |q| <= 1 with |p| <= 3 or |q| <= 2 with |p| <= 2.
class Powers {
 public:
  explicit Powers(double variance) {
    for (int k = 0; k <= kMost - kLeast; ++k)
      powers_[static_cast<std::size_t>(k)] = std::exp(0.5 * variance * (k + kLeast));
  }
  double operator[](int k) const { return powers_[static_cast<std::size_t>(k - kLeast)]; }

 private:
  static constexpr int kLeast = -5, kMost = 12;
  std::array<double, kMost - kLeast + 1> powers_{};
};

}  // namespace

ResidualMoments::Harmonics ResidualMoments::product(const Harmonics& a, const Harmonics& b) {
  Harmonics result;
  for (const Harmonic& x : a) {
    for (const Harmonic& y : b) {
      const int azimuth = x.azimuth + y.azimuth, elevation = x.elevation + y.elevation;
      const auto same = [&](const Harmonic& h) { return h.azimuth == azimuth && h.elevation == elevation; };
      const auto found = std::find_if(result.begin(), result.end(), same);
      if (found == result.end())
        result.push_back({azimuth, elevation, x.c * y.c});
      else
        found->c += x.c * y.c;
    }
  }
  return result;
}

ResidualMoments::ResidualMoments(const Eigen::Vector3d& v_R) : v_R_(v_R) {
  sums_.setZero();
  const Complex i(0.0, 1.0);
  const Complex level = 0.25 * Complex(v_R.y(), -v_R.x());
  speed_ = {{1, 1, level},
            {1, -1, level},
            {0, 1, -0.5 * i * v_R.z()},
            {-1, -1, std::conj(level)},
            {-1, 1, std::conj(level)},
            {0, -1, 0.5 * i * v_R.z()}};
  // Across: the derivative by azimuth over cos(elevation).
  const Complex across = 0.5 * Complex(v_R.x(), v_R.y());
  const Harmonics by_azimuth =
      product({{1, 0, across}, {-1, 0, std::conj(across)}}, {{1, 0, across}, {-1, 0, std::conj(across)}});
  Harmonics by_elevation = product(speed_, speed_);
  for (Harmonic& h : by_elevation) h.c = -h.c;
  by_elevation.push_back({0, 0, v_R.squaredNorm()});
  for (const Harmonic& h : by_azimuth) by_elevation.push_back({h.azimuth, h.elevation, -h.c});
  weights_ = {Harmonics{{0, 0, 1.0}}, by_azimuth, product(by_elevation, {{0, 0, 1.0}})};
}

Eigen::Vector3d ResidualMoments::weights(const Eigen::Vector3d& u_R) const {
  const Angles a(u_R);
  const double across = a.cos_az * v_R_.x() - a.sin_az * v_R_.y();
  return {1.0, square(across), square(a.byElevation().dot(v_R_))};
}

void ResidualMoments::add(const Eigen::Vector3d& u_R, double share) {
  const Angles a(u_R);
  const Complex azimuth(a.cos_az, a.sin_az), elevation(a.cos_el, a.sin_el);
  Eigen::Array<Complex, 1, 2 * kOrder + 1> powers;  // share e^(i (p a + q e)), over q
  powers[kOrder] = share;
  for (int q = 1; q <= kOrder; ++q) {
    powers[kOrder + q] = powers[kOrder + q - 1] * elevation;
    powers[kOrder - q] = std::conj(powers[kOrder + q]);
  }
  for (int p = 0; p <= kOrder; ++p) {
    sums_.row(p) += powers;
    powers *= azimuth;
  }
}

Complex ResidualMoments::sumOf(int azimuth, int elevation) const {
  return azimuth < 0 ? std::conj(sums_(-azimuth, kOrder - elevation)) : sums_(azimuth, kOrder + elevation);
}

// r = f(m) - f(t) + the Doppler's noise, where f is the radial speed, m the measured direction and t the true
// one. For an angle with the variance s, and whatever t is, the means over the noise of e^(i (p m + q t)) and
// of e^(i (p + q) m + (q^2 + 2 p q) s / 2) are the same.
Eigen::Matrix3d ResidualMoments::shares(const PointVariances& noise) const {
  const double azimuth = std::max(noise.azimuth, kLeastVariance);
  const double elevation = std::max(noise.elevation, kLeastVariance);
  const Powers by_azimuth(azimuth), by_elevation(elevation);
  Eigen::Matrix3d result = Eigen::Matrix3d::Zero();
  for (int i = 0; i < 3; ++i) {
    for (const Harmonic& g : weights_[static_cast<std::size_t>(i)]) {
      result(i, 0) += (g.c * sumOf(g.azimuth, g.elevation)).real();
      for (std::size_t half = 0; half < speed_.size() / 2; ++half) {  // the others give the conjugate
        const Harmonic& k = speed_[half];
        const int p = g.azimuth + k.azimuth, q = g.elevation + k.elevation;
        for (const Harmonic& l : speed_) {
          const double sum = 2.0 * (g.c * k.c * l.c * sumOf(p + l.azimuth, q + l.elevation)).real();
          const auto part = [](const Powers& powers, int at_m, int at_t) {
            return powers[at_t * at_t + 2 * at_m * at_t];
          };
          const double one_az = part(by_azimuth, p, l.azimuth);
          const double one_el = part(by_elevation, q, l.elevation);
          const double both_az = part(by_azimuth, g.azimuth, k.azimuth + l.azimuth);
          const double both_el = part(by_elevation, g.elevation, k.elevation + l.elevation);
          // G (f(m)^2 - 2 f(m) f(t) + f(t)^2): first what azimuth alone adds, then what elevation adds to it.
          const double of_azimuth = 1.0 - 2.0 * one_az + both_az;
          result(i, 1) += sum * of_azimuth / azimuth;
          result(i, 2) += sum * (1.0 - 2.0 * one_az * one_el + both_az * both_el - of_azimuth) / elevation;
        }
      }
    }
  }
  return result;
}

}  // namespace rio_t
