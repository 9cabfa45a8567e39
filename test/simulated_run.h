#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"

namespace rio_t {

/// The whole pipeline on simulated sensors, in one thread; scans come 60 ms late, as they do in life.
struct SimulatedRun {
  SimulatedRun(const std::string& name, std::uint64_t seed, double duration, double static_start = 12.0)
      : motion(makeMotion(name, seed, duration, static_start)) {
    setup.seed = seed;
    options.T_IR = setup.T_IR;
  }

  static simulation::Motion makeMotion(const std::string& name, std::uint64_t seed, double duration,
                                       double static_start) {
    simulation::MotionRequest request;
    request.name = name;
    request.seed = seed;
    request.duration = duration;
    request.rest.static_start = static_start;
    request.rest.static_end = 0.0;
    return simulation::makeMotion(request);
  }

  static RadarScan scan(const simulation::SimulatedScan& from) {
    RadarScan result;
    result.stamp = from.stamp;
    for (const simulation::SimulatedPoint& point : from.points)
      result.points.push_back({point.position_R, point.doppler, point.snr_db});
    return result;
  }

  double seconds(Time time) const { return time - setup.start; }

  /// Simulates, lets `spoil` change the data, and runs. Call once.
  void run(const std::function<void(simulation::SensorData&)>& spoil = nullptr) {
    simulation::SensorData data = simulation::simulate(motion, setup);
    if (spoil) spoil(data);
    odometry.emplace(options);
    auto next = data.scans.begin();
    for (const ImuMeasurement& sample : data.imu.samples) {
      if (const auto state = odometry->addImu(sample)) states.push_back(*state);
      for (; next != data.scans.end() && next->arrival <= sample.time; ++next) {
        if (next->delivered) odometry->addScan(scan(*next));
      }
      for (ScanResult& result : odometry->process()) results.push_back(std::move(result));
    }
  }

  simulation::MotionState truth(const NavigationState& state) const {
    return motion.at(std::clamp(seconds(state.time), 0.0, motion.duration()));
  }
  /// Of the velocity in I [m/s]: free of the heading, which nobody observes.
  double velocityError(const NavigationState& state) const {
    const simulation::MotionState true_state = truth(state);
    return (true_state.q_WI.conjugate() * true_state.v_W - state.q_WI.conjugate() * state.v_W).norm();
  }
  /// Of roll and pitch together [rad].
  double tiltError(const NavigationState& state) const {
    const Eigen::Vector3d a = truth(state).q_WI.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d b = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }
  /// Root mean square of `error` over the states from `from` to `to` seconds.
  template <typename Error>
  double rms(double from, double to, Error&& error) const {
    double sum = 0.0;
    std::size_t count = 0;
    for (const NavigationState& state : states) {
      if (seconds(state.time) < from || seconds(state.time) > to) continue;
      const double e = error(state);
      sum += e * e;
      ++count;
    }
    return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : std::nan("");
  }

  simulation::Motion motion;
  simulation::SimulationOptions setup;
  OdometryOptions options;
  std::optional<RadarInertialOdometry> odometry;
  std::vector<NavigationState> states;  ///< causal, one for each sample
  std::vector<ScanResult> results;
};

}  // namespace rio_t
