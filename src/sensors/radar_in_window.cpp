#include "rio_t/sensors/radar_in_window.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/so3.h"
#include "rio_t/factors/imu_factor.h"
#include "rio_t/factors/radar_motion.h"

namespace rio_t {

RadarInWindow::RadarInWindow(const SmootherOptions& options, const CalibrationPrior& radar,
                             const Eigen::Vector3d& g_W, const ImuBuffer& imu,
                             std::shared_ptr<OffsetBlocks> offset)
    : options_(options),
      radar_(radar),
      model_{options.time_offset_model, options.max_time_offset, g_W, &imu},
      loss_(huberLoss(options.huber_threshold)),
      extrinsics_manifold_(std::make_shared<ExtrinsicsManifold>(options.estimate_extrinsics)),
      offset_(std::move(offset)) {}

void RadarInWindow::addExtrinsics(Window& window, const Extrinsics& T_IR, std::vector<Block*>& estimated) {
  scans_.clear();
  extrinsics_ = window.addCalibration(extrinsics_manifold_, stored(T_IR));
  if (options_.estimate_extrinsics == EstimateExtrinsics::kNone)
    window.setConstant(*extrinsics_, true);
  else
    estimated.push_back(extrinsics_.get());
}

void RadarInWindow::start(FixedLagSmoother& smoother, Time time, const NodePrior& prior) {
  Block& node = smoother.start(time, prior.x0);
  std::vector<Block*> blocks = {&node, &smoother.biases(), &offset_->start(smoother.window(), prior.t_O0)};
  addExtrinsics(smoother.window(), prior.T_IR0, blocks);
  addPrior(smoother.window(), blocks, prior.root);
  smoother.settle();
}

void RadarInWindow::join(FixedLagSmoother& smoother) {
  Window& window = smoother.window();
  std::vector<Block*> blocks;
  if (!options_.time_offset_shared) blocks.push_back(&offset_->start(window, radar_.time_offset_initial));
  addExtrinsics(window, radar_.T_IR, blocks);
  const Eigen::VectorXd sigmas =
      options_.time_offset_shared ? extrinsicsSigmas(options_, radar_) : calibrationSigmas(options_, radar_);
  if (!blocks.empty()) smoother.addCalibrationPrior(std::move(blocks), sigmas);
  smoother.settle();
}

std::vector<const Block*> RadarInWindow::calibration() const {
  std::vector<const Block*> blocks = {&offset_->newest()};
  if (!extrinsics_->is_constant) blocks.push_back(extrinsics_.get());
  return blocks;
}

Time RadarInWindow::nodeTime(Time stamp) const {
  return options_.time_offset_model == TimeOffsetModel::kImu ? stamp - offset() : stamp;
}

std::optional<RadarVelocityPrediction> RadarInWindow::predict(const FixedLagSmoother& smoother,
                                                              Time stamp) const {
  const Time time = nodeTime(stamp);
  const std::optional<PredictedState> state = smoother.predict(time, calibration());
  if (!state) return std::nullopt;
  const Extrinsics T_IR = extrinsics();
  const Eigen::Matrix3d R_RI = T_IR.R_RI();
  // A short mean, even if the IMU vibrates: a wide one would smooth away what an unknown offset changes.
  const ImuMean mean = model_.imu->mean(time, kOffsetHalfWidth);
  const RadarMotion motion = model_.at(StateView(state->x), time, stamp, offset(), T_IR.l_I, &mean);
  constexpr int kOffset = StateBlock::kTangent;
  const Eigen::MatrixXd& P = state->covariance;
  Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, P.cols());
  J.leftCols<kOffset>() << motion.J_motion.leftCols<3>(), motion.J_motion.rightCols<6>(), motion.J_biases;
  J.col(kOffset) = motion.dv_dt_O;
  if (estimatesTurn(options_.estimate_extrinsics)) J.middleCols<3>(kOffset + 1) = so3::hat(motion.v_I);
  if (estimatesLeverArm(options_.estimate_extrinsics)) J.rightCols<3>() = so3::hat(motion.omega_I);
  J = (R_RI * J).eval();

