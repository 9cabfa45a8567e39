#include "parameter_sections.h"

// The registry serves loading, checking, messages, config/estimator.yaml and docs/parameters.md.
namespace rio_t {

void listPrograms(ParameterList& list, Config& c) {
  list.group("Live node");
  list.integer(
      "path_max_poses", between(1, 1e6), c.path_max_poses,
      "The topic ~path keeps the newest poses, at most this number. Raise it to see a longer path in "
      "rviz. A long path costs bandwidth, since each message holds all of it.");
  list.text(
      "trajectory_file", c.trajectory_file,
      "The service ~save_trajectory writes this TUM file. A relative path counts from the working folder of "
      "the node, which is ~/.ros under roslaunch.");

  list.group("Bag runner");
  list.choice<RunMode>(
      "mode", {{"online", RunMode::kOnline}, {"batch", RunMode::kBatch}, {"refine", RunMode::kRefine}},
      c.mode,
      "This is how rio_t_bag works through a bag. online gives what a live user gets. batch solves the whole "
      "bag at once after an online pass, which is the most accurate. refine plays the bag several times. "
      "Before each new pass it subtracts the offset found so far from the stamps.");
  list.integer("refine_passes", between(1, 100), c.refine_passes,
               "mode: refine plays the bag this many times. Three passes are enough for most bags.");
  list.integer("batch_max_iterations", between(1, 10000), c.batch_max_iterations,
               "The solver of mode: batch stops after this many iterations. Raise it if summary.yaml says "
               "batch_converged: false.");
  list.number("bag_start", "s", atLeast(0), c.bag_start,
              "The bag runner leaves out this much of the bag at its beginning.");
  list.number("bag_duration", "s", atLeast(0), c.bag_duration,
              "The bag runner plays this much of the bag. 0 plays it to its end.");
  list.textOrEmpty(
      "ground_truth", c.ground_truth,
      "This TUM file holds the true poses of the IMU. The bag runner compares the estimate with them. If it "
      "is empty, the bag runner reads ground_truth_topic if the bag has it.");
}

ParameterList parametersOf(Config& config) {
  ParameterList list;
  listMessages(list, config);
  listFrames(list, config);
  listPointCloud(list, config);
  listExtrinsics(list, config);
  listImu(list, config);
  listStart(list, config);
  listAids(list, config);
  listRadar(list, config);
  listTimeOffset(list, config);
  listSmoother(list, config);
  listHealthAndLandmarks(list, config);
  listPrograms(list, config);
  return list;
}

}  // namespace rio_t
