// The fuzzer chooses the options of the odometry. Then it feeds IMU samples, scans and pressures in any
// order, with any finite values and stamps. See scripts/fuzz.sh.
#include <fuzzer/FuzzedDataProvider.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "rio_t/odometry/radar_inertial_odometry.h"

namespace {

using Eigen::Vector3d;
using rio_t::Time;

constexpr double kGravity = 9.81;
constexpr double kImuPeriod = 0.01;     // [s]
constexpr double kLongest = 20.0;       // [s] of IMU; more takes too long
constexpr double kLongestTime = 4.0e9;  // [s] stamps of ROS span 2^32 seconds

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", what);
  std::abort();
}

rio_t::OdometryOptions anyOptions(FuzzedDataProvider& input) {
  rio_t::OdometryOptions options;
  options.initialization.duration = 0.5;
  options.init_motion_after = 1.0;
  options.init_mode =
      input.PickValueInArray({rio_t::InitMode::kAuto, rio_t::InitMode::kStatic, rio_t::InitMode::kMotion});
  rio_t::SmootherOptions& smoother = options.smoother;
  smoother.radar_factor = input.ConsumeBool() ? rio_t::RadarFactor::kDoppler : rio_t::RadarFactor::kVelocity;
  smoother.estimate_extrinsics =
      input.PickValueInArray({rio_t::EstimateExtrinsics::kNone, rio_t::EstimateExtrinsics::kRotation,
                              rio_t::EstimateExtrinsics::kPose});
  smoother.estimate_time_offset = input.ConsumeBool();
  smoother.time_offset_shared = input.ConsumeBool();
  smoother.time_offset_model =
      input.ConsumeBool() ? rio_t::TimeOffsetModel::kImu : rio_t::TimeOffsetModel::kConstantAcceleration;
  smoother.solver = input.ConsumeBool() ? rio_t::WindowSolver::kChain : rio_t::WindowSolver::kCeres;
  if (smoother.time_offset_model == rio_t::TimeOffsetModel::kConstantAcceleration) {  // it takes no other
    smoother.radar_factor = rio_t::RadarFactor::kVelocity;
    smoother.estimate_extrinsics = rio_t::EstimateExtrinsics::kNone;
  }
  options.platform = input.ConsumeBool() ? rio_t::Platform::kFree : rio_t::Platform::kGroundVehicle;
  options.use_barometer = input.ConsumeBool();
  options.landmarks.enabled = input.ConsumeBool();
  if (input.ConsumeBool()) options.radars.resize(2);
  return options;
}

/// Mostly small; at times anything.
double number(FuzzedDataProvider& input, double most) {
  if (input.ConsumeIntegral<std::uint8_t>() != 0) return input.ConsumeFloatingPointInRange(-most, most);
  const double any = input.ConsumeFloatingPoint<float>();
  return std::isfinite(any) ? any : 0.0;
}

/// [s] A stamp is off by so much: mostly a little, at times by as much as stamps of ROS can be.
double shift(FuzzedDataProvider& input, double most) {
  return std::clamp(number(input, most), -kLongestTime, kLongestTime);
}

Vector3d vector(FuzzedDataProvider& input, double most) {
  const double x = number(input, most), y = number(input, most);
  return {x, y, number(input, most)};
}

/// The sensors, and the world that they see.
struct Rig {
  Time now = Time::fromSeconds(1000.0);
  Vector3d acceleration = Vector3d::Zero();  // [m/s^2] besides gravity
  Vector3d turn = Vector3d::Zero();          // [rad/s]
  Vector3d v_R = Vector3d::Zero();           // [m/s] that the radars see

  rio_t::ImuMeasurement imu(FuzzedDataProvider& input) {
    rio_t::ImuMeasurement sample;
    const auto choice = input.ConsumeIntegral<std::uint16_t>();
    now = now + (choice == 1 ? shift(input, 5.0) : kImuPeriod);
    sample.time = now;
    const double noise = 1e-4 * (choice % 256);
    sample.angular_velocity = turn + Vector3d(noise, -noise, 0.5 * noise);
    sample.acceleration = acceleration + Vector3d(noise, noise, kGravity - noise);
    return sample;
  }

