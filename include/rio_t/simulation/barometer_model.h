#pragma once

#include <cstdint>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/simulation/motion.h"

namespace rio_t::simulation {

struct BarometerModelOptions {
  bool enabled = false;
  double rate = 50.0;   ///< [Hz]
  double noise = 3.0;   ///< [Pa] sigma of a sample, white: 0.25 m
  double drift = 0.12;  ///< [Pa/sqrt(s)] random walk of the pressure: weather and warmth, 0.01 m/sqrt(s)
  struct Shock {
    double start;     ///< [s] from the start of the bag
    double duration;  ///< [s]
    double change;    ///< [Pa]
  };
  std::vector<Shock> shocks;  ///< doors, rotor wash; each rises and falls within 50 ms

  /// Removes noise and drift. The shocks stay, since the user asked for each of them.
  void removeErrors();
};

struct SimulatedPressure {
  Time stamp;
  double pascal = 0.0;  ///< [Pa]
  double drift = 0.0;   ///< [Pa] part of `pascal`
};

/// Pressures of a barometer carried along `motion`, in the atmosphere of ISO 2533; empty unless enabled.
/// Throws std::invalid_argument for options out of range.
std::vector<SimulatedPressure> simulateBarometer(const Motion& motion, const BarometerModelOptions& options,
                                                 std::uint64_t seed, Time start);

}  // namespace rio_t::simulation
