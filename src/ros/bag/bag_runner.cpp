#include "rio_t/ros/bag/bag_runner.h"

#include <rosbag/view.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "../command_line.h"
#include "../text.h"
#include "bag_file.h"
#include "bag_frames.h"
#include "bag_player.h"
#include "rio_t/evaluation/errors.h"
#include "rio_t/odometry/batch_odometry.h"
#include "rio_t/ros/parameters/parameters.h"
#include "run_log.h"

namespace rio_t {
namespace {

std::string noMessages(const Config& radar) {
  return "no messages on topic " + radar.radar_topic + " (" + prefixOf(radar.radar_name) + "radar_topic" +
         ") in the part played";
}

std::string allRejected(const RadarSummary& radar) {
  std::string reasons;
  for (const auto& [reason, count] : radar.scans_rejected)
    appendItem(&reasons, reason + " " + std::to_string(count));
  return "every one of the " + std::to_string(radar.scans_total) + " scans " +
         (radar.name.empty() ? "" : "of radar " + radar.name + " ") + "was rejected: " + reasons;
}

void warnOfAids(const Config& config, RunSummary* summary) {
  if (summary->barometer && summary->barometer->used == 0)
    summary->warnings.push_back("no pressure of topic " + config.barometer_topic +
                                " (barometer_topic) was used, of " +
                                std::to_string(summary->barometer->pressures) + " messages");
  if (summary->barometer && summary->barometer->steps > 0)
    summary->warnings.push_back(
        "the pressure of topic " + config.barometer_topic + " (barometer_topic) " +
        "stepped, and the bias was estimated again: " + std::to_string(summary->barometer->steps) +
        ". Doors and rotors do that. A sensor that freezes or rounds to whole hPa "
        "steps all the time: leave it out");
  if (summary->ground_vehicle && summary->ground_vehicle->contradicted_at)
    summary->warnings.push_back("after " + fixedText(*summary->ground_vehicle->contradicted_at, 1) + " s " +
                                kGroundVehicleContradicted);
}

/// Warns about each of several radars of which no scan was used, since the others carry the run.
void warnOfSilentRadars(const Config& config, RunSummary* summary) {
  if (summary->radars.size() < 2) return;
  for (std::size_t k = 0; k < summary->radars.size(); ++k) {
    const RadarSummary& radar = summary->radars[k];
    if (radar.scans_used > 0) continue;
    summary->warnings.push_back(radar.scans_total == 0 ? noMessages(config.radars[k]) : allRejected(radar));
  }
}

void checkOutcome(const std::string& bag, const Config& config, const RunSummary& summary) {
  if (summary.imu_count == 0)
    throw bagError(bag, "no messages on topic " + config.imu_topic + " (imu_topic) in the part played");
  if (summary.scansTotal() == 0) {
    std::string topics;
    for (const Config& radar : configsOfRadars(config)) appendItem(&topics, noMessages(radar), "; ");
    throw bagError(bag, topics);
  }
  // If most messages of a topic cannot be used, the error says that, and not what became of the rest.
  std::string unusable_scans;
  std::uint64_t unusable = 0;
  for (const NotUsable& each : summary.not_usable) {
    if (!summary.initialized && each.kind == "imu_not_usable" && 2 * each.count > summary.imu_count)
      throw bagError(bag, each.text());
    if (!each.is_scan) continue;
    appendItem(&unusable_scans, each.text(), "; ");
    unusable += each.count;
  }
  if (summary.scansUsed() == 0 && 2 * unusable > summary.scansTotal()) throw bagError(bag, unusable_scans);
  const auto failed = [&](const std::string& what) {
    return RunFailed(bagError(bag, what).what(), summary.diagnosis);
  };
  if (!summary.initialized) {
    throw failed("never initialised, waited for " + summary.waiting_for.text + " (" +
                 std::to_string(summary.imu_count) + " IMU samples, init_duration " +
                 std::to_string(config.odometry.initialization.duration) + " s)");
  }
  if (summary.scansUsed() > 0) return;
  std::string reasons;
  for (const RadarSummary& radar : summary.radars) appendItem(&reasons, allRejected(radar), "; ");
  throw failed(reasons);
}

/// Subtracts the offsets [s], by radar, from the stamps. The estimate of what remains starts at zero.
void subtractFromStamps(const std::vector<double>& offsets, Config* config) {
  const auto of = [](double offset, Config* radar) {
    radar->radar_stamp_shift -= offset;
    radar->odometry.radar.time_offset_initial = 0.0;
  };
  if (config->radars.empty()) return of(offsets.front(), config);
  for (std::size_t k = 0; k < config->radars.size(); ++k) {
    of(offsets[k], &config->radars[k]);
    config->odometry.radars[k].time_offset_initial = 0.0;
  }
}

TruthErrors errorsAgainst(const Trajectory& truth, const Trajectory& estimate) {
  TruthErrors errors;
  errors.ate_m = absoluteError(truth, estimate, Alignment::kOrigin).translation_m.rmse;
  const RelativeError relative = relativeError(truth, estimate);
  if (relative.pairs > 0) {
    errors.t_rel = relative.translation_m.rmse;
    errors.r_rel_deg = relative.rotation_deg.rmse;
  }
  return errors;
}

/// Runs the bags in the mode of the configuration.
class BagJob {
 public:
  /// Opens and checks the bags, and makes the output folder.
  explicit BagJob(const BagRun& run) : run_(run), files_(runFiles(run.config)), bags_(run.bags) {
    const std::map<std::string, std::string> types = bags_.typesByTopic();
    // This checks again, since two radars may have one topic once the topics are resolved.
    run_.config = withParameters(
        withTopics(run.config, [&](const std::string& /*key*/,
                                   const std::string& topic) { return topicOfBag(topic, types); }),
        {});
    const Config& config = run_.config;
    std::vector<InputTopic> wanted = inputTopics(config);
    for (const InputTopic& want : wanted) topics_.push_back(want.topic);
    truth_in_bag_ = config.ground_truth.empty() && types.count(config.ground_truth_topic) != 0;
    if (truth_in_bag_)
      wanted.push_back({"ground_truth_topic", config.ground_truth_topic, "geometry_msgs/PoseStamped"});
    checkTopics(bags_.name(), types, wanted);
    run_.config = withExtrinsicsOfBag(config, bags_);
    std::tie(begin_, end_) = playedSpan(bags_, config);
    // Before the work, so that a wrong path costs no time.
    if (!config.ground_truth.empty()) truth_ = readTum(config.ground_truth);
    output_ = openOutput("");
    started_ = std::chrono::steady_clock::now();
  }

