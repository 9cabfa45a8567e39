#include "rio_t/ros/bag_runner.h"

#include <geometry_msgs/PoseStamped.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "rio_t/evaluation/errors.h"
#include "rio_t/odometry/batch_odometry.h"
#include "rio_t/ros/conversions.h"
#include "rio_t/ros/stamping.h"

namespace rio_t {
namespace {

std::runtime_error bagError(const std::string& bag, const std::string& what) {
  return std::runtime_error("bag " + bag + ": " + what);
}

void openBag(const std::string& path, rosbag::Bag* bag) {
  namespace fs = std::filesystem;
  if (!fs::exists(path))
    throw bagError(
        path, "no such file" + (fs::path(path).is_absolute() ? "" : " in " + fs::current_path().string()));
  if (fs::is_directory(path)) throw bagError(path, "this is a folder, expected a .bag file");
  try {
    bag->open(path, rosbag::bagmode::Read);
  } catch (const rosbag::BagUnindexedException&) {
    throw bagError(path, "not indexed, its recording was cut off; run `rosbag reindex " + path + "` first");
  } catch (const std::exception& error) {
    throw bagError(path, std::string("cannot be read as a ROS 1 bag (") + error.what() + ")");
  }
}

std::map<std::string, std::string> topicTypes(const rosbag::Bag& bag) {
  rosbag::View all(bag);
  std::map<std::string, std::string> types;
  for (const rosbag::ConnectionInfo* connection : all.getConnections())
    types[connection->topic] = connection->datatype;
  return types;
}

/// The topic of a configuration key and the type it must have.
struct Wanted {
  const char* key;
  std::string topic;
  std::string type;
};

void checkTopics(const std::string& bag, const std::map<std::string, std::string>& types,
                 const std::vector<Wanted>& wanted) {
  std::string faults;
  bool missing = false;
  for (const Wanted& want : wanted) {
    const auto found = types.find(want.topic);
    if (found != types.end() && found->second == want.type) continue;
    if (!faults.empty()) faults += "; ";
    if (found == types.end()) {
      missing = true;
      faults += std::string("no topic ") + want.topic + " (" + want.key + ", " + want.type + ")";
    } else {
      faults += "topic " + want.topic + " (" + want.key + ") is " + found->second + ", expected " + want.type;
    }
  }
  if (faults.empty()) return;
  if (missing) {
    std::string known;
    for (const auto& [topic, type] : types) {
      if (!known.empty()) known += ", ";
      known.append(topic).append(" (").append(type).append(")");
    }
    faults += "; the bag has " + (known.empty() ? "no topics" : known);
  }
  throw bagError(bag, faults);
}

/// Begin and end of what is played, by the keys bag_start and bag_duration.
std::pair<ros::Time, ros::Time> playedSpan(const std::string& path, const rosbag::Bag& bag,
                                           const Config& config) {
  rosbag::View all(bag);
  const double length = (all.getEndTime() - all.getBeginTime()).toSec();
  if (config.bag_start > length) {
    throw bagError(path, "bag_start (" + std::to_string(config.bag_start) + " s) lies behind its end (" +
                             std::to_string(length) + " s)");
  }
  const ros::Time begin = all.getBeginTime() + ros::Duration(config.bag_start);
  const bool to_end = config.bag_duration <= 0.0 || config.bag_start + config.bag_duration >= length;
  return {begin, to_end ? all.getEndTime() : begin + ros::Duration(config.bag_duration)};
}

template <typename Message>
boost::shared_ptr<Message> read(const rosbag::MessageInstance& instance) {
  boost::shared_ptr<Message> message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error("topic " + instance.getTopic() + ": a message of another version of its type");
  return message;
}

/// Writes what a run gives, and keeps the accounts.
class RunLog {
 public:
  /// `output` may be null. `taken_off` [s]: the stamps are earlier, and the offset smaller, by so much.
  RunLog(RunOutput* output, double taken_off) : output_(output), taken_off_(taken_off) {}

  void addState(const NavigationState& state) {
    if (output_ != nullptr) output_->addState(state);
    trajectory_.push_back({state.time, state.p_W, state.q_WI});
  }

  /// Puts what was taken off the stamps back on.
  void addResult(ScanResult& result) {
    if (taken_off_ != 0.0) {
      result.scan.stamp = result.scan.stamp + taken_off_;
      if (result.updated) result.time_offset += taken_off_;
    }
    if (output_ != nullptr) output_->addResult(result);
    for (const StampedPose& pose : result.left_window) {
      if (newest_optimized_) path_length_m_ += (pose.p_W - newest_optimized_->p_W).norm();
      newest_optimized_ = pose;
    }
    if (result.used) {
      ++used_;
    } else if (!result.rejected_because.empty()) {
      ++rejected_[result.rejected_because];
    }
    if (result.updated) {
      final_offset_s_ = result.time_offset;
      final_offset_sigma_s_ = result.time_offset_sigma;
    }
  }

