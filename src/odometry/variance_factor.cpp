#include "rio_t/odometry/variance_factor.h"

#include <algorithm>

namespace rio_t {
namespace {

constexpr double kBelief = 10.0;   // velocities that the options are worth
constexpr double kLargest = 16.0;  // four sigma; farther, it is no noise

}  // namespace

void VarianceFactor::add(double squared_sigmas) {
  squares_ += std::clamp(squared_sigmas, 0.0, kLargest) / 3.0;
  count_ += 1.0;
}

void VarianceFactor::fade(double share) {
  squares_ *= share;
  count_ *= share;
}

double VarianceFactor::value() const { return (kBelief + squares_) / (kBelief + count_); }

}  // namespace rio_t
