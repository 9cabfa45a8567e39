#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Core>
#include <cmath>
#include <memory>

#include "rio_t/factors/radar_velocity_model.h"
#include "rio_t/radar/doppler_likelihood.h"

namespace rio_t {

/// The Dopplers of one scan, as the factor needs them.
struct DopplerMeasurement : RadarScanTime {
  std::shared_ptr<const DopplerLikelihood> points;
  /// [m^2/s^2] Variances of the velocity error that the points share, along the axes of R (added_sigma).
  Eigen::Vector3d shared_variances = Eigen::Vector3d::Zero();
  double huber_threshold = 0.0;  ///< [sigma] of the shared error; 0: no robust loss
};

/// The Doppler of each point of a scan, tightly coupled (docs/method.md, section 5.7). Any number of points
/// is useful, in a plane or not. Blocks: motion at `state_time`, biases, t_O, extrinsics.
///
/// All points depend on the state only through the velocity of the radar. So three rows that depend on this
/// velocity and one row with the remaining misfit have the same cost, gradient and J'J as a row for each
/// point. They include the robust loss.
class DopplerFactor final : public ceres::SizedCostFunction<4, StateBlock::kMotion, StateBlock::kBiases, 1,
                                                            ExtrinsicsBlock::kSize> {
 public:
  DopplerFactor(const DopplerMeasurement& z, Time state_time, const RadarMotionModel& model)
      : points_(z.points),
        shared_variances_(z.shared_variances),
        huber_threshold_(z.huber_threshold),
        model_(z, state_time, model) {}
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

 private:
  VelocityCost costAt(const Eigen::Vector3d& v_R) const;

  std::shared_ptr<const DopplerLikelihood> points_;
  Eigen::Vector3d shared_variances_;
  double huber_threshold_;
  RadarVelocityModel model_;
  struct Expansion {
    Eigen::Vector3d v_R;
    VelocityCost cost;
  };
  /// The last expansion. It serves for velocities near it. This cache is not for two threads.
  mutable Expansion expansion_ = {Eigen::Vector3d::Constant(std::nan("")), {}};
};

}  // namespace rio_t
