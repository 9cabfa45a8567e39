#pragma once

#include <optional>
#include <vector>

#include "rio_t/sensors/radar_in_window.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "synthetic_motion.h"

namespace rio_t {

/// A fixed-lag smoother with one radar, without the decisions of a channel.
struct RadarSmoother {
  RadarSmoother(const SmootherOptions& options, const CalibrationPrior& configured,
                const Eigen::Vector3d& g_W, const ImuBuffer& imu)
      : walk(options.time_offset_noise),
        states(options, ImuNoise(), g_W, imu),
        offset(std::make_shared<OffsetBlocks>(options, configured)),
        radar(options, configured, g_W, imu, offset) {}

  void initialize(Time time, const NodePrior& prior) { radar.start(states, time, prior); }
  bool add(const RadarVelocityMeasurement& z) { return radar.add(states, z); }
  void addRest(Time stamp, double sigma) {
    states.addZeroVelocity(*states.nodeAt(radar.nodeTime(stamp)), sigma);
  }
  const Solution& optimize() { return states.optimize(); }
  std::vector<NodeEstimate> marginalize() {
    return states.marginalize({{&offset->newest(), Eigen::VectorXd::Constant(1, walk)}});
  }
  std::optional<RadarVelocityPrediction> predict(Time stamp) const { return radar.predict(states, stamp); }
  /// The offset stepped before the scan stamped `stamp`, which is the newest.
  void stepOffset(Time stamp) { radar.stepOffset(states, {stamp}, radar.nodeTime(stamp)); }

  std::size_t size() const { return states.size(); }
  NodeEstimate node(std::size_t k) const { return states.node(k); }
  NodeEstimate newest() const { return states.newest(); }
  double t_O() const { return radar.offset(); }
  /// Of state and t_O.
  Eigen::MatrixXd newestCovariance() const { return states.newestCovariance({&offset->newest()}); }

  double walk;
  FixedLagSmoother states;
  std::shared_ptr<OffsetBlocks> offset;
  RadarInWindow radar;
};

/// A mounting that hides no sign and no axis.
inline Extrinsics skewMounting() {
  return {{0.03, -0.1, 0.05}, Eigen::Quaterniond(so3::exp({0.3, -1.2, 2.0}).conjugate())};
}

/// What a radar with skewMounting() measures at `stamp` [s], with `t_O` [s].
inline RadarVelocityMeasurement radarMeasurement(const SyntheticMotion& motion, double stamp, double t_O) {
  RadarVelocityMeasurement z;
  z.stamp = motion.time(stamp);
  z.v_R = motion.radarVelocity(stamp - t_O, skewMounting().R_RI(), skewMounting().l_I);
  z.covariance = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
  return z;
}

}  // namespace rio_t
