#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <random>

namespace rio_t {

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

}  // namespace rio_t