  /// Sets what the log knows.
  void fill(RunSummary* summary) const {
    summary->scans_used = used_;
    summary->scans_rejected = rejected_;
    summary->path_length_m = path_length_m_;
    summary->final_offset_s = final_offset_s_;
    summary->final_offset_sigma_s = final_offset_sigma_s_;
    if (trajectory_.empty()) return;
    const Eigen::Vector3d moved = trajectory_.back().p_W - trajectory_.front().p_W;
    summary->end_to_start_2d_m = moved.head<2>().norm();
    summary->end_to_start_3d_m = moved.norm();
  }

  Trajectory takeTrajectory() { return std::move(trajectory_); }

 private:
  RunOutput* output_;
  double taken_off_;
  Trajectory trajectory_;
  std::uint64_t used_ = 0;
  std::map<std::string, std::uint64_t> rejected_;
  std::optional<StampedPose> newest_optimized_;
  double path_length_m_ = 0.0;
  double final_offset_s_ = 0.0;
  double final_offset_sigma_s_ = 0.0;
};

/// Feeds the estimator message by message.
class Player {
 public:
  /// `recorder`: keeps the run for a batch; may be null.
  Player(const Config& config, RunLog* log, BatchOdometry* recorder)
      : config_(config),
        format_(pointCloudFormat(config)),
        stamper_(stampingOptions(config)),
        odometry_(config.odometry),
        log_(log),
        recorder_(recorder) {}

  void play(const rosbag::MessageInstance& instance) {
    const std::string& topic = instance.getTopic();
    const Time record = toTime(instance.getTime());
    if (topic == config_.imu_topic) {
      addImu(*read<sensor_msgs::Imu>(instance), record);
    } else if (topic == config_.radar_topic) {
      addCloud(*read<sensor_msgs::PointCloud2>(instance), record);
    } else {
      const auto trigger = read<std_msgs::Header>(instance);
      stamper_.addTrigger(trigger->seq, toTime(trigger->stamp), record);
    }
    for (RadarScan& scan : stamper_.take()) odometry_.addScan(std::move(scan));
    odometry_.process([this](ScanResult& result) { account(result); });
  }

  void finish() {
    for (RadarScan& scan : stamper_.finish()) odometry_.addScan(std::move(scan));
    for (ScanResult& result : odometry_.finish()) account(result);
  }

  RunSummary summary() const {
    RunSummary summary;
    log_->fill(&summary);
    countInput(&summary);
    return summary;
  }
  /// Sets what was read, and what of it never became a scan.
  void countInput(RunSummary* summary) const {
    summary->imu_count = imu_count_;
    summary->scans_total = scans_total_;
    for (const auto& [reason, count] : stamper_.givenUp()) summary->scans_rejected[reason] += count;
    summary->input_faults = odometry_.faults();
    // These two are judgements of the estimate, with keys of their own.
    const auto take = [&](const char* name) {
      const auto node = summary->input_faults.extract(name);
      return node.empty() ? std::uint64_t{0} : node.mapped();
    };
    summary->divergences = take("diverged");
    summary->reinitializations = take("reinitialized");
    summary->health_at_end = toString(odometry_.health());
    if (const auto start = odometry_.start()) summary->initialized_from = toString(start->from);
    if (points_not_finite_ > 0) summary->input_faults["points_not_finite"] = points_not_finite_;
    for (const auto& [kind, what] : not_usable_) {
      (kind == "imu_not_usable" ? summary->input_faults : summary->scans_rejected)[kind] += what.count;
      summary->warnings.push_back(what.why + " (messages: " + std::to_string(what.count) + ")");
    }
  }
  const RadarInertialOdometry& odometry() const { return odometry_; }

 private:
  struct NotUsable {
    std::string why;  // the first of them
    std::uint64_t count = 0;
  };

  void addImu(const sensor_msgs::Imu& message, Time record) {
    ++imu_count_;
    ImuMeasurement imu;
    try {
      imu = toImuMeasurement(message, config_.imu_topic);
    } catch (const std::exception& error) {
      notUsable("imu_not_usable", error.what());
      return;
    }
    stamper_.addImu(imu.time, record);
    if (recorder_ != nullptr) recorder_->addImu(imu);
    if (const std::optional<NavigationState> state = odometry_.addImu(imu)) log_->addState(*state);
  }

