#include "rio_t/ros/bag/calibration.h"

#include <exception>
#include <filesystem>
#include <set>
#include <utility>

#include "../command_line.h"
#include "rio_t/factors/extrinsics_manifold.h"
#include "rio_t/ros/bag/bag_runner.h"
#include "rio_t/smoother/node_prior.h"

namespace rio_t {
namespace {

Config batchConfig(const Config& config) {
  Config batch = config;
  batch.mode = RunMode::kBatch;
  // Here none, the default, means pose, with or without a lever arm and on any platform.
  if (config.estimate_extrinsics != EstimateExtrinsics::kNone) return batch;
  const auto estimate = [&](SmootherOptions& smoother) {
    smoother.estimate_extrinsics = EstimateExtrinsics::kPose;
    smoother.extrinsics_rotation_sigma = config.extrinsics_rotation_sigma;
  };
  estimate(batch.odometry.smoother);
  for (Config& radar : batch.radars) estimate(radar.odometry.smoother);
  return batch;
}

/// Names a folder after each bag: FOLDER/run, FOLDER/run_2.
std::vector<std::string> foldersOf(const CalibrationRun& run) {
  std::vector<std::string> folders;
  std::set<std::string> taken;
  for (const std::string& bag : run.bags) {
    const std::string stem = std::filesystem::path(bag).stem().string();
    std::string name = stem;
    for (int k = 2; !taken.insert(name).second; ++k) name = stem + "_" + std::to_string(k);
    folders.push_back(run.output_folder.empty() ? "" : run.output_folder + "/" + name);
  }
  return folders;
}

}  // namespace

std::string failureOf(const RunSummary& summary) {
  std::string failure;
  if (2 * summary.scans_diverged > summary.scansTotal()) {
    failure = "the odometry diverged for " + std::to_string(summary.scans_diverged) + " of " +
              std::to_string(summary.scansTotal()) + " scans";
  } else if (!summary.batch || !summary.batch->converged) {
    failure = "the batch did not converge (`rosrun rio_t check_bag BAG` finds a mounting to start from)";
  }
  if (failure.empty() || summary.diagnosis.causes.empty()) return failure;
  const Cause& likeliest = summary.diagnosis.causes.front();
  return failure + ". " + likeliest.text + " " + likeliest.remedy;
}

BagCalibration calibrateFromBags(const CalibrationRun& run) {
  const Config config = batchConfig(run.config);
  const std::vector<std::string> folders = foldersOf(run);
  BagCalibration result;
  std::vector<RunSummary> summaries;  // of the bags that count
  for (std::size_t i = 0; i < run.bags.size(); ++i) {
    CalibrationBag& bag = result.bags.emplace_back();
    bag.path = run.bags[i];
    try {
      const auto progress = run.shows_progress ? progressBar(bag.path + " ") : nullptr;
      RunSummary summary = runBag({{bag.path}, folders[i], config, progress});
      bag.warnings = summary.warnings;
      bag.failure = failureOf(summary);
      if (bag.failure.empty()) summaries.push_back(std::move(summary));
    } catch (const std::exception& error) {
      bag.failure = error.what();
    }
  }
  if (summaries.empty()) return result;
  const std::vector<Config> radars = configsOfRadars(config);
  for (std::size_t k = 0; k < radars.size(); ++k) {
    CalibratedRadar& radar = result.radars.emplace_back();
    radar.name = radars[k].radar_name;
    const SmootherOptions& smoother = radars[k].odometry.smoother;
    const CalibrationPrior& prior = radars[k].odometry.radar;
    std::vector<ExtrinsicsEstimate> mountings;
    for (const RunSummary& summary : summaries) {
      const RadarSummary& found = summary.radars[k];
      radar.offsets.push_back({found.final_offset_s, found.final_offset_sigma_s});
      mountings.push_back({found.extrinsics->T_IR,
                           tangentCovariance(found.extrinsics->covariance, smoother.estimate_extrinsics)});
    }
    radar.calibration = calibrate(
        {prior.time_offset_initial, smoother.estimate_time_offset ? prior.time_offset_sigma : 0.0},
        {prior.T_IR, extrinsicsSigmas(smoother, prior).cwiseAbs2().asDiagonal()}, radar.offsets, mountings);
  }
  return result;
}

}  // namespace rio_t
