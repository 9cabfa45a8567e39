#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/imu/noise_meter.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {

struct BarometerOptions {
  /// [m/sqrt(Hz)] white noise of the height; more counts if the samples show more
  double noise_density = 0.05;
  double drift = 0.005;       ///< [m/sqrt(s)] random walk of the bias: weather, and warmth of the sensor
  double gate = 4.0;          ///< [sigma] a mean farther from the estimate is rejected; 0: no gate
  double gate_timeout = 1.0;  ///< [s] of rejected means: the pressure moves; of means without slope: it rests
  double gate_slope = 0.07;   ///< [m/s] between barometer and radar; up to this it may be the radar's error
  double temperature = 15.0;  ///< [deg C] of the air at the start
};

/// A pressure as a barometer gives it.
struct Pressure {
  Time time;            ///< of the measurement, clock of the IMU
  double pascal = 0.0;  ///< [Pa]
};

/// Height [m] of the pressure `pascal` above the place where it is `reference_pascal` and the air has
/// `temperature` [deg C]: the barometric formula of the International Standard Atmosphere (ISO 2533), 6.5 K
/// colder each kilometre up.
double heightOfPressure(double pascal, double reference_pascal, double temperature);

/// Empty, or what is wrong with a pressure, for people: not finite, zero, in hPa, or that of no place.
std::string faultOf(double pascal);

/// The channel's answer to a mean of pressures.
struct BarometerAnswer {
  Time time;                      ///< mean of the samples
  int samples = 0;                ///< in the mean
  double height = 0.0;            ///< [m] above the start, by the bias before this mean
  double noise_sigma = 0.0;       ///< [m] of the mean
  double innovation = 0.0;        ///< [m] measured minus predicted
  double innovation_sigma = 0.0;  ///< [m]
  double bias = 0.0;              ///< [m]
  double bias_sigma = 0.0;        ///< [m]
  bool stepped = false;           ///< the bias is estimated again from here on
  std::string rejected_because;   ///< snake case, empty if it was used
};

/// A barometer, from pressures to the window (docs/method.md, section 5.10). Not thread-safe.
///
/// Means over a tenth of a second join the nearest node, as heights with a bias that walks. A mean that
/// contradicts the estimate is rejected: doors and rotors shock the pressure. If the means contradict it for
/// `gate_timeout`, or slope against the motion, the pressure moves. Then no mean is used until the pressure
/// rests. If it rests at another value, the bias is estimated again, so that the height does not jump.
class BarometerChannel {
 public:
  explicit BarometerChannel(const BarometerOptions& options) : options_(options) {}

  /// Why a pressure cannot be used, as a fault in snake case; null if it was taken. `newest_imu` is the time
  /// of the newest sample of the IMU.
  const char* add(const Pressure& pressure, Time newest_imu);
  /// Joins a window that begins at `time`. At rest, the last second of pressures gives the bias.
  void join(FixedLagSmoother& smoother, Time time, bool at_rest);
  /// Adds a term for each mean that is near a solved node.
  std::vector<BarometerAnswer> use(FixedLagSmoother& smoother);
  /// The walk of the bias; none before the window has one.
  std::vector<FixedLagSmoother::RandomWalk> randomWalks() const;
  /// The clock of the IMU jumped: forgets all but the options.
  void startAgain() { *this = BarometerChannel(options_); }

 private:
  struct Sample {
    Time time;
    double height = 0.0;  ///< [m] above the first
    double span = 0.0;    ///< [s] that it stands for
  };
  /// Mean of consecutive samples.
  struct Mean {
    Time first;
    double time_sum = 0.0;    ///< [s] after `first`
    double height_sum = 0.0;  ///< [m]
    double span = 0.0;        ///< [s]
    int count = 0;
    Time time() const { return first + time_sum / count; }
    double height() const { return height_sum / count; }
  };
  /// Deviation of a mean from the motion by radar and IMU.
  struct Deviation {
    Time time;
    double height = 0.0;             ///< [m] of the mean above the climb of the nodes
    double innovation = 0.0;         ///< [m]
    double velocity_variance = 0.0;  ///< [m^2/s^2]
  };
  /// How far the nodes have climbed until `node`. Each step is between two nodes of one solution.
  struct Climb {
    Time node;
    double height = 0.0;  ///< [m]
  };
  /// The straight line through all deviations (docs/method.md, eq. 19i).
  struct Slope {
    double value = 0.0;       ///< [m/s]
    double innovation = 0.0;  ///< [m] the mean of the deviations' innovations
    bool is_whole = false;    ///< whether the deviations last long enough for both
    bool is_steep = false;    ///< whether this line is too steep, or one through only the newest deviations
  };
  static void add(const Sample& sample, Mean& mean);
  /// [s] of the recent samples; none before the third one.
  std::optional<double> meanSpacing() const;
  const char* collect(const Sample& sample);
  double variance(const Mean& mean) const;  ///< [m^2]
  void addBias(FixedLagSmoother& smoother, double bias);
  BarometerAnswer use(const Mean& mean, const NodeEstimate& node, FixedLagSmoother& smoother);
  Slope slopeWith(const Deviation& deviation, double noise, double span);
  /// Continues the climb to `node`. If the last node has left the window, climb and deviations begin anew.
  void climbTo(const NodeEstimate& node, const FixedLagSmoother& smoother);
  /// Removes the terms of the barometer from the window, since the pressure moves at `time`.
  void distrust(Time time, FixedLagSmoother& smoother);

  BarometerOptions options_;
  std::optional<double> reference_;  ///< the first pressure [Pa]
  std::optional<Time> newest_;
  NoiseMeter noise_;
  std::deque<Sample> recent_;
  Mean open_;                 ///< the mean that is being filled
  std::deque<Mean> waiting_;  ///< for a node
  std::shared_ptr<Block> bias_;
  std::optional<Time> rejected_since_;
  std::optional<Climb> climb_;
  std::deque<Deviation> deviations_;  ///< of the time that the slope needs
  std::optional<Time> moved_at_;      ///< when the pressure moved last; none while it rests
};

}  // namespace rio_t
