// The parts of the pipeline one by one, on a simulated hand-held run (409 Hz IMU, 10 Hz radar, 45 points).
#include <benchmark/benchmark.h>

#include <chrono>
#include <numeric>
#include <vector>

#include "rio_t/imu/preintegration.h"
#include "rio_t/odometry/imu_propagator.h"
#include "rio_t/odometry/options.h"
#include "rio_t/ros/cloud/point_cloud.h"
#include "rio_t/sensors/radar_in_window.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/simulation.h"
#include "rio_t/smoother/fixed_lag_smoother.h"
#include "rio_t/smoother/node_prior.h"

namespace {

using namespace rio_t;

constexpr double kStart = 12.0;   // [s] the motion begins
constexpr double kLength = 30.0;  // [s] of motion
const Eigen::Vector3d kGravity(0.0, 0.0, -9.81);

/// The step of the simulated radar is known.
EgoVelocityOptions egoVelocityOptions() {
  EgoVelocityOptions o;
  o.doppler_quantization = 0.125;
  return o;
}

/// One run, what is known of it, and its ego-velocities.
struct Run {
  Run() : motion(simulation::makeMotion({"difficult", 3, 0.0, {}})) {
    options.radar.points_mean = 45.0;
    data = simulation::simulate(motion, options);
    for (const ImuMeasurement& sample : data.imu.samples) imu.add(sample);
    const EgoVelocityEstimator estimator(egoVelocityOptions());
    for (const simulation::SimulatedScan& simulated : data.scans) {
      const double t = simulated.stamp - options.start;
      if (t < kStart || t > kStart + kLength) continue;
      RadarScan scan;
      scan.stamp = simulated.stamp;
      for (const simulation::SimulatedPoint& point : simulated.points)
        scan.points.push_back({point.position_R, point.doppler, point.snr_db});
      const EgoVelocity measured = estimator.estimate(scan);
      if (isValid(measured.status)) {
        velocities.push_back({{scan.stamp}, measured.v_R, measured.covariance});
      }
      scans.push_back(std::move(scan));
    }
  }

  StateBlock state(double t) const {
    const simulation::MotionState truth = motion.at(t);
    StateBlock x;
    x.q_WI() = truth.q_WI;
    x.p_W() = truth.p_W;
    x.v_W() = truth.v_W;
    return x;
  }

