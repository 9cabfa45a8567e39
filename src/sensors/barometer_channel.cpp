#include "rio_t/sensors/barometer_channel.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/format.h"
#include "rio_t/factors/barometer_factor.h"
#include "rio_t/graph/marginalization.h"

namespace rio_t {
namespace {

constexpr double kLapseRate = 6.5e-3;         // [K/m] ISO 2533
constexpr double kGasConstant = 287.05287;    // [J/(kg K)] of dry air, ISO 2533
constexpr double kStandardGravity = 9.80665;  // [m/s^2]
constexpr double kFreezing = 273.15;          // [K]
/// [Pa] The pressures 9 km above and 1 km below the sea. People are nowhere else.
constexpr double kLeastPressure = 30e3;
constexpr double kMostPressure = 115e3;
/// [s] of samples in a mean. Shorter means need more terms without more information: the noise is white.
constexpr double kMeanSpan = 0.1;
/// [s] A mean joins a node that is this near: at 1 m/s^2 the height then deviates by 5 mm.
constexpr double kNear = 0.1;
/// [s] of samples before a start at rest: the shortest rest from which the estimate starts.
constexpr double kBeforeStart = 1.0;
/// [s] of samples that are kept for a start. A start in motion lies up to a window of motion back.
constexpr double kRecent = 12.0;
/// [s] A sample stamped further ahead of the IMU has a wrong stamp.
constexpr double kMaxAhead = 1.0;
/// [mean spacings] A sample stands for at most this time. If samples are missing, the next one is not more
/// accurate. Samples that come in pairs are this far apart.
constexpr double kMissing = 2.0;
/// Means that wait for a node: those of a minute without scans.
constexpr std::size_t kMaxWaiting = 600;

}  // namespace

double heightOfPressure(double pascal, double reference_pascal, double temperature) {
  constexpr double kExponent = kGasConstant * kLapseRate / kStandardGravity;
  return (temperature + kFreezing) / kLapseRate * (1.0 - std::pow(pascal / reference_pascal, kExponent));
}

std::string faultOf(double pascal) {
  if (pascal >= kLeastPressure && pascal <= kMostPressure) return "";
  const bool is_hectopascal = pascal >= 0.01 * kLeastPressure && pascal <= 0.01 * kMostPressure;
  return formatted("the pressure is %g, expected %g to %g Pa%s", pascal, kLeastPressure, kMostPressure,
                   is_hectopascal ? ": is it in hPa? 1 hPa is 100 Pa" : "");
}

const char* BarometerChannel::add(const Pressure& pressure, Time newest_imu) {
  if (!faultOf(pressure.pascal).empty()) return "pressure_not_usable";
  if (pressure.time - newest_imu > kMaxAhead) return "pressure_ahead_of_imu";
  if (newest_ && pressure.time <= *newest_) return "pressure_out_of_order";
  if (!reference_) reference_ = pressure.pascal;
  const double height = heightOfPressure(pressure.pascal, *reference_, options_.temperature);
  const double since = newest_ ? pressure.time - *newest_ : 0.0;
  const double span = std::min(since, kMissing * meanSpacing().value_or(kMeanSpan));
  newest_ = pressure.time;
  noise_.add(pressure.time, Eigen::Vector3d(height, 0.0, 0.0));
  if (span == 0.0) return nullptr;  // one sample gives no rate
  recent_.push_back({pressure.time, height, span});
  while (pressure.time - recent_.front().time > kRecent) recent_.pop_front();
  return bias_ ? collect(recent_.back()) : nullptr;
}

std::optional<double> BarometerChannel::meanSpacing() const {
  if (recent_.size() < 2) return std::nullopt;
  return (recent_.back().time - recent_.front().time) / static_cast<double>(recent_.size() - 1);
}

const char* BarometerChannel::collect(const Sample& sample) {
  // A mean must not reach over a silence.
  if (open_.count > 0 && sample.time - open_.first > 2.0 * kMeanSpan)
    waiting_.push_back(std::exchange(open_, Mean()));
  add(sample, open_);
  if (open_.span >= kMeanSpan) waiting_.push_back(std::exchange(open_, Mean()));
  if (waiting_.size() <= kMaxWaiting) return nullptr;
  waiting_.pop_front();
  return "pressure_without_node";
}

void BarometerChannel::add(const Sample& sample, Mean& mean) {
  if (mean.count == 0) mean.first = sample.time;
  mean.time_sum += sample.time - mean.first;
  mean.height_sum += sample.height;
  mean.span += sample.span;
  ++mean.count;
}

double BarometerChannel::variance(const Mean& mean) const {
  const double configured = options_.noise_density * options_.noise_density;
  return std::max(configured, noise_.squaredDensity()) / mean.span;
}

void BarometerChannel::addBias(FixedLagSmoother& smoother, double bias) {
  Window& window = smoother.window();
  if (bias_ && window.has(*bias_)) bias_->is_retired = true;
  bias_ = window.addCalibration(std::make_shared<VectorManifold>(1), Eigen::VectorXd::Constant(1, bias));
  addPrior(window, *bias_, Eigen::VectorXd::Constant(1, kUnknownBarometerBias));
  smoother.settle();
}

void BarometerChannel::join(FixedLagSmoother& smoother, Time time, bool at_rest) {
  open_ = Mean();
  waiting_.clear();
  rejected_since_.reset();
  deviations_.clear();
  climb_.reset();
  moved_at_.reset();
  Mean at_start;
  for (const Sample& sample : recent_)
    if (sample.time <= time && time - sample.time <= kBeforeStart) add(sample, at_start);
  const double height = at_start.count > 0 ? at_start.height() : 0.0;
  addBias(smoother, height - smoother.newest().x.p_W().z());
  if (at_start.count > 0 && at_rest) {
    smoother.window().add(std::make_unique<BarometerFactor>(height, 0.0, std::sqrt(variance(at_start))),
                          {smoother.nodeAt(time), bias_.get()});
    smoother.settle();
  }
  for (const Sample& sample : recent_)
    if (sample.time > time) collect(sample);
}

std::vector<BarometerAnswer> BarometerChannel::use(FixedLagSmoother& smoother) {
  std::vector<BarometerAnswer> answers;
  if (!bias_) return answers;
  const std::vector<NodeEstimate> nodes = smoother.nodes();
  while (!waiting_.empty()) {
    const Mean mean = waiting_.front();
    if (mean.time() > nodes.back().time) break;  // a node may still come nearer
    waiting_.pop_front();
    const NodeEstimate& nearest = nodes[nearestNode(nodes, mean.time())];
    if (std::abs(nearest.time - mean.time()) <= kNear) {
      answers.push_back(use(mean, nearest, smoother));
      continue;
    }
    BarometerAnswer late;
    late.time = mean.time();
    late.samples = mean.count;
    late.rejected_because = mean.time() < nodes.front().time ? "older_than_window" : "no_node_near";
    answers.push_back(late);
  }
  // The next mean may come when the node of this one has left the window.
  climbTo(smoother.newest(), smoother);
  return answers;
}

void BarometerChannel::climbTo(const NodeEstimate& node, const FixedLagSmoother& smoother) {
  // The two nodes are of one solution: the barometer pulls both. After a silence the last one has left.
  const auto last = climb_ ? smoother.nodeBefore(climb_->node) : std::nullopt;
  if (!last) deviations_.clear();
  const double before = last ? climb_->height - last->x.p_W().z() : 0.0;
  climb_ = Climb{node.time, before + node.x.p_W().z()};
}

BarometerChannel::Slope BarometerChannel::slopeWith(const Deviation& deviation, double noise, double span) {
  const double memory = std::cbrt(12.0 * noise * span * std::pow(options_.gate / options_.gate_slope, 2));
  // The pressure may have changed in a silence, so the lines begin anew.
  if (!deviations_.empty() && deviation.time - deviations_.back().time > memory + kMissing * span)
    deviations_.clear();
  deviations_.push_back(deviation);
  while (deviations_.size() > 3 && deviation.time - deviations_[1].time >= memory) deviations_.pop_front();
  Slope slope;
  double n = 0.0, times = 0.0, heights = 0.0, squares = 0.0, products = 0.0, velocity_variances = 0.0;
  double innovations = 0.0;
  for (auto each = deviations_.rbegin(); each != deviations_.rend(); ++each) {
    const double dt = each->time - deviation.time;
    n += 1.0;
    times += dt;
    heights += each->height;
    squares += dt * dt;
    products += dt * each->height;
    velocity_variances += each->velocity_variance;
    innovations += each->innovation;
    if (n < 3.0) continue;
    const double square = squares - times * times / n;
    slope.value = (products - times * heights / n) / square;
    const double sigma = std::sqrt(noise / square + velocity_variances / n);
    if (std::abs(slope.value) > options_.gate_slope + options_.gate * sigma) slope.is_steep = true;
  }
  slope.innovation = innovations / n;
  slope.is_whole = n >= 3.0 && deviation.time - deviations_.front().time >= memory;
  return slope;
}

void BarometerChannel::distrust(Time time, FixedLagSmoother& smoother) {
  // The pressure moved before this was noticed, so its terms in the window are suspect.
  std::vector<const Term*> suspects;
  for (const auto& term : smoother.window().terms())
    if (dynamic_cast<const BarometerFactor*>(term->cost.get()) != nullptr) suspects.push_back(term.get());
  for (const Term* term : suspects) smoother.window().remove(*term);
  deviations_.clear();
  rejected_since_.reset();
  moved_at_ = time;
}

BarometerAnswer BarometerChannel::use(const Mean& mean, const NodeEstimate& node,
                                      FixedLagSmoother& smoother) {
  const double delay = mean.time() - node.time;
  const auto predicted = smoother.predict(node.time, {bias_.get()});
  const Eigen::MatrixXd& P = predicted->covariance;
  Eigen::RowVectorXd J = Eigen::RowVectorXd::Zero(P.cols());
  J[StateBlock::kP + 2] = 1.0;
  J[StateBlock::kV + 2] = delay;
  J[StateBlock::kTangent] = 1.0;
  const double noise = variance(mean);
  BarometerAnswer answer;
  answer.time = mean.time();
  answer.samples = mean.count;
  answer.bias = bias_->x[0];
  answer.bias_sigma = std::sqrt(std::max(0.0, P(StateBlock::kTangent, StateBlock::kTangent)));
  answer.height = mean.height() - answer.bias;
  answer.noise_sigma = std::sqrt(noise);
  answer.innovation = answer.height - (predicted->x.p_W().z() + delay * predicted->x.v_W().z());
  const double variance_of_prediction = std::max(0.0, (J * P * J.transpose())(0, 0));
  answer.innovation_sigma = std::sqrt(variance_of_prediction + noise);
  const bool contradicts =
      options_.gate > 0.0 && std::abs(answer.innovation) > options_.gate * answer.innovation_sigma;
  if (!moved_at_ && contradicts) {
    if (!rejected_since_) rejected_since_ = answer.time;
    if (answer.time - *rejected_since_ >= options_.gate_timeout) distrust(answer.time, smoother);
    answer.rejected_because = "innovation";
    return answer;
  }
  rejected_since_.reset();
  climbTo(node, smoother);
  const Slope slope = slopeWith({answer.time, mean.height() - delay * node.x.v_W().z() - climb_->height,
                                 answer.innovation, P(StateBlock::kV + 2, StateBlock::kV + 2)},
                                noise, mean.span);
  if (!moved_at_ && options_.gate > 0.0 && slope.is_steep) distrust(answer.time, smoother);
  if (moved_at_) {
    if (!slope.is_whole || std::abs(slope.value) > options_.gate_slope) moved_at_ = answer.time;
    if (answer.time - *moved_at_ < options_.gate_timeout) {
      answer.rejected_because = "pressure_moves";
      return answer;
    }
    moved_at_.reset();
    const double sigma = std::sqrt(variance_of_prediction + noise / static_cast<double>(deviations_.size()));
    answer.stepped = std::abs(slope.innovation) > options_.gate * sigma;
    if (answer.stepped) addBias(smoother, answer.bias + slope.innovation);
  }
  smoother.window().add(std::make_unique<BarometerFactor>(mean.height(), delay, std::sqrt(noise)),
                        {smoother.nodeAt(node.time), bias_.get()});
  return answer;
}

std::vector<FixedLagSmoother::RandomWalk> BarometerChannel::randomWalks() const {
  if (!bias_) return {};
  return {{bias_.get(), Eigen::VectorXd::Constant(1, options_.drift)}};
}

}  // namespace rio_t
