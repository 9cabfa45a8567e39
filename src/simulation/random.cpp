#include "rio_t/simulation/random.h"

#include <cmath>

namespace rio_t::simulation {
namespace {

std::uint64_t splitMix(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

constexpr std::uint64_t rotateLeft(std::uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

}  // namespace

Random::Random(std::uint64_t seed, std::uint64_t stream, std::uint64_t index) {
  // Each number is mixed before the next one is added: plain sums would make (seed 1, stream 2) equal (2, 1).
  std::uint64_t state = seed;
  state = splitMix(state) + stream;
  state = splitMix(state) + index;
  for (std::uint64_t& word : state_) word = splitMix(state);
}

std::uint64_t Random::bits() {
  const std::uint64_t result = rotateLeft(state_[1] * 5, 7) * 9;
  const std::uint64_t shifted = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= shifted;
  state_[3] = rotateLeft(state_[3], 45);
  return result;
}

double Random::uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

double Random::gaussian() {
  // Box and Muller. The second number of the pair is left unused: no hidden state, simpler to reason about.
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  return radius * std::cos(2.0 * M_PI * uniform());
}

Eigen::Vector3d Random::gaussianVector() {
  const double x = gaussian();
  const double y = gaussian();
  const double z = gaussian();
  return {x, y, z};
}

}  // namespace rio_t::simulation
