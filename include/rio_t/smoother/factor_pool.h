#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "rio_t/factors/radar_velocity_factor.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/imu/noise.h"
#include "rio_t/smoother/options.h"
#include "rio_t/smoother/window.h"

namespace rio_t {

/// Makes the factors of a window from those that have left it: a Ceres cost function allocates when it is
/// made, so once a window is full none is. Not thread-safe.
class FactorPool {
 public:
  /// `imu` must outlive the pool and its factors.
  FactorPool(const SmootherOptions& options, const ImuNoise& noise, const Eigen::Vector3d& g_W,
             const ImuBuffer& imu);

  std::unique_ptr<ImuFactor> imuFactor(const Preintegration& preintegration);
  std::unique_ptr<ConstantOffsetFactor> offsetFactor(double sigma);
  std::unique_ptr<ZeroVelocityFactor> zeroVelocityFactor(double velocity_sigma);
  /// Of the model that the options name, for a node at `node_time`.
  std::unique_ptr<RadarCost> radarFactor(const RadarVelocityMeasurement& z, Time node_time);
  /// Without factors.
  WindowNode node();

  // Back into the pool; null is fine.
  void recycle(std::unique_ptr<ImuFactor> factor) { keep(std::move(factor), imu_factors_); }
  void recycle(std::unique_ptr<ConstantOffsetFactor> factor) { keep(std::move(factor), offset_factors_); }
  void recycle(std::unique_ptr<ZeroVelocityFactor> factor) { keep(std::move(factor), zero_velocity_factors_); }
  void recycle(std::unique_ptr<RadarCost> factor) { keep(std::move(factor), radar_factors_); }
  void recycle(WindowNode node);

 private:
  template <typename Factor>
  using Spares = std::vector<std::unique_ptr<Factor>>;

  template <typename Factor>
  static void keep(std::unique_ptr<Factor> factor, Spares<Factor>& spares) {
    if (factor) spares.push_back(std::move(factor));
  }

  SmootherOptions options_;  // read-only after construction, as the next three
  ImuNoise noise_;
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;

  Spares<ImuFactor> imu_factors_;
  Spares<ConstantOffsetFactor> offset_factors_;
  Spares<ZeroVelocityFactor> zero_velocity_factors_;
  Spares<RadarCost> radar_factors_;  ///< all of one model
  std::vector<WindowNode> nodes_;
};

}  // namespace rio_t
