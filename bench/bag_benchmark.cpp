// Plays a bag as rio_t_bag does and prints, as JSON, what each stage costs. bench.py calls it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "count_allocations.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/ros/parameters/parameters.h"
#include "stage_clock.h"

namespace {

using rio_t::bench::Stage;
using rio_t::bench::StageClock;
using rio_t::bench::StageCost;

/// Share `share` of the values are not above it.
double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return 0.0;
  const double rank = std::ceil(share * static_cast<double>(sorted.size())) - 1.0;
  return sorted[static_cast<std::size_t>(std::max(0.0, rank))];
}

void run(const std::string& bag, const std::string& config, const std::string& output_folder,
         const std::vector<std::string>& assignments) {
  rio_t::ParameterEntries entries = rio_t::readParameterFile(rio_t::findConfigFile(config));
  for (const std::string& assignment : assignments) entries.push_back(rio_t::parseAssignment(assignment));
  const std::uint64_t allocations_before = rio_t::bench::allocations();
  const rio_t::RunSummary summary =
      rio_t::runBag({{bag}, output_folder, rio_t::makeConfig(entries), nullptr});
  const std::uint64_t allocations = rio_t::bench::allocations() - allocations_before;

  StageCost rest;
  rest.seconds = summary.estimation_seconds;
  rest.allocations = allocations;
  std::uint64_t in_estimator = 0;
  std::string stages;
  const auto describe = [&](Stage stage, const StageCost& cost) {
    char line[200];
    std::snprintf(line, sizeof(line), R"(    "%s": {"seconds": %.6f, "calls": %llu, "allocations": %llu})",
                  name(stage), cost.seconds, static_cast<unsigned long long>(cost.calls),
                  static_cast<unsigned long long>(cost.allocations));
    stages += (stages.empty() ? "" : ",\n") + std::string(line);
  };
  for (int k = 1; k < static_cast<int>(Stage::kCount); ++k) {
    const Stage stage = static_cast<Stage>(k);
    const StageCost& cost = StageClock::instance().cost(stage);
    rest.seconds -= cost.seconds;
    rest.allocations -= cost.allocations;
    if (stage != Stage::kDecode && stage != Stage::kOutput) in_estimator += cost.allocations;
    describe(stage, cost);
  }
  describe(Stage::kRest, rest);

  std::vector<double> solves = StageClock::instance().solves();
  std::sort(solves.begin(), solves.end());
  const double scans = static_cast<double>(std::max<std::uint64_t>(1, summary.scansTotal()));
  std::printf("{\n  \"scans\": %llu,\n  \"imu_samples\": %llu,\n  \"data_seconds\": %.6f,\n",
              static_cast<unsigned long long>(summary.scansTotal()),
              static_cast<unsigned long long>(summary.imu_count),
              summary.realtime_factor * summary.estimation_seconds);
  std::printf("  \"estimation_seconds\": %.6f,\n  \"stages\": {\n%s\n  },\n", summary.estimation_seconds,
              stages.c_str());
  std::printf(
      "  \"solve_ms\": {\"count\": %zu, \"p50\": %.6f, \"p99\": %.6f, \"max\": %.6f},\n"
      "  \"allocations_per_scan\": {\"estimator\": %.3f, \"whole_program\": %.3f}\n}\n",
      solves.size(), 1e3 * quantile(solves, 0.5), 1e3 * quantile(solves, 0.99),
      solves.empty() ? 0.0 : 1e3 * solves.back(), static_cast<double>(in_estimator) / scans,
      static_cast<double>(allocations) / scans);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: bag_benchmark BAG CONFIG OUTPUT_FOLDER [key=value]...\n");
    return 1;
  }
  try {
    run(argv[1], argv[2], argv[3], std::vector<std::string>(argv + 4, argv + argc));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bag_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}
