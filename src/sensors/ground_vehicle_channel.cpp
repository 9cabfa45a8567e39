#include "rio_t/sensors/ground_vehicle_channel.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/graph/marginalization.h"

namespace rio_t {
namespace {

/// [s] A bump or a slip lasts about this time. Terms nearer to each other would count it twice.
constexpr double kSpacing = 0.1;
/// [s] A longer pause between scans counts as this much judged motion.
constexpr double kMaxSpan = 0.5;
/// [s] of motion that is judged, and the mean of min(1, squared sigmas / gate^2) above which the motion is
/// not that of a vehicle (docs/method.md, section 5.9).
constexpr double kJudgedMotion = 5.0;
constexpr double kMaxContradiction = 0.5;

}  // namespace

GroundVehicleChannel::GroundVehicleChannel(const GroundVehicleOptions& options, double huber_threshold,
                                           const ImuBuffer& imu)
    : options_(options),
      loss_(huberLoss(huber_threshold)),
      imu_(&imu),
      manifold_(std::make_shared<ExtrinsicsManifold>(EstimateExtrinsics::kRotation)) {}

void GroundVehicleChannel::join(FixedLagSmoother& smoother, bool at_rest) {
  Window& window = smoother.window();
  frame_ = window.addCalibration(manifold_, stored(options_.T_IV));
  Block* node = smoother.nodeAt(smoother.newest().time);
  smoother.addCalibrationPrior({frame_.get()}, Eigen::Vector3d::Constant(options_.rotation_sigma));
  // The old estimate may have been wrong when it contradicted the vehicle.
  judged_at_.reset();
  judged_.clear();
  judged_span_ = 0.0;
  is_contradicted_ = false;
  if (at_rest && options_.start_slope_sigma > 0.0)
    window.add(std::make_unique<LevelGroundFactor>(options_.start_slope_sigma), {node, frame_.get()});
  smoother.settle();
}

Eigen::Vector3d GroundVehicleChannel::omegaAt(Time time) const {
  return imu_->mean(time, kVehicleGyroHalfWidth).angular_velocity;
}

std::optional<GroundVehicleAnswer> GroundVehicleChannel::judge(const FixedLagSmoother& smoother, Time time) {
  if (is_contradicted_ || (judged_at_ && time - *judged_at_ < kSpacing)) return std::nullopt;
  const auto predicted = smoother.predict(time, {frame_.get()});
  if (!predicted) return std::nullopt;
  const Eigen::MatrixXd& P = predicted->covariance;
  const VehicleVelocity velocity =
      vehicleVelocity(StateView(predicted->x), toExtrinsics(frame_->x.data()), omegaAt(time));
  Eigen::Matrix<double, 2, StateBlock::kTangent + 3> J;
  J << velocity.J_motion.bottomLeftCorner<2, 3>(), velocity.J_motion.bottomRightCorner<2, 6>(),
      velocity.J_biases.bottomRows<2>(), velocity.J_frame.bottomLeftCorner<2, 3>();
  Eigen::Matrix2d S = J * P * J.transpose();
  S(0, 0) += options_.sideways_sigma * options_.sideways_sigma;
  S(1, 1) += options_.vertical_sigma * options_.vertical_sigma;
  const Eigen::LDLT<Eigen::Matrix2d> S_factor(S);

  GroundVehicleAnswer answer;
  answer.time = time;
  answer.v_V = velocity.v_V;
  const Eigen::Vector2d across = velocity.v_V.tail<2>();
  answer.squared_sigmas = across.dot(S_factor.solve(across));
  answer.q_IV = toExtrinsics(frame_->x.data()).q_IR;
  answer.q_IV_sigma = P.diagonal().tail<3>().cwiseMax(0.0).cwiseSqrt();
  const double gate_square = options_.gate * options_.gate;
  answer.used = answer.squared_sigmas <= gate_square;

  // Motion is judged only if, at this speed, some direction of motion would contradict the constraint.
  const bool could_contradict = velocity.v_V.squaredNorm() > gate_square * S.diagonal().maxCoeff();
  const double span = judged_at_ ? std::clamp(time - *judged_at_, 0.0, kMaxSpan) : 0.0;
  judged_at_ = time;
  if (could_contradict)
    answer.contradiction =
        contradictionWith({time, span, std::min(1.0, answer.squared_sigmas / gate_square)});
  is_contradicted_ = answer.contradiction && *answer.contradiction > kMaxContradiction;
  answer.is_contradicted = is_contradicted_;
  if (is_contradicted_) answer.used = false;
  return answer;
}

std::optional<double> GroundVehicleChannel::contradictionWith(const Judged& judged) {
  judged_.push_back(judged);
  judged_span_ += judged.span;
  while (judged_span_ - judged_.front().span >= kJudgedMotion) {
    judged_span_ -= judged_.front().span;
    judged_.pop_front();
  }
  if (judged_span_ < kJudgedMotion) return std::nullopt;
  double sum = 0.0;
  for (const Judged& each : judged_) sum += each.span * each.contradiction;
  return sum / judged_span_;
}

bool GroundVehicleChannel::add(const GroundVehicleAnswer& answer, FixedLagSmoother& smoother) const {
  if (!answer.used) return false;
  Block* node = smoother.nodeAt(answer.time);
  if (node == nullptr) return false;
  smoother.window().add(
      std::make_unique<GroundVehicleFactor>(
          omegaAt(*node->time), Eigen::Vector2d(options_.sideways_sigma, options_.vertical_sigma)),
      {node, &smoother.biases(), frame_.get()}, loss_);
  return true;
}

std::vector<FixedLagSmoother::RandomWalk> GroundVehicleChannel::randomWalks() const {
  if (!frame_) return {};
  return {{frame_.get(), Eigen::VectorXd::Constant(3, options_.rotation_noise)}};
}

}  // namespace rio_t
