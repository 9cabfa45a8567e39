#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "rio_t/core/so3.h"
#include "rio_t/imu/static_initializer.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"

namespace rio_t {

/// The whole pipeline on simulated sensors, in one thread; scans come 60 ms late, as they do in life.
struct SimulatedRun {
  SimulatedRun(const std::string& name, std::uint64_t seed, double duration, double static_start = 12.0)
      : motion(makeMotion(name, seed, duration, static_start)) {
    setup.seed = seed;
    options.radar.T_IR = setup.T_IR;
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

  /// A scan, and the index of its radar: several ones are in the order of their names.
  struct Arrival {
    const simulation::SimulatedScan* scan;
    std::size_t radar;
  };
  static std::vector<Arrival> inOrderOfArrival(const simulation::SensorData& data) {
    std::vector<Arrival> result;
    for (const simulation::SimulatedScan& each : data.scans) result.push_back({&each, 0});
    std::size_t radar = 0;
    for (const auto& [name, scans] : data.radars) {
      for (const simulation::SimulatedScan& each : scans) result.push_back({&each, radar});
      ++radar;
    }
    std::stable_sort(result.begin(), result.end(),
                     [](const Arrival& a, const Arrival& b) { return a.scan->arrival < b.scan->arrival; });
    return result;
  }

  double seconds(Time time) const { return time - setup.start; }

  /// Simulates, lets `spoil` change the data, and runs. Call once.
  void run(const std::function<void(simulation::SensorData&)>& spoil = nullptr) {
    simulation::SensorData data = simulation::simulate(motion, setup);
    if (spoil) spoil(data);
    odometry.emplace(options);
    const std::vector<Arrival> arrivals = inOrderOfArrival(data);
    auto next = arrivals.begin();
    auto pressure = data.pressures.begin();
    std::size_t count = 0;
    for (const ImuMeasurement& sample : data.imu.samples) {
      const Navigation::Checked checked = odometry->addImu(sample);
      taken.insert(taken.end(), checked.taken.begin(), checked.taken.end());
      if (checked.state) states.push_back(*checked.state);
      for (; pressure != data.pressures.end() && pressure->stamp <= sample.time; ++pressure)
        odometry->addPressure({pressure->stamp, pressure->pascal});
      for (; next != arrivals.end() && next->scan->arrival <= sample.time; ++next) {
        if (!next->scan->delivered) continue;
        RadarScan arrived = scan(*next->scan);
        arrived.radar = next->radar;
        odometry->addScan(std::move(arrived));
      }
      if (++count % samples_per_process != 0) continue;
      for (ScanResult& result : odometry->process()) results.push_back(std::move(result));
    }
  }

  simulation::MotionState truth(const NavigationState& state) const {
    return motion.at(std::clamp(seconds(state.time), 0.0, motion.duration()));
  }
  /// Error of the velocity in I [m/s]. The heading, which nobody observes, has no part in it.
  double velocityError(const NavigationState& state) const {
    const simulation::MotionState true_state = truth(state);
    return (true_state.q_WI.conjugate() * true_state.v_W - state.q_WI.conjugate() * state.v_W).norm();
  }
  /// Error of roll and pitch together [rad].
  double tiltError(const NavigationState& state) const {
    const Eigen::Vector3d a = truth(state).q_WI.conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d b = state.q_WI.conjugate() * Eigen::Vector3d::UnitZ();
    return std::atan2(a.cross(b).norm(), a.dot(b));
  }
  /// Turns the truth into W if the motion begins at rest: the heading of the start is that of W.
  Eigen::Quaterniond turnIntoW() const {
    const Eigen::Quaterniond q_IW = motion.at(0.0).q_WI.conjugate();
    const Eigen::Vector3d ahead =
        levelingRotation(q_IW * Eigen::Vector3d::UnitZ()) * (q_IW * Eigen::Vector3d::UnitX());
    return so3::exp({0.0, 0.0, std::atan2(ahead.y(), ahead.x())});
  }
  /// Error of the way from the start, at rest, in W [m].
  Eigen::Vector3d wayError(const NavigationState& state) const {
    return state.p_W - turnIntoW() * (truth(state).p_W - motion.at(0.0).p_W);
  }
  /// Of p_W [m].
  double positionError(const NavigationState& state) const { return (truth(state).p_W - state.p_W).norm(); }
  /// The last result of a radar that updated the window.
  const ScanResult& last(std::size_t radar) const {
    return *std::find_if(results.rbegin(), results.rend(), [&](const ScanResult& result) {
      return result.updated && result.scan.radar == radar;
    });
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
  std::size_t samples_per_process = 1;  ///< IMU samples between two calls of process()
  OdometryOptions options;
  std::optional<RadarInertialOdometry> odometry;
  std::vector<ImuMeasurement> taken;    ///< samples of the IMU, with bridges
  std::vector<NavigationState> states;  ///< causal, one for each sample
  std::vector<ScanResult> results;
};

}  // namespace rio_t