  RunSummary execute() {
    const RunMode mode = run_.config.mode;
    RunSummary summary = mode == RunMode::kBatch ? batch() : mode == RunMode::kRefine ? refine() : online();
    if (run_.progress) run_.progress(1.0);
    if (truth_error_) throw *truth_error_;  // the estimate is saved all the same
    return summary;
  }

 private:
  RunSummary online() {
    RunLog log(run_.config, output_.get(), zeroOffsets(), hasTruth());
    BagPlayer player(run_.config, &log, nullptr);
    return finish(play(player, run_.config, log, 0.0, 1.0), log, output_.get());
  }

  /// Replaces the estimates of the online run by those of the batch. The counts stay those of the online run,
  /// which chose the terms.
  static void addAids(const BatchSolution& solution, RunSummary* summary) {
    if (summary->ground_vehicle && solution.T_IV) {
      summary->ground_vehicle->rotation = solution.T_IV->q_IR;
      summary->ground_vehicle->rotation_sigma = solution.q_IV_sigma;
    }
    if (summary->barometer && solution.barometer_bias) {
      summary->barometer->bias = *solution.barometer_bias;
      summary->barometer->bias_sigma = solution.barometer_bias_sigma;
    }
  }

  RunSummary batch() {
    const OdometryOptions& options = run_.config.odometry;
    BatchOptions batch_options;
    batch_options.max_iterations = run_.config.batch_max_iterations;
    BatchOdometry recorder(options, batch_options);
    const std::unique_ptr<RunOutput> online_output = openOutput("/online");
    RunLog online_log(run_.config, online_output.get(), zeroOffsets(), hasTruth());
    BagPlayer player(run_.config, &online_log, &recorder);
    finish(play(player, run_.config, online_log, 0.0, 0.9), online_log, online_output.get());

    const BatchResult result = recorder.solve(*player.start());
    RunLog log(run_.config, output_.get(), zeroOffsets(), hasTruth());
    for (const NavigationState& state : result.trajectory) log.addState(state);
    for (ScanResult scan : result.scans) log.addResult(scan);
    RunSummary summary = player.summary(log);  // counts of the online run, estimates of the batch
    summary.mode = "batch";
    summary.batch =
        BatchSummary{result.solution.iterations, result.solution.placements, result.solution.converged()};
    summary.solver_terminations = {{toString(result.solution.termination), 1}};
    addAids(result.solution, &summary);
    summary.diagnosis = diagnose(summary, run_.config);
    return finish(std::move(summary), log, output_.get());
  }

