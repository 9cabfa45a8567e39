#include "rio_t/simulation/motion.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace rio_t::simulation {
namespace {

// Rises from 0 to 1 with three derivatives zero at both ends; its integral and derivative. Times in ramps.
double paceIntegral(double u) { return u * u * u * u * u * (7.0 + u * (-14.0 + u * (10.0 - 2.5 * u))); }
double pace(double u) { return u * u * u * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u))); }
double paceDerivative(double u) { return 140.0 * u * u * u * (1.0 - u) * (1.0 - u) * (1.0 - u); }

// A ramp covers half of the path time that full speed would.
double rampCost(const MotionRestOptions& rest) {
  return 0.5 * rest.ramp * ((rest.static_start > 0.0 ? 1 : 0) + (rest.static_end > 0.0 ? 1 : 0));
}

}  // namespace

double Motion::pathDuration(double duration, const MotionRestOptions& rest) {
  return duration - rest.static_start - rest.static_end - rampCost(rest);
}

Motion::Motion(TrajectorySpline path, const MotionRestOptions& rest)
    : path_(std::move(path)),
      rest_(rest),
      duration_(path_.duration() + rest.static_start + rest.static_end + rampCost(rest)) {
  if (rest.static_start < 0.0 || rest.static_end < 0.0) {
    throw std::invalid_argument("motion: rest at start and end cannot be negative");
  }
  if (!(rest.ramp > 0.0)) throw std::invalid_argument("motion: the ramp must be longer than zero");
  if (path_.duration() < rampCost(rest)) {
    throw std::invalid_argument("motion: the path of " + std::to_string(path_.duration()) +
                                " s is too short for ramps of " + std::to_string(rest.ramp) + " s");
  }
}

Motion::PathTime Motion::pathTime(double t) const {
  const double full = path_.duration();
  if (rest_.static_start > 0.0) {
    const double u = (t - rest_.static_start) / rest_.ramp;
    if (u <= 0.0) return {0.0, 0.0, 0.0};
    if (u < 1.0) return {rest_.ramp * paceIntegral(u), pace(u), paceDerivative(u) / rest_.ramp};
  }
  if (rest_.static_end > 0.0) {
    const double u = (duration_ - rest_.static_end - t) / rest_.ramp;  // time left
    if (u <= 0.0) return {full, 0.0, 0.0};
    if (u < 1.0) return {full - rest_.ramp * paceIntegral(u), pace(u), -paceDerivative(u) / rest_.ramp};
  }
  const double s = rest_.static_start > 0.0 ? t - rest_.static_start - 0.5 * rest_.ramp : t;
  return {std::clamp(s, 0.0, full), 1.0, 0.0};
}

MotionState Motion::at(double t) const {
  constexpr double kGrace = 1e-6;
  if (!(t >= -kGrace && t <= duration_ + kGrace)) {
    throw std::out_of_range("motion: time " + std::to_string(t) + " s is outside [0, " +
                            std::to_string(duration_) + "]");
  }
  const PathTime time = pathTime(t);
  MotionState state = path_.at(time.s);
  // Chain rule, the second derivative first because it needs the spline's first one.
  state.a_W = state.a_W * (time.ds * time.ds) + state.v_W * time.dds;
  state.v_W *= time.ds;
  state.omega_I *= time.ds;
  return state;
}

}  // namespace rio_t::simulation
