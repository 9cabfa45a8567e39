#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

namespace rio_t {

/// Made-up numbers around zero.
inline double wave(int i) { return std::sin(1.0 + 2.71 * i) + 0.4 * std::cos(0.9 * i * i); }

/// Deterministic noise of unit variance: a sum of twelve uniforms, the same with every standard library.
class Noise {
 public:
  explicit Noise(std::uint32_t seed = 7) : engine_(seed) {}
  double operator()() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>(engine_()) / 4294967296.0;
    return sum;
  }
  Eigen::Vector3d vector() {
    const double x = (*this)(), y = (*this)(), z = (*this)();
    return {x, y, z};
  }

 private:
  std::mt19937 engine_;
};

/// Random numbers that are the same with every standard library.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) + 0.5) / 4294967296.0;
  }
  double normal() {  // Box-Muller
    return std::sqrt(-2.0 * std::log(uniform(0, 1))) * std::cos(2.0 * M_PI * uniform(0, 1));
  }

 private:
  std::mt19937 engine_;
};

}  // namespace rio_t
