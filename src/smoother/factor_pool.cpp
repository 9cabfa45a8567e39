#include "rio_t/smoother/factor_pool.h"

namespace rio_t {
namespace {

/// The last of `spares`; null where there is none.
template <typename T>
std::unique_ptr<T> takeOne(std::vector<std::unique_ptr<T>>& spares) {
  if (spares.empty()) return nullptr;
  std::unique_ptr<T> spare = std::move(spares.back());
  spares.pop_back();
  return spare;
}

/// `Factor(arguments...)`, in the place of `spare` where there is one; it must be a Factor.
template <typename Factor, typename Base, typename... Arguments>
std::unique_ptr<Base> renewed(std::unique_ptr<Base> spare, const Arguments&... arguments) {
  if (!spare) return std::make_unique<Factor>(arguments...);
  static_cast<Factor&>(*spare).set(arguments...);
  return spare;
}

}  // namespace

FactorPool::FactorPool(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
                       const ImuBuffer& imu)
    : options_(options), noise_(noise), g_W_(g_W), imu_(&imu) {}

std::unique_ptr<ImuFactor> FactorPool::imuFactor(const Preintegration& preintegration) {
  return renewed<ImuFactor>(takeOne(imu_factors_), preintegration, noise_, g_W_);
}

std::unique_ptr<ConstantOffsetFactor> FactorPool::offsetFactor(double sigma) {
  return renewed<ConstantOffsetFactor>(takeOne(offset_factors_), sigma);
}

std::unique_ptr<ZeroVelocityFactor> FactorPool::zeroVelocityFactor(double velocity_sigma) {
  return renewed<ZeroVelocityFactor>(takeOne(zero_velocity_factors_), velocity_sigma);
}

std::unique_ptr<RadarCost> FactorPool::radarFactor(const RadarVelocityMeasurement& z, Time node_time) {
  if (options_.time_offset_model == TimeOffsetModel::kImu) {
    return renewed<ImuRadarFactor>(takeOne(radar_factors_), z, node_time, *imu_, options_.max_time_offset,
                                   g_W_);
  }
  return renewed<ConstantAccelerationRadarFactor>(takeOne(radar_factors_), z, *imu_, g_W_);
}

WindowNode FactorPool::node() {
  if (nodes_.empty()) return {};
  WindowNode node = std::move(nodes_.back());
  nodes_.pop_back();
  return node;
}

void FactorPool::recycle(WindowNode node) {
  recycle(std::move(node.imu_from_previous));
  recycle(std::move(node.offset_from_previous));
  recycle(std::move(node.rest));
  for (RadarTerm& term : node.radar) recycle(std::move(term.cost));
  node.radar.clear();  // keeps its memory
  node.offset_step_variance = 0.0;
  nodes_.push_back(std::move(node));
}

}  // namespace rio_t
