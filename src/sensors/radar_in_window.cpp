#include "rio_t/sensors/radar_in_window.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/so3.h"
#include "rio_t/factors/constant_offset_factor.h"
#include "rio_t/factors/offset_derivative.h"

namespace rio_t {

RadarInWindow::RadarInWindow(const SmootherOptions& options, const Extrinsics& T_IR,
                             const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options),
      T_IR_(T_IR),
      model_{options.time_offset_model, options.max_time_offset, g_W, &imu},
      loss_(huberLoss(options.huber_threshold)),
      manifold_(std::make_shared<ScalarManifold>()) {}

Block& RadarInWindow::start(Window& window, double t_O) {
  stamps_.clear();
  epochs_ = {{Time(), addOffset(window, t_O)}};
  return *epochs_.back().block;
}

std::shared_ptr<Block> RadarInWindow::addOffset(Window& window, double t_O) const {
  std::shared_ptr<Block> block = window.addCalibration(manifold_, Eigen::VectorXd::Constant(1, t_O));
  block->bound = options_.max_time_offset;
  if (!options_.estimate_time_offset) window.setConstant(*block, true);
  return block;
}

Time RadarInWindow::nodeTime(Time stamp) const {
  return options_.time_offset_model == TimeOffsetModel::kImu ? stamp - offset() : stamp;
}

std::optional<RadarVelocityPrediction> RadarInWindow::predict(const FixedLagSmoother& smoother,
                                                              Time stamp) const {
  const Time time = nodeTime(stamp);
  const std::optional<PredictedState> state = smoother.predict(time, {&offsetBlock()});
  if (!state) return std::nullopt;
  const Eigen::Matrix3d R_RI = T_IR_.R_RI();
  // Over a short time, whatever the noise: what an unknown offset may do must not be smoothed away.
  const ImuMean mean = model_.imu->mean(time, kOffsetHalfWidth);
  const RadarMotion motion = model_.at(state->x.data(), time, stamp, offset(), T_IR_.l_I, &mean);
  Eigen::Matrix<double, 3, kNodeTangent> J;
  J << motion.J_state.leftCols<3>(), motion.J_state.rightCols<StateBlock::kTangent - 3>(), motion.dv_dt_O;
  J = (R_RI * J).eval();
  const NodeMatrix P = state->covariance;
  constexpr int kOffset = StateBlock::kTangent;

  RadarVelocityPrediction prediction;
  prediction.t_O = offset();
  prediction.velocity.v_R = R_RI * motion.v_I;
  if (!options_.estimate_time_offset) J.col(kOffset).setZero();
  prediction.velocity.covariance = J * P * J.transpose();
  const auto J_state = J.leftCols<kOffset>();
  prediction.covariance_at_offset = J_state * P.topLeftCorner<kOffset, kOffset>() * J_state.transpose();
  const Eigen::Quaterniond q_IW = state->x.q_WI().conjugate();
  const Eigen::Vector3d g_I = q_IW * model_.g_W;
  prediction.dv_dt_O = offsetDerivative(*model_.imu, time, state->x, model_.g_W, T_IR_);
  Eigen::Matrix<double, 3, StateBlock::kTangent> J_rate =
      Eigen::Matrix<double, 3, StateBlock::kTangent>::Zero();
  J_rate.middleCols<3>(StateBlock::kTheta) = R_RI * so3::hat(g_I);
  J_rate.middleCols<3>(StateBlock::kBa) = -R_RI;
  prediction.dv_dt_O.shared = J_rate * P.topLeftCorner<kOffset, kOffset>() * J_rate.transpose();
  if (options_.estimate_time_offset)
    prediction.rate_variance = prediction.dv_dt_O.variance * P(kOffset, kOffset);
  const Eigen::Matrix<double, 2, 3> horizontal = state->x.q_WI().toRotationMatrix().topRows<2>();
  const Eigen::Matrix2d tilt =
      horizontal * P.block<3, 3>(StateBlock::kTheta, StateBlock::kTheta) * horizontal.transpose();
  prediction.tilt_sigma = std::sqrt(tilt.diagonal().maxCoeff());
  return prediction;
}

std::optional<Eigen::Vector3d> RadarInWindow::velocityAt(const FixedLagSmoother& smoother, Time stamp) const {
  const Time time = nodeTime(stamp);
  const std::optional<NodeEstimate> node = smoother.nodeBefore(time);
  if (!node) return std::nullopt;
  return T_IR_.R_RI() * model_.at(node->x.data(), node->time, stamp, offset(), T_IR_.l_I, nullptr).v_I;
}

template <class Factor, class Measurement>
RadarInWindow::AddResult RadarInWindow::addTerm(FixedLagSmoother& smoother, const Measurement& z,
                                                const std::shared_ptr<ceres::LossFunction>& loss) {
  const Time oldest = smoother.node(0).time - 2.0 * options_.max_time_offset;
  stamps_.erase(std::remove_if(stamps_.begin(), stamps_.end(), [&](Time stamp) { return stamp < oldest; }),
                stamps_.end());
  if (std::find(stamps_.begin(), stamps_.end(), z.stamp) != stamps_.end()) return AddResult::kDuplicateStamp;
  Block* node = smoother.nodeAt(nodeTime(z.stamp));
  if (node == nullptr) return AddResult::kOlderThanWindow;
  stamps_.push_back(z.stamp);
  smoother.window().add(std::make_unique<Factor>(z, *node->time, model_),
                        {node, &offsetOf(smoother.window(), z.stamp)}, loss);
  return AddResult::kAdded;
}

RadarInWindow::AddResult RadarInWindow::add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z) {
  return addTerm<RadarVelocityFactor>(smoother, z, loss_);
}

RadarInWindow::AddResult RadarInWindow::add(FixedLagSmoother& smoother, const DopplerMeasurement& z) {
  return addTerm<DopplerFactor>(smoother, z, nullptr);  // its loss is in its rows
}

Block& RadarInWindow::offsetOf(Window& window, Time stamp) {
  const auto is_gone = [&](const Epoch& epoch) { return !window.has(*epoch.block); };
  epochs_.erase(std::remove_if(epochs_.begin(), epochs_.end() - 1, is_gone), epochs_.end() - 1);
  auto epoch = epochs_.end() - 1;
  while (epoch != epochs_.begin() && stamp < epoch->since) --epoch;
  return *epoch->block;
}

void RadarInWindow::stepOffset(FixedLagSmoother& smoother, Time stamp) {
  if (!options_.estimate_time_offset) return;
  Window& window = smoother.window();
  Block& before = *epochs_.back().block;
  std::shared_ptr<Block> after = addOffset(window, offset());
  window.add(std::make_unique<ConstantOffsetFactor>(options_.time_offset_sigma), {&before, after.get()});
  before.is_retired = true;
  epochs_.push_back({stamp, std::move(after)});
  smoother.settle();
}

std::string toString(RadarInWindow::AddResult result) {
  switch (result) {
    case RadarInWindow::AddResult::kAdded:
      return "";
    case RadarInWindow::AddResult::kOlderThanWindow:
      return "older_than_window";
    case RadarInWindow::AddResult::kDuplicateStamp:
      return "duplicate_stamp";
  }
  return "";
}

void start(FixedLagSmoother& smoother, RadarInWindow& radar, Time time, const NodePrior& prior) {
  Block& state = smoother.start(time, prior.x0);
  Block& offset = radar.start(smoother.window(), prior.t_O0);
  addPrior(smoother.window(), {&state, &offset}, {prior.J, prior.r0});
  smoother.settle();
}

}  // namespace rio_t
