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

#include "rio_t/evaluation/errors.h"
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
    for (const auto& [topic, type] : types) known += (known.empty() ? "" : ", ") + topic + " (" + type + ")";
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
  const boost::shared_ptr<Message> message = instance.instantiate<Message>();
  if (!message)
    throw std::runtime_error("topic " + instance.getTopic() + ": a message of another version of its type");
  return message;
}

/// Feeds the estimator message by message and keeps the accounts.
class Player {
 public:
  Player(const Config& config, RunOutput* output)
      : config_(config),
        format_(pointCloudFormat(config)),
        stamper_(stampingOptions(config)),
        odometry_(config.odometry),
        output_(output) {}

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
    account(odometry_.process());
  }

  void finish() {
    for (RadarScan& scan : stamper_.finish()) odometry_.addScan(std::move(scan));
    account(odometry_.finish());
    for (const auto& [reason, count] : stamper_.givenUp()) summary_.scans_rejected[reason] += count;
    summary_.input_faults = odometry_.faults();
    if (points_not_finite_ > 0) summary_.input_faults["points_not_finite"] = points_not_finite_;
    if (first_) {
      const Eigen::Vector3d moved = last_.p_W - first_->p_W;
      summary_.end_to_start_2d_m = moved.head<2>().norm();
      summary_.end_to_start_3d_m = moved.norm();
    }
  }

  const RunSummary& summary() const { return summary_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const RadarInertialOdometry& odometry() const { return odometry_; }

 private:
  void addImu(const sensor_msgs::Imu& message, Time record) {
    const ImuMeasurement imu = toImuMeasurement(message, config_.imu_topic);
    ++summary_.imu_count;
    stamper_.addImu(imu.time, record);
    if (const std::optional<NavigationState> state = odometry_.addImu(imu)) {
      output_->addState(*state);
      trajectory_.push_back({state->time, state->p_W, state->q_WI});
      if (!first_) first_ = trajectory_.back();
      last_ = trajectory_.back();
    }
  }

  void addCloud(const sensor_msgs::PointCloud2& message, Time record) {
    ++summary_.scans_total;
    DecodedScan decoded;
    try {
      decoded = decode(message, format_);
    } catch (const std::exception& error) {
      throw std::runtime_error("topic " + config_.radar_topic + ": " + error.what());
    }
    points_not_finite_ += decoded.dropped_not_finite;
    stamper_.addScan(message.header.seq, toTime(message.header.stamp), record,
                     toRadarScan(decoded.cloud, Time()));
  }

  void account(const std::vector<ScanResult>& results) {
    for (const ScanResult& result : results) {
      output_->addResult(result);
      for (const StampedPose& pose : result.left_window) {
        if (newest_optimized_) summary_.path_length_m += (pose.p_W - newest_optimized_->p_W).norm();
        newest_optimized_ = pose;
      }
      if (result.used) {
        ++summary_.scans_used;
      } else if (!result.rejected_because.empty()) {
        ++summary_.scans_rejected[result.rejected_because];
      }
      if (result.updated) {
        summary_.final_offset_s = result.time_offset;
        summary_.final_offset_sigma_s = result.time_offset_sigma;
      }
    }
  }

  const Config& config_;
  const PointCloudFormat format_;
  ScanStamper stamper_;
  RadarInertialOdometry odometry_;
  RunOutput* output_;
  RunSummary summary_;
  Trajectory trajectory_;
  std::optional<StampedPose> first_, newest_optimized_;
  StampedPose last_;
  std::uint64_t points_not_finite_ = 0;
};

void checkOutcome(const std::string& bag, const Config& config, const Player& player) {
  const RunSummary& summary = player.summary();
  if (summary.imu_count == 0)
    throw bagError(bag, "no messages on topic " + config.imu_topic + " (imu_topic) in the part played");
  if (summary.scans_total == 0)
    throw bagError(bag, "no messages on topic " + config.radar_topic + " (radar_topic) in the part played");
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

std::string decimal(double value, int decimals) {
  std::string text;
  appendFixed(&text, value, decimals);
  return text;
}

}  // namespace

RunSummary runBag(const BagRun& run) {
  const Config& config = run.config;
  rosbag::Bag bag;
  openBag(run.bag, &bag);

  std::vector<Wanted> wanted = {{"imu_topic", config.imu_topic, "sensor_msgs/Imu"},
                                {"radar_topic", config.radar_topic, "sensor_msgs/PointCloud2"}};
  if (config.stamp_source == StampSource::kTrigger)
    wanted.push_back({"trigger_topic", config.trigger_topic, "std_msgs/Header"});
  std::vector<std::string> topics;
  for (const Wanted& want : wanted) topics.push_back(want.topic);
  const std::map<std::string, std::string> types = topicTypes(bag);
  const bool truth_in_bag = config.ground_truth.empty() && types.count(config.ground_truth_topic) != 0;
  if (truth_in_bag)
    wanted.push_back({"ground_truth_topic", config.ground_truth_topic, "geometry_msgs/PoseStamped"});
  checkTopics(run.bag, types, wanted);
  const auto [begin, end] = playedSpan(run.bag, bag, config);
  // Before the work, so that a wrong path costs no time.
  Trajectory truth = config.ground_truth.empty() ? Trajectory() : readTum(config.ground_truth);

  RunOutput output(run.output_folder);
  Player player(config, &output);
  const double length = (end - begin).toSec();
  const auto started = std::chrono::steady_clock::now();
  try {
    rosbag::View view(bag, rosbag::TopicQuery(topics), begin, end);
    double told = -1.0;
    for (const rosbag::MessageInstance& instance : view) {
      player.play(instance);
      if (!run.progress) continue;
      const double done = length > 0.0 ? (instance.getTime() - begin).toSec() / length : 1.0;
      if (done - told > 0.01) run.progress(told = done);
    }
    player.finish();
    if (run.progress) run.progress(1.0);
  } catch (const std::exception& error) {
    throw bagError(run.bag, error.what());
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - started;
  checkOutcome(run.bag, config, player);

  RunSummary summary = player.summary();
  summary.estimation_seconds = took.count();
  summary.realtime_factor = length / took.count();
  std::optional<std::runtime_error> truth_error;
  if (truth_in_bag) truth = readPoses(bag, config.ground_truth_topic);
  if (truth_in_bag || !config.ground_truth.empty()) {
    try {
      summary.truth = errorsAgainst(truth, player.trajectory());
    } catch (const std::exception& error) {
      const std::string name = truth_in_bag ? "topic " + config.ground_truth_topic : config.ground_truth;
      truth_error.emplace("ground truth " + name + ": " + error.what());
    }
  }
  output.finish(summary);
  if (truth_error) throw *truth_error;  // the estimate is saved all the same
  return summary;
}

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
  row("speed", decimal(summary.estimation_seconds, 2) + " s, " + decimal(summary.realtime_factor, 0) +
                   " times real time");
  row("files in", files);
  return table;
}

}  // namespace rio_t