  RadarVelocityPrediction prediction;
  prediction.velocity.v_R = R_RI * motion.v_I;
  prediction.scan.tau = time;
  prediction.scan.x = state->x;
  prediction.scan.T_IR = T_IR;
  prediction.velocity.covariance = J * P * J.transpose();
  Eigen::Matrix<double, 3, Eigen::Dynamic> J_at_offset = J;
  J_at_offset.col(kOffset).setZero();
  prediction.scan.predicted = J_at_offset * P * J_at_offset.transpose();
  const Eigen::Quaterniond q_IW = state->x.q_WI().conjugate();
  const Eigen::Vector3d g_I = q_IW * model_.g_W;
  Eigen::Matrix<double, 3, StateBlock::kTangent> J_rate =
      Eigen::Matrix<double, 3, StateBlock::kTangent>::Zero();
  J_rate.middleCols<3>(StateBlock::kTheta) = R_RI * so3::hat(g_I);
  J_rate.middleCols<3>(StateBlock::kBa) = -R_RI;
  prediction.scan.shared = J_rate * P.topLeftCorner<kOffset, kOffset>() * J_rate.transpose();
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
  // The model of constant acceleration does not carry a state from its node to the scan.
  const StateBlock x = carried(node->x, node->time, time, *model_.imu, model_.g_W);
  const Extrinsics T_IR = extrinsics();
  return T_IR.R_RI() * model_.at(StateView(x), time, stamp, offset(), T_IR.l_I, nullptr).v_I;
}

void RadarInWindow::updateSlowMotion(const FixedLagSmoother& smoother) {
  const std::vector<NodeEstimate> nodes = smoother.nodes();
  const Extrinsics T_IR = extrinsics();
  std::vector<SlowMotion*> motions;
  for (const Scan& scan : scans_) {
    if (scan.node < nodes.front().time) continue;
    *scan.slow =
        slowMotion(nodes, nearestNode(nodes, scan.node), scan.half_width, *model_.imu, T_IR, scan.slow->T_IR);
    motions.push_back(scan.slow.get());
  }
  keepTurns(motions);
}

template <class Factor, class Measurement>
bool RadarInWindow::addTerm(FixedLagSmoother& smoother, Measurement z,
                            const std::shared_ptr<ceres::LossFunction>& loss) {
  const Time oldest = smoother.node(0).time - 2.0 * options_.max_time_offset;
  scans_.erase(
      std::remove_if(scans_.begin(), scans_.end(), [&](const Scan& scan) { return scan.stamp < oldest; }),
      scans_.end());
  Block* node = smoother.nodeAt(nodeTime(z.stamp));
  if (node == nullptr) return false;
  const bool is_estimated = options_.estimate_extrinsics != EstimateExtrinsics::kNone;
  const auto slow = is_estimated ? std::make_shared<SlowMotion>(SlowMotion{extrinsics()}) : nullptr;
  scans_.push_back({z.stamp, *node->time, z.slow_half_width, slow});
  if (is_estimated) updateSlowMotion(smoother);
  z.slow = slow;
  const OffsetBlocks::OfScan offset = offset_->of(smoother.window(), z.stamp);
  if (z.linear_from_t_O) z.linear_from_t_O = offset.linear_from;
  Term& term = smoother.window().add(std::make_unique<Factor>(z, *node->time, model_),
                                     {node, &smoother.biases(), offset.block, extrinsics_.get()}, loss);
  term.stamp = z.stamp;
  return true;
}

bool RadarInWindow::add(FixedLagSmoother& smoother, const RadarVelocityMeasurement& z) {
  return addTerm<RadarVelocityFactor>(smoother, z, loss_);
}

bool RadarInWindow::add(FixedLagSmoother& smoother, const DopplerMeasurement& z) {
  return addTerm<DopplerFactor>(smoother, z, nullptr);  // its loss is in its rows
}

}  // namespace rio_t
