#include "rio_t/smoother/carried.h"

#include "rio_t/factors/imu_factor.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

StateBlock carried(const StateBlock& x, Time from, Time to, const ImuBuffer& imu,
                   const Eigen::Vector3d& g_W) {
  Preintegration pre;
  pre.b_g = x.b_g();
  pre.b_a = x.b_a();
  imu.forEachInterval(from, to, [&](double dt, const Eigen::Vector3d& gyro, const Eigen::Vector3d& accel) {
    pre.delta.step(dt, gyro - pre.b_g, accel - pre.b_a);
  });
  return predict(x, pre, g_W);
}

}  // namespace rio_t