  /// Each pass subtracts the offset found so far from the stamps and estimates what remains, from zero and
  /// with the sigma of the first pass. A sigma from the pass before would count the same data twice.
  RunSummary refine() {
    const int passes = run_.config.refine_passes;
    std::vector<double> subtracted = zeroOffsets();  // [s] by radar
    std::vector<std::vector<double>> offsets(subtracted.size());
    for (int pass = 1;; ++pass) {
      Config config = run_.config;
      if (pass > 1) subtractFromStamps(subtracted, &config);
      const bool last = pass == passes;
      const std::unique_ptr<RunOutput> earlier = last ? nullptr : openOutput("/pass_" + std::to_string(pass));
      RunOutput* output = last ? output_.get() : earlier.get();
      RunLog log(config, output, subtracted, hasTruth());
      BagPlayer player(config, &log, nullptr);
      RunSummary summary =
          play(player, config, log, (pass - 1.0) / passes, static_cast<double>(pass) / passes);
      for (std::size_t k = 0; k < subtracted.size(); ++k) {
        RadarSummary& radar = summary.radars[k];
        offsets[k].push_back(subtracted[k] = radar.final_offset_s);
        if (last) radar.pass_offsets_s = offsets[k];
      }
      if (last) summary.mode = "refine";
      summary = finish(std::move(summary), log, output);
      if (last) return summary;
    }
  }

  /// Null if no files are wanted.
  std::unique_ptr<RunOutput> openOutput(const std::string& subfolder) const {
    if (run_.output_folder.empty()) return nullptr;
    for (const std::string& name : files_.names()) {
      const std::string file = run_.output_folder + subfolder + "/" + name;
      if (isSameFile(file, run_.config.ground_truth))
        throw std::runtime_error("ground_truth " + run_.config.ground_truth +
                                 ": expected another file than those that the run writes");
    }
    return std::make_unique<RunOutput>(run_.output_folder + subfolder, files_);
  }

  bool hasTruth() const { return truth_in_bag_ || !run_.config.ground_truth.empty(); }
  std::vector<double> zeroOffsets() const { return std::vector<double>(files_.radars.size(), 0.0); }

  /// Plays the whole bag. The progress goes from `from` to `to`.
  RunSummary play(BagPlayer& player, const Config& config, const RunLog& log, double from, double to) {
    const double length = (end_ - begin_).toSec();
    try {
      rosbag::View view;
      bags_.addTo(&view, rosbag::TopicQuery(topics_), begin_, end_);
      double reported = -1.0;
      for (const rosbag::MessageInstance& instance : view) {
        player.play(instance);
        if (!run_.progress) continue;
        const double done = length > 0.0 ? (instance.getTime() - begin_).toSec() / length : 1.0;
        if (done - reported > 0.01) run_.progress(from + (to - from) * (reported = done));
      }
      player.finish();
    } catch (const OutputError&) {
      throw;
    } catch (const std::exception& error) {
      throw bagError(bags_.name(), error);
    }
    RunSummary summary = player.summary(log);
    checkOutcome(bags_.name(), config, summary);
    return summary;
  }

  /// Completes the summary with speed and errors, and saves it.
  RunSummary finish(RunSummary summary, RunLog& log, RunOutput* output) {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started_;
    // The keys and files of a single radar carry no name. Its diagnosis does, since it names the section.
    if (summary.radars.size() == 1) summary.radars.front().name.clear();
    warnOfSilentRadars(run_.config, &summary);
    warnOfAids(run_.config, &summary);
    summary.estimation_seconds = took.count();
    summary.realtime_factor = (end_ - begin_).toSec() / took.count();
    const Trajectory trajectory = log.takeTrajectory();
    truth_error_.reset();
    if (hasTruth() && !summary.imu_restarts.empty()) {
      summary.warnings.emplace_back(
          "the trajectory starts again, so it is not compared with the ground truth: run each part by "
          "itself");
    } else if (hasTruth()) {
      try {
        if (truth_in_bag_ && truth_.empty()) truth_ = readPoses(bags_, run_.config.ground_truth_topic);
        summary.truth = errorsAgainst(truth_, trajectory);
      } catch (const std::exception& error) {
        const std::string name =
            truth_in_bag_ ? "topic " + run_.config.ground_truth_topic : run_.config.ground_truth;
        truth_error_.emplace("ground truth " + name + ": " + error.what());
      }
    }
    if (output != nullptr) output->finish(summary);
    return summary;
  }

  BagRun run_;  // with topics and extrinsics resolved by the bag
  const RunFiles files_;
  const Bags bags_;
  std::vector<std::string> topics_;
  ros::Time begin_, end_;
  bool truth_in_bag_ = false;
  Trajectory truth_;
  std::optional<std::runtime_error>
      truth_error_;                    // why the last finished run has no errors against the truth
  std::unique_ptr<RunOutput> output_;  // null: no files
  std::chrono::steady_clock::time_point started_;
};

}  // namespace

RunSummary runBag(const BagRun& run) { return BagJob(run).execute(); }

}  // namespace rio_t
