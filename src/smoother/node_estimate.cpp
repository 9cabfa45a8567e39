#include "rio_t/smoother/node_estimate.h"

#include <algorithm>
#include <cmath>

#include "rio_t/factors/radar_motion.h"
#include "rio_t/imu/turning_axes.h"

namespace rio_t {
std::size_t nearestNode(const std::vector<NodeEstimate>& nodes, Time time) {
  const auto after = std::lower_bound(nodes.begin(), nodes.end(), time,
                                      [](const NodeEstimate& node, Time t) { return node.time < t; });
  const auto k = static_cast<std::size_t>(after - nodes.begin());
  if (k == 0) return k;
  return after == nodes.end() || time - nodes[k - 1].time < after->time - time ? k - 1 : k;
}

SlowMotion slowMotion(const std::vector<NodeEstimate>& nodes, std::size_t k, double half_width,
                      const ImuBuffer& imu, const Extrinsics& T_IR, const Extrinsics& linear_from) {
  const Time time = nodes[k].time;
  double weights = 0.0;
  Eigen::Vector3d v_I = Eigen::Vector3d::Zero();
  const auto add = [&](const NodeEstimate& node) {
    const double weight = 1.0 - std::abs(node.time - time) / half_width;
    if (weight <= 0.0) return false;
    v_I += weight * (node.x.q_WI().conjugate() * node.x.v_W());
    weights += weight;
    return true;
  };
  for (std::size_t i = k; i < nodes.size() && add(nodes[i]);) ++i;
  for (std::size_t i = k; i-- > 0 && add(nodes[i]);) continue;
  SlowMotion slow;
  slow.T_IR = linear_from;
  // The IMU reaches at least kOffsetHalfWidth past the newest node. With later samples, the result would
  // depend on the order of the messages.
  const double reached = nodes.back().time + kOffsetHalfWidth - time;
  const ImuMean mean = imu.mean(time, std::min(half_width, reached));
  slow.omega_I = mean.angular_velocity - nodes[k].x.b_g();
  if (mean.duration > 0.0) slow.omega_variance = mean.gyro_variance / mean.duration;
  slow.v_R = T_IR.R_RI() * (v_I / weights + slow.omega_I.cross(T_IR.l_I));
  return slow;
}

void keepTurns(const std::vector<SlowMotion*>& motions) {
  TurningAxes axes;
  for (const SlowMotion* motion : motions) axes.add(motion->omega_I, motion->omega_variance);
  const Eigen::Matrix3d turning = axes.projection();
  for (SlowMotion* motion : motions) motion->omega_I = turning * motion->omega_I;
}

}  // namespace rio_t