  void addCloud(const sensor_msgs::PointCloud2& message, Time record) {
    ++scans_total_;
    DecodedScan decoded;
    try {
      decoded = decode(message, format_);
    } catch (const std::exception& error) {
      notUsable("cloud_not_usable", "topic " + config_.radar_topic + ": " + error.what());
      return;
    }
    points_not_finite_ += decoded.dropped_not_finite;
    try {
      stamper_.addScan(message.header.seq, toTime(message.header.stamp), record,
                       toRadarScan(decoded.cloud, Time()));
    } catch (const std::exception& error) {
      notUsable("stamp_zero", error.what());
    }
  }

  /// One bad message among good ones is counted; `why` is told at the end, the first one of each kind.
  void notUsable(const std::string& kind, const std::string& why) {
    ++not_usable_.try_emplace(kind, NotUsable{why, 0}).first->second.count;
  }

  void account(ScanResult& result) {
    if (!start_) start_ = odometry_.start();
    if (recorder_ != nullptr) {
      const auto faults = odometry_.faults();
      const auto steps = faults.find("time_offset_step");
      const std::uint64_t count = steps == faults.end() ? 0 : steps->second;
      recorder_->addResult(result, std::exchange(offset_steps_, count) != count);
    }
    log_->addResult(result);
  }

 public:
  /// Of the first initialisation.
  const std::optional<RadarInertialOdometry::Start>& start() const { return start_; }

