#include "rio_t/simulation/barometer_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "rio_t/simulation/random.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t::simulation {
namespace {

constexpr std::uint64_t kBarometerStream = 40;
constexpr double kEdge = 0.05;  // [s] in which a shock rises and falls

// ISO 2533, solved for the pressure. The height zero of W is at sea level.
double pressureAt(double height) {
  constexpr double kLapseRate = 6.5e-3, kGasConstant = 287.05287, kGravity = 9.80665;
  constexpr double kPressure = 101325.0, kTemperature = 15.0 + 273.15;  // [Pa, K]
  return kPressure *
         std::pow(1.0 - kLapseRate * height / kTemperature, kGravity / (kGasConstant * kLapseRate));
}

double shockAt(double t, const std::vector<BarometerModelOptions::Shock>& shocks) {
  double change = 0.0;
  for (const BarometerModelOptions::Shock& shock : shocks) {
    const double rise = std::clamp((t - shock.start) / kEdge, 0.0, 1.0);
    const double fall = std::clamp((t - shock.start - shock.duration) / kEdge, 0.0, 1.0);
    change += (rise - fall) * shock.change;
  }
  return change;
}

void check(const BarometerModelOptions& options) {
  if (!(options.rate > 0.0)) throw std::invalid_argument("barometer: rate must be positive");
  if (options.noise < 0.0 || options.drift < 0.0)
    throw std::invalid_argument("barometer: noise and drift cannot be negative");
}

}  // namespace

void BarometerModelOptions::removeErrors() { noise = drift = 0.0; }

std::vector<SimulatedPressure> simulateBarometer(const Motion& motion, const BarometerModelOptions& options,
                                                 std::uint64_t seed, Time start) {
  std::vector<SimulatedPressure> pressures;
  if (!options.enabled) return pressures;
  check(options);
  checkSampleCount("barometer-rate", options.rate, motion.duration());
  Random random(seed, kBarometerStream);
  const double step = 1.0 / options.rate;
  double drift = 0.0;
  // Out of phase with the IMU.
  for (double t = 0.3 * step; t < motion.duration(); t += step) {
    drift += options.drift * std::sqrt(step) * random.gaussian();
    SimulatedPressure pressure;
    pressure.stamp = start + t;
    pressure.drift = drift;
    pressure.pascal = pressureAt(motion.at(t).p_W.z()) + drift + shockAt(t, options.shocks) +
                      options.noise * random.gaussian();
    pressures.push_back(pressure);
  }
  return pressures;
}

}  // namespace rio_t::simulation
