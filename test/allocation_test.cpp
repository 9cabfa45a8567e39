// The pipeline in its steady state: nothing from the heap for a sample or a scan.
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "count_allocations.h"
#include "simulated_run.h"

namespace rio_t {
namespace {

constexpr double kEnd = 100.0;    // [s]
constexpr double kSteady = 70.0;  // [s] all buffers have grown: the longest keeps 30 s of IMU

struct Steps {
  std::uint64_t samples = 0, scans = 0;
  std::uint64_t allocating = 0;  ///< samples or scans that allocated
};

/// What the samples and scans after kSteady did. What scans bring with them is made before.
Steps steadySteps(SimulatedRun& run) {
  const simulation::SensorData data = simulation::simulate(run.motion, run.setup);
  RadarInertialOdometry odometry(run.options);
  Steps steps;
  bool is_steady = false;
  const auto handle = [&](const ScanResult& result) {
    if (is_steady && result.used) ++steps.scans;
  };
  auto next = data.scans.begin();
  for (const ImuMeasurement& sample : data.imu.samples) {
    is_steady = run.seconds(sample.time) > kSteady;
    std::optional<RadarScan> scan;
    if (next != data.scans.end() && next->arrival <= sample.time) {
      if (next->delivered) scan = SimulatedRun::scan(*next);
      ++next;
    }
    const std::uint64_t before = bench::allocations();
    odometry.addImu(sample);
    if (scan) odometry.addScan(std::move(*scan));
    odometry.process(handle);
    if (!is_steady) continue;
    ++steps.samples;
    if (bench::allocations() != before) ++steps.allocating;
  }
  return steps;
}

TEST(Allocations, AreCounted) {
  const std::uint64_t before = bench::allocations();
  const std::vector<int> list(100);
  EXPECT_GT(bench::allocations(), before);
  EXPECT_EQ(list.size(), 100U);
}

TEST(Allocations, NoneForASampleOrAScanInTheSteadyState) {
  for (const TimeOffsetModel model : {TimeOffsetModel::kImu, TimeOffsetModel::kConstantAcceleration}) {
    SimulatedRun run("difficult", 1, kEnd);
    run.options.smoother.time_offset_model = model;
    const Steps steps = steadySteps(run);
    EXPECT_GT(steps.samples, 10000U);
    EXPECT_GT(steps.scans, 250U);
    EXPECT_EQ(steps.allocating, 0U);
  }
}

}  // namespace
}  // namespace rio_t
