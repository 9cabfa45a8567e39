#include "rio_t/simulation/imu_model.h"

#include <cmath>
#include <stdexcept>

#include "rio_t/simulation/random.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t::simulation {
namespace {

constexpr std::uint64_t kBiasStream = 10;
constexpr std::uint64_t kNoiseStream = 11;
constexpr std::uint64_t kVibrationStream = 12;
constexpr std::uint64_t kDropoutStream = 13;
constexpr std::uint64_t kScaleStream = 14;

Eigen::Vector3d saturated(const Eigen::Vector3d& value, double limit) {
  return value.cwiseMax(-limit).cwiseMin(limit);
}

void check(const ImuModelOptions& options) {
  const auto require = [](bool ok, const char* what) {
    if (!ok) throw std::invalid_argument(what);
  };
  const ImuNoise& n = options.noise;
  require(options.rate > 0.0, "IMU rate must be positive");
  require(n.accel_density >= 0.0 && n.gyro_density >= 0.0 && n.accel_random_walk >= 0.0 &&
              n.gyro_random_walk >= 0.0 && n.gyro_scale_error >= 0.0,
          "IMU noise cannot be negative");
  require(options.accel_vibration >= 0.0 && options.gyro_vibration >= 0.0,
          "IMU vibration cannot be negative");
  require(options.vibration_frequency >= 0.0, "frequency of the IMU vibration cannot be negative");
  require(options.dropout_share >= 0.0 && options.dropout_share < 1.0,
          "share of lost IMU samples must be at least 0 and below 1");
  require(options.accel_saturation > 0.0 && options.gyro_saturation > 0.0, "IMU saturation must be positive");
}

// What one sensor feels of the vibration.
//
// White, or the real part of a complex Ornstein-Uhlenbeck process turned at the frequency: stationary and
// normal, with the autocorrelation sigma^2 exp(-|dt| / coherence) cos(2 pi f dt).
class Vibration {
 public:
  Vibration(double sigma, double frequency, const Random& random)
      : sigma_(sigma), frequency_(frequency), random_(random) {
    if (frequency_ > 0.0) {
      in_phase_ = random_.gaussianVector();
      quadrature_ = random_.gaussianVector();
    }
  }

  // At `t` seconds after the start; `t` must not fall from call to call.
  Eigen::Vector3d at(double t) {
    if (frequency_ <= 0.0) return sigma_ * random_.gaussianVector();
    const double kept = std::exp(-(t - t_) / kCoherence);
    const double renewed = std::sqrt(1.0 - kept * kept);
    in_phase_ = kept * in_phase_ + renewed * random_.gaussianVector();
    quadrature_ = kept * quadrature_ + renewed * random_.gaussianVector();
    t_ = t;
    const double phase = 2.0 * M_PI * frequency_ * t;
    return sigma_ * (std::cos(phase) * in_phase_ - std::sin(phase) * quadrature_);
  }

 private:
  static constexpr double kCoherence = 0.5;  // [s]

  double sigma_;
  double frequency_;  // [Hz]
  Random random_;
  double t_ = 0.0;  // of in_phase_ and quadrature_
  Eigen::Vector3d in_phase_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d quadrature_ = Eigen::Vector3d::Zero();
};

}  // namespace

void ImuModelOptions::removeErrors() {
  noise.accel_density = noise.gyro_density = 0.0;
  noise.accel_random_walk = noise.gyro_random_walk = noise.gyro_scale_error = 0.0;
  accel_vibration = gyro_vibration = 0.0;
  dropout_share = 0.0;
  accel_bias = Eigen::Vector3d::Zero();
  gyro_bias = Eigen::Vector3d::Zero();
}

ImuData simulateImu(const Motion& motion, const ImuModelOptions& options, std::uint64_t seed, Time start) {
  check(options);
  checkSampleCount("imu-rate", options.rate, motion.duration());
  Random bias_random(seed, kBiasStream);
  Random random(seed, kNoiseStream);
  Random dropout_random(seed, kDropoutStream);
  Vibration accel_vibration(options.accel_vibration, options.vibration_frequency,
                            Random(seed, kVibrationStream, 0));
  Vibration gyro_vibration(options.gyro_vibration, options.vibration_frequency,
                           Random(seed, kVibrationStream, 1));
  const Eigen::Vector3d drawn_b_a = options.accel_bias_sigma * bias_random.gaussianVector();
  const Eigen::Vector3d drawn_b_g = options.gyro_bias_sigma * bias_random.gaussianVector();
  Eigen::Vector3d b_a = options.accel_bias.value_or(drawn_b_a);
  Eigen::Vector3d b_g = options.gyro_bias.value_or(drawn_b_g);
  const Eigen::Vector3d scale =
      Eigen::Vector3d::Ones() + options.noise.gyro_scale_error * Random(seed, kScaleStream).gaussianVector();
  const double root_rate = std::sqrt(options.rate);
  const Eigen::Vector3d g_W(0.0, 0.0, -options.gravity);

  ImuData data;
  const auto count = static_cast<std::size_t>(std::floor(motion.duration() * options.rate)) + 1;
  data.samples.reserve(count);
  data.b_a.reserve(count);
  data.b_g.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    ImuMeasurement sample;
    sample.time = start + static_cast<double>(i) / options.rate;
    // The motion is asked at the rounded stamp, so that stamp and value agree to the last bit.
    const double t = sample.time - start;
    const MotionState state = motion.at(t);
    sample.angular_velocity =
        saturated(scale.cwiseProduct(state.omega_I) + b_g +
                      options.noise.gyro_density * root_rate * random.gaussianVector() + gyro_vibration.at(t),
                  options.gyro_saturation);
    sample.acceleration = saturated(state.q_WI.conjugate() * (state.a_W - g_W) + b_a +
                                        options.noise.accel_density * root_rate * random.gaussianVector() +
                                        accel_vibration.at(t),
                                    options.accel_saturation);
    const bool is_lost = i > 0 && dropout_random.chance(options.dropout_share);
    if (!is_lost) {
      data.samples.push_back(sample);
      data.b_a.push_back(b_a);
      data.b_g.push_back(b_g);
    }
    b_a += options.noise.accel_random_walk / root_rate * random.gaussianVector();
    b_g += options.noise.gyro_random_walk / root_rate * random.gaussianVector();
  }
  return data;
}

}  // namespace rio_t::simulation
