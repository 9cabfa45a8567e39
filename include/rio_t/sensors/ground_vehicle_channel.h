#pragma once

#include <Eigen/Core>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/factors/ground_vehicle_factor.h"
#include "rio_t/imu/buffer.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {

/// The motions that the platform is capable of.
enum class Platform {
  kFree,           ///< "free": anything
  kGroundVehicle,  ///< "ground_vehicle": it moves neither sideways nor up
};

struct GroundVehicleOptions {
  /// The vehicle frame V (x forward, y left, z up) in the IMU frame: `q_IR` turns V into I, and `l_I` is the
  /// point that moves only forward, e.g. the centre of the rear axle.
  Extrinsics T_IV;
  double rotation_sigma = 0.02;  ///< [rad] prior on the rotation, about each axis: one degree
  /// [rad] of the ground where the vehicle starts at rest, along and across: a floor. 0: not known
  double start_slope_sigma = 0.002;
  double rotation_noise = 1.0e-5;  ///< [rad/sqrt(s)] its random walk, about each axis
  double sideways_sigma = 0.05;    ///< [m/s] of the velocity of the point
  double vertical_sigma = 0.03;    ///< [m/s] likewise
  double gate = 4.0;               ///< [sigma] a velocity farther from the constraint gets no term
};

/// The channel's answer at one time.
struct GroundVehicleAnswer {
  Time time;
  /// Velocity of the point in V, as predicted without the constraint at this time [m/s].
  Eigen::Vector3d v_V = Eigen::Vector3d::Zero();
  double squared_sigmas = 0.0;  ///< of the sideways and vertical part, 2 degrees of freedom
  bool used = false;
  Eigen::Quaterniond q_IV = Eigen::Quaterniond::Identity();
  Eigen::Vector3d q_IV_sigma = Eigen::Vector3d::Zero();  ///< [rad] about the axes of I
  /// Share of the last 5 s of motion that contradicts the constraint; none before 5 s of motion.
  std::optional<double> contradiction;
  bool is_contradicted = false;  ///< the motion is not that of such a vehicle: the constraint is off
};

/// A vehicle on wheels, as a sensor that always reads "no velocity sideways, none upwards"
/// (docs/method.md, section 5.9). Not thread-safe.
class GroundVehicleChannel {
 public:
  /// `imu` must outlive the channel.
  GroundVehicleChannel(const GroundVehicleOptions& options, double huber_threshold, const ImuBuffer& imu);

  /// Joins a window that begins with one node: adds the vehicle frame as configured, with its prior;
  /// `at_rest`: the vehicle stands on the ground there.
  void join(FixedLagSmoother& smoother, bool at_rest);
  /// Compares the estimate at `time` with the constraint. Call it before the terms of that time are added.
  /// None if the constraint is off, or was judged less than a tenth of a second ago.
  std::optional<GroundVehicleAnswer> judge(const FixedLagSmoother& smoother, Time time);
  /// Adds the term if `judge` found that it agrees. Returns whether it did.
  bool add(const GroundVehicleAnswer& answer, FixedLagSmoother& smoother) const;
  std::vector<FixedLagSmoother::RandomWalk> randomWalks() const;

 private:
  struct Judged {
    Time time;
    double span = 0.0;           ///< [s] of motion that it stands for
    double contradiction = 0.0;  ///< 0..1
  };
  std::optional<double> contradictionWith(const Judged& judged);
  Eigen::Vector3d omegaAt(Time time) const;

  GroundVehicleOptions options_;  // read-only after construction, as the next three
  std::shared_ptr<ceres::LossFunction> loss_;
  const ImuBuffer* imu_;
  std::shared_ptr<const Manifold> manifold_;
  std::shared_ptr<Block> frame_;
  std::optional<Time> judged_at_;
  std::deque<Judged> judged_;
  double judged_span_ = 0.0;  ///< [s] of judged_
  bool is_contradicted_ = false;
};

}  // namespace rio_t