  rio_t::RadarScan scan(FuzzedDataProvider& input, std::size_t radars) {
    rio_t::RadarScan scan;
    scan.radar = input.ConsumeIntegralInRange<std::size_t>(0, radars - 1);
    scan.stamp = now + shift(input, 0.3);
    const auto points = input.ConsumeIntegralInRange<std::size_t>(0, 24);
    for (std::size_t i = 0; i < points; ++i) {
      rio_t::RadarPoint point;
      point.position_R = vector(input, 10.0);
      point.snr_db = 20.0;
      const bool is_static = input.ConsumeIntegral<std::uint8_t>() < 230 && point.position_R.norm() > 0.0;
      point.doppler = is_static ? -point.position_R.normalized().dot(v_R) : number(input, 5.0);
      if (point.position_R.allFinite() && std::isfinite(point.doppler)) scan.points.push_back(point);
    }
    return scan;
  }
};

void requireSound(const rio_t::NavigationState& state) {
  require(state.q_WI.coeffs().allFinite() && state.p_W.allFinite() && state.v_W.allFinite() &&
              state.b_g.allFinite() && state.b_a.allFinite() && state.covariance.allFinite(),
          "states are finite");
  require(state.covariance.diagonal().minCoeff() >= 0.0, "no variance is negative");
}

void requireSound(const std::vector<rio_t::ScanResult>& results) {
  for (const rio_t::ScanResult& result : results) {
    require(!result.used || result.updated, "a scan that was used updates the window");
    if (!result.updated) continue;
    requireSound(result.state);
    require(std::isfinite(result.time_offset) && result.time_offset_sigma >= 0.0 &&
                std::isfinite(result.time_offset_sigma),
            "the offset and its sigma are finite");
    require(result.T_IR.l_I.allFinite() && result.T_IR.q_IR.coeffs().allFinite() &&
                result.T_IR_covariance.allFinite(),
            "the mounting and its covariance are finite");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzedDataProvider input(data, size);
  const rio_t::OdometryOptions options = anyOptions(input);
  rio_t::RadarInertialOdometry odometry(options);
  Rig rig;
  std::size_t scans = 0, results = 0;
  const auto process = [&](const std::vector<rio_t::ScanResult>& finished) {
    requireSound(finished);
    results += finished.size();
  };
  double fed = 0.0;  // [s] of IMU
  const auto feedImu = [&](std::size_t samples) {
    for (; samples > 0; --samples) {
      const rio_t::Navigation::Checked checked = odometry.addImu(rig.imu(input));
      if (checked.state) requireSound(*checked.state);
      process(odometry.process());
      fed += kImuPeriod;
    }
  };
  feedImu(100);
  while (input.remaining_bytes() > 0 && fed < kLongest) {
    switch (input.ConsumeIntegralInRange(0, 5)) {
      case 0:
        rig.turn = vector(input, 2.0);
        rig.acceleration = vector(input, 5.0);
        break;
      case 1:
        rig.turn = rig.acceleration = rig.v_R = Vector3d::Zero();
        break;
      case 2:
        rig.v_R = vector(input, 3.0);
        break;
      case 3:
        odometry.addPressure({rig.now + shift(input, 0.1), 1e5 + number(input, 100.0)});
        break;
      case 4:
        odometry.addScan(rig.scan(input, options.radarCount()));
        ++scans;
        break;
      default:
        feedImu(input.ConsumeIntegralInRange<std::size_t>(1, 20));
    }
    process(odometry.process());
  }
  const std::vector<rio_t::ScanResult> last = odometry.finish();
  requireSound(last);
  results += last.size();
  require(results >= scans, "each scan has a result");
  return 0;
}