  simulation::Motion motion;
  simulation::SimulationOptions options;
  simulation::SensorData data;
  ImuBuffer imu;
  std::vector<RadarScan> scans;
  std::vector<RadarVelocityMeasurement> velocities;
};

const Run& run() {
  static const Run instance;
  return instance;
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void decodeCloud(benchmark::State& state) {
  const RadarScan& scan = run().scans[100];
  std::vector<std::size_t> all(scan.points.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const sensor_msgs::PointCloud2 message = toPointCloud2(scan, all);
  PointCloudFormat format;
  format.doppler = "doppler";
  for (auto _ : state) benchmark::DoNotOptimize(toRadarScan(decode(message, format).cloud, Time()));
}
BENCHMARK(decodeCloud);

void egoVelocity(benchmark::State& state) {
  // Every scan of the run in turn: RANSAC takes more or fewer draws from one to the next.
  const EgoVelocityEstimator estimator(egoVelocityOptions());
  std::size_t k = 0, points = 0;
  for (auto _ : state) {
    const RadarScan& scan = run().scans[k++ % run().scans.size()];
    points += scan.points.size();
    benchmark::DoNotOptimize(estimator.estimate(scan));
  }
  state.counters["points"] =
      benchmark::Counter(static_cast<double>(points), benchmark::Counter::kAvgIterations);
}
BENCHMARK(egoVelocity);

void preintegration(benchmark::State& state) {
  const Time from = run().options.start + 20.0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(preintegrate(run().imu, from, from + 0.1, Eigen::Vector3d::Zero(),
                                          Eigen::Vector3d::Zero(), ImuNoise()));
  }
}
BENCHMARK(preintegration);

enum class Timed { kAdd, kSolve, kMarginalise, kPrediction };

/// The smoother scan by scan along the run; one iteration is one scan, and only the part named is timed.
void smoother(benchmark::State& state, Timed timed, double window) {
  SmootherOptions options;
  options.window = window;
  FixedLagSmoother smoother(options, ImuNoise(), kGravity, run().imu);
  const CalibrationPrior configured{run().options.T_IR};
  const auto offset = std::make_shared<OffsetBlocks>(options, configured);
  RadarInWindow radar(options, configured, kGravity, run().imu, offset);
  const auto marginalize = [&] {
    return smoother.marginalize(
        {{&offset->newest(), Eigen::VectorXd::Constant(1, options.time_offset_noise)}});
  };
  std::size_t next = run().velocities.size();
  const auto part = [&](Timed which, auto&& call) {
    const auto begin = std::chrono::steady_clock::now();
    call();
    if (which == timed) state.SetIterationTime(secondsSince(begin));
  };
  for (auto _ : state) {
    if (next >= run().velocities.size()) {
      const StateBlock x = run().state(kStart - 0.5);
      radar.start(smoother, run().options.start + (kStart - 0.5),
                  priorAtRest(options, ImuNoise(), x, 9.81, 3.0, configured));
      // Not timed: the window fills.
      for (next = 0; next < 30; ++next) {
        radar.add(smoother, run().velocities[next]);
        smoother.optimize();
        marginalize();
      }
    }
    const RadarVelocityMeasurement& z = run().velocities[next++];
    part(Timed::kPrediction, [&] { benchmark::DoNotOptimize(radar.predict(smoother, z.stamp)); });
    part(Timed::kAdd, [&] { radar.add(smoother, z); });
    part(Timed::kSolve, [&] { smoother.optimize(); });
    part(Timed::kMarginalise, [&] { benchmark::DoNotOptimize(marginalize()); });
  }
}
BENCHMARK_CAPTURE(smoother, prediction, Timed::kPrediction, 1.0)->UseManualTime()->Iterations(2000);
BENCHMARK_CAPTURE(smoother, add, Timed::kAdd, 1.0)->UseManualTime()->Iterations(2000);
BENCHMARK_CAPTURE(smoother, windowSolve, Timed::kSolve, 1.0)->UseManualTime()->Iterations(2000);
BENCHMARK_CAPTURE(smoother, windowSolve_5s, Timed::kSolve, 5.0)->UseManualTime()->Iterations(500);
BENCHMARK_CAPTURE(smoother, marginalisation, Timed::kMarginalise, 1.0)->UseManualTime()->Iterations(2000);

void navigationStep(benchmark::State& state) {
  const std::vector<ImuMeasurement>& samples = run().data.imu.samples;
  ImuPropagator propagator(ImuNoise(), kGravity);
  NavigationState start;
  start.time = samples.front().time;
  propagator.anchor(start);
  std::size_t k = 1;
  for (auto _ : state) {
    propagator.add(samples[k]);
    benchmark::DoNotOptimize(propagator.state());
    if (++k == samples.size()) {
      propagator = ImuPropagator(ImuNoise(), kGravity);
      propagator.anchor(start);
      k = 1;
    }
  }
}
BENCHMARK(navigationStep);

void navigationAnchor(benchmark::State& state) {
  // As live: the newest node lies 0.16 s back (0.06 s of latency and a period).
  const std::vector<ImuMeasurement>& samples = run().data.imu.samples;
  ImuPropagator propagator(ImuNoise(), kGravity);
  for (std::size_t k = 0; k < 3000; ++k) propagator.add(samples[k]);
  NavigationState anchor;
  anchor.time = samples[2999].time - 0.16;
  for (auto _ : state) propagator.anchor(anchor);
}
BENCHMARK(navigationAnchor);

}  // namespace

BENCHMARK_MAIN();  // Ubuntu 20.04: libbenchmark_main.so hides its main
