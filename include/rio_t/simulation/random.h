#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace rio_t::simulation {

/// Random numbers that are the same with every standard library (the distributions of <random> are not).
/// xoshiro256** by Blackman and Vigna, "Scrambled Linear Pseudorandom Number Generators", ACM TOMS 2021,
/// seeded by SplitMix64.
class Random {
 public:
  /// `stream` and `index` pick independent sequences under one seed. So the draws of one part of the
  /// simulation do not shift those of another.
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0, std::uint64_t index = 0);

  std::uint64_t bits();
  /// In [0, 1).
  double uniform();
  /// In [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Standard normal.
  double gaussian();
  Eigen::Vector3d gaussianVector();
  bool chance(double probability) { return uniform() < probability; }

 private:
  std::uint64_t state_[4] = {};
};

}  // namespace rio_t::simulation