 private:
  const Config& config_;
  const PointCloudFormat format_;
  ScanStamper stamper_;
  RadarInertialOdometry odometry_;
  RunLog* log_;
  BatchOdometry* recorder_;
  std::optional<RadarInertialOdometry::Start> start_;
  std::uint64_t imu_count_ = 0, scans_total_ = 0, points_not_finite_ = 0, offset_steps_ = 0;
  std::map<std::string, NotUsable> not_usable_;  // by kind
};

void checkOutcome(const std::string& bag, const Config& config, const Player& player) {
  const RunSummary summary = player.summary();
  if (summary.imu_count == 0)
    throw bagError(bag, "no messages on topic " + config.imu_topic + " (imu_topic) in the part played");
  if (summary.scans_total == 0)
    throw bagError(bag, "no messages on topic " + config.radar_topic + " (radar_topic) in the part played");
  // Where none of a topic's messages can be used, what was wrong with the first is what is wrong.
  const auto countOf = [](const std::map<std::string, std::uint64_t>& counts, const char* name) {
    const auto found = counts.find(name);
    return found == counts.end() ? 0 : found->second;
  };
  const std::uint64_t bad_scans =
      countOf(summary.scans_rejected, "cloud_not_usable") + countOf(summary.scans_rejected, "stamp_zero");
  if (bad_scans == summary.scans_total ||
      countOf(summary.input_faults, "imu_not_usable") == summary.imu_count)
    throw bagError(bag, summary.warnings.front());
  if (!player.odometry().initialized()) {
    throw bagError(bag, "never initialised, waited for " + player.odometry().waitingFor() + " (" +
                            std::to_string(summary.imu_count) + " IMU samples, init_duration " +
                            std::to_string(config.odometry.initialization.duration) + " s)");
  }
  if (summary.scans_used > 0) return;
  std::string reasons;
  for (const auto& [reason, count] : summary.scans_rejected) {
    reasons += (reasons.empty() ? "" : ", ") + reason + " " + std::to_string(count);
  }
  throw bagError(
      bag, "every one of the " + std::to_string(summary.scans_total) + " scans was rejected: " + reasons);
}

Trajectory readPoses(const rosbag::Bag& bag, const std::string& topic) {
  Trajectory truth;
  rosbag::View view(bag, rosbag::TopicQuery(topic));
  for (const rosbag::MessageInstance& instance : view) {
    const auto message = read<geometry_msgs::PoseStamped>(instance);
    const auto& p = message->pose.position;
    const auto& q = message->pose.orientation;
    const Time time = toTime(message->header.stamp);
    if (!truth.empty() && time <= truth.back().time) continue;
    truth.push_back({time, {p.x, p.y, p.z}, Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized()});
  }
  return truth;
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

/// One bag with its configuration: what all modes share, and the modes.
class BagJob {
 public:
  /// Opens and checks the bag, and makes the output folder.
  explicit BagJob(const BagRun& run) : run_(run), started_(std::chrono::steady_clock::now()) {
    const Config& config = run.config;
    openBag(run.bag, &bag_);
    std::vector<Wanted> wanted = {{"imu_topic", config.imu_topic, "sensor_msgs/Imu"},
                                  {"radar_topic", config.radar_topic, "sensor_msgs/PointCloud2"}};
    if (config.stamp_source == StampSource::kTrigger)
      wanted.push_back({"trigger_topic", config.trigger_topic, "std_msgs/Header"});
    for (const Wanted& want : wanted) topics_.push_back(want.topic);
    const std::map<std::string, std::string> types = topicTypes(bag_);
    truth_in_bag_ = config.ground_truth.empty() && types.count(config.ground_truth_topic) != 0;
    if (truth_in_bag_)
      wanted.push_back({"ground_truth_topic", config.ground_truth_topic, "geometry_msgs/PoseStamped"});
    checkTopics(run.bag, types, wanted);
    std::tie(begin_, end_) = playedSpan(run.bag, bag_, config);
    // Before the work, so that a wrong path costs no time.
    if (!config.ground_truth.empty()) truth_ = readTum(config.ground_truth);
    output_.emplace(run.output_folder);
    started_ = std::chrono::steady_clock::now();
  }

  RunSummary execute() {
    switch (run_.config.mode) {
      case RunMode::kOnline:
        return online();
      case RunMode::kBatch:
        return batch();
      case RunMode::kRefine:
        return refine();
    }
    throw std::invalid_argument("not a RunMode");
  }

 private:
  RunSummary online() {
    RunLog log(&*output_, 0.0);
    Player player(run_.config, &log, nullptr);
    play(player, run_.config, 0.0, 1.0);
    return finish(player.summary(), log, *output_);
  }

  RunSummary batch() {
    const OdometryOptions& options = run_.config.odometry;
    BatchOptions batch_options;
    batch_options.max_iterations = run_.config.batch_max_iterations;
    BatchOdometry recorder(options, batch_options);
    RunOutput online_output(run_.output_folder + "/online");
    RunLog online_log(&online_output, 0.0);
    Player player(run_.config, &online_log, &recorder);
    play(player, run_.config, 0.0, 0.9);
    finish(player.summary(), online_log, online_output);

    const BatchResult result = recorder.solve(*player.start());
    RunLog log(&*output_, 0.0);
    for (const NavigationState& state : result.trajectory) log.addState(state);
    for (ScanResult scan : result.scans) log.addResult(scan);
    RunSummary summary;
    summary.mode = "batch";
    summary.batch = BatchSummary{result.solution.iterations, result.solution.placements,
                                 result.solution.converged, result.readmitted};
    log.fill(&summary);
    player.countInput(&summary);
    return finish(std::move(summary), log, *output_);
  }

  /// The offset found is taken off the stamps, and the rest is estimated from the prior of the first pass:
  /// the data are the same in each pass, and a prior from the pass before would count them twice.
  RunSummary refine() {
    const int passes = run_.config.refine_passes;
    std::vector<double> offsets, sigmas;
    double taken_off = 0.0;  // [s]
    for (int pass = 1;; ++pass) {
      Config config = run_.config;
      config.radar_stamp_shift -= taken_off;
      if (pass > 1) config.odometry.smoother.time_offset_initial = 0.0;
      const bool last = pass == passes;
      std::optional<RunOutput> earlier;
      if (!last) earlier.emplace(run_.output_folder + "/pass_" + std::to_string(pass));
      RunOutput& output = last ? *output_ : *earlier;
      RunLog log(&output, taken_off);
      Player player(config, &log, nullptr);
      play(player, config, (pass - 1.0) / passes, static_cast<double>(pass) / passes);
      RunSummary summary = player.summary();
      offsets.push_back(taken_off = summary.final_offset_s);
      sigmas.push_back(summary.final_offset_sigma_s);
      if (last) {
        summary.mode = "refine";
        summary.pass_offsets_s = offsets;
        summary.pass_offset_sigmas_s = sigmas;
      }
      summary = finish(std::move(summary), log, output);
      if (last) return summary;
    }
  }

  /// The whole bag; progress goes from `from` to `to`.
  void play(Player& player, const Config& config, double from, double to) {
    const double length = (end_ - begin_).toSec();
    try {
      rosbag::View view(bag_, rosbag::TopicQuery(topics_), begin_, end_);
      double told = -1.0;
      for (const rosbag::MessageInstance& instance : view) {
        player.play(instance);
        if (!run_.progress) continue;
        const double done = length > 0.0 ? (instance.getTime() - begin_).toSec() / length : 1.0;
        if (done - told > 0.01) run_.progress(from + (to - from) * (told = done));
      }
      player.finish();
    } catch (const std::exception& error) {
      throw bagError(run_.bag, error.what());
    }
    checkOutcome(run_.bag, config, player);
  }

  /// Adds speed and errors, and saves.
  RunSummary finish(RunSummary summary, RunLog& log, RunOutput& output) {
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started_;
    if (&output == &*output_ && run_.progress) run_.progress(1.0);
    summary.estimation_seconds = took.count();
    summary.realtime_factor = (end_ - begin_).toSec() / took.count();
    const Trajectory trajectory = log.takeTrajectory();
    std::optional<std::runtime_error> truth_error;
    if (truth_in_bag_ && truth_.empty()) truth_ = readPoses(bag_, run_.config.ground_truth_topic);
    if (truth_in_bag_ || !run_.config.ground_truth.empty()) {
      try {
        summary.truth = errorsAgainst(truth_, trajectory);
      } catch (const std::exception& error) {
        const std::string name =
            truth_in_bag_ ? "topic " + run_.config.ground_truth_topic : run_.config.ground_truth;
        truth_error.emplace("ground truth " + name + ": " + error.what());
      }
    }
    output.finish(summary);
    if (truth_error) throw *truth_error;  // the estimate is saved all the same
    return summary;
  }

  const BagRun& run_;
  rosbag::Bag bag_;
  std::vector<std::string> topics_;
  ros::Time begin_, end_;
  bool truth_in_bag_ = false;
  Trajectory truth_;
  std::optional<RunOutput> output_;
  std::chrono::steady_clock::time_point started_;
};

std::string decimal(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text;
}

}  // namespace

RunSummary runBag(const BagRun& run) { return BagJob(run).execute(); }

std::string describeRun(const RunSummary& summary, const std::string& files) {
  std::string table;
  const auto row = [&](const char* name, const std::string& value) {
    table += "  " + std::string(name) + std::string(16 - std::string(name).size(), ' ') + value + "\n";
  };
  const auto percent = [&](double metres) {
    return summary.path_length_m > 0.1 ? " (" + decimal(100.0 * metres / summary.path_length_m, 2) + " %)"
                                       : std::string();
  };
  std::string scans =
      std::to_string(summary.scans_used) + " of " + std::to_string(summary.scans_total) + " used";
  for (const auto& [reason, count] : summary.scans_rejected)
    scans += ", " + std::to_string(count) + " " + reason;
  if (summary.batch) {
    row("batch", (summary.batch->converged ? "converged after " : "NOT converged after ") +
                     std::to_string(summary.batch->iterations) + " iterations, nodes placed " +
                     std::to_string(summary.batch->placements) + " times, " +
                     std::to_string(summary.batch->scans_readmitted) + " scans taken back");
  }
  if (!summary.pass_offsets_s.empty()) {
    std::string offsets;
    for (const double offset : summary.pass_offsets_s)
      offsets += (offsets.empty() ? "" : ", ") + decimal(1e3 * offset, 2);
    row("after passes", offsets + " ms");
  }
  row("path", decimal(summary.path_length_m, 2) + " m");
  row("end to start", decimal(summary.end_to_start_2d_m, 3) + " m" + percent(summary.end_to_start_2d_m) +
                          " horizontal, " + decimal(summary.end_to_start_3d_m, 3) + " m" +
                          percent(summary.end_to_start_3d_m) + " in 3D");
  row("time offset", decimal(1e3 * summary.final_offset_s, 2) + " ms, sigma " +
                         decimal(1e3 * summary.final_offset_sigma_s, 2) + " ms");
  if (summary.truth) {
    std::string errors = "ATE " + decimal(summary.truth->ate_m, 3) + " m";
    if (summary.truth->t_rel) {
      errors += ", t_rel " + decimal(*summary.truth->t_rel, 4) + " m/m, r_rel " +
                decimal(*summary.truth->r_rel_deg, 3) + " deg/m";
    }
    row("against truth", errors);
  }
  row("scans", scans);
  if (!summary.input_faults.empty()) {
    std::string faults;
    for (const auto& [name, count] : summary.input_faults)
      faults += (faults.empty() ? "" : ", ") + std::to_string(count) + " " + name;
    row("input faults", faults);
  }
  row("started from", summary.initialized_from);
  if (summary.divergences > 0 || summary.health_at_end != "ok") {
    row("DO NOT TRUST", "diverged " + std::to_string(summary.divergences) + " times, found anew " +
                            std::to_string(summary.reinitializations) + " times, at the end " +
                            summary.health_at_end);
  }
  row("speed", decimal(summary.estimation_seconds, 2) + " s, " + decimal(summary.realtime_factor, 0) +
                   " times real time");
  row("files in", files);
  return table;
}

}  // namespace rio_t
