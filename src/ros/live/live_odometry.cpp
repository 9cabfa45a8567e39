#include "rio_t/ros/live/live_odometry.h"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/console.h>
#include <ros/exceptions.h>
#include <ros/master.h>

#include <algorithm>
#include <boost/function.hpp>
#include <filesystem>
#include <utility>

#include "../command_line.h"
#include "radar_texts.h"
#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/messages/conversions.h"
#include "rio_t/ros/parameters/ros_parameters.h"

namespace rio_t {
namespace {

constexpr double kDiagnosticPeriod = 1.0;  // [s]
// Deep enough for seconds of input: nothing is lost while a callback is late.
constexpr std::uint32_t kScanQueue = 200;

/// The topics with namespace and remappings, for messages to people. Throws ConfigError that names the keys
/// of topics that ROS does not take.
Config withResolvedTopics(const Config& configured, const ros::NodeHandle& node) {
  std::vector<std::string> faults;
  Config config = withTopics(configured, [&](const std::string& key, const std::string& topic) {
    try {
      return key == "ground_truth_topic" ? topic : node.resolveName(topic);
    } catch (const ros::InvalidNameException& error) {
      std::string fault =
          key + ": expected the name of a topic, got \"" + topic + "\" (" + error.what() + ")";
      // Each radar has the topics of the top level, too.
      if (std::find(faults.begin(), faults.end(), fault) == faults.end()) faults.push_back(std::move(fault));
      return topic;
    }
  });
  if (!faults.empty()) throw ConfigError(std::move(faults));
  return config;
}

/// The handle with another queue.
ros::NodeHandle onQueue(ros::NodeHandle node, ros::CallbackQueue* queue) {
  node.setCallbackQueue(queue);
  return node;
}

/// The frames that the node places in tf.
TfWatch::Frames placedFrames(const Config& config) {
  TfWatch::Frames frames;
  if (config.publish_tf) frames.body = config.invert_tf ? config.odom_frame : config.base_link_frame;
  if (!config.publish_radar_tf) return frames;
  for (const Config& radar : configsOfRadars(config)) frames.radars.insert(radar.radar_frame);
  return frames;
}

/// The types of what is published, by topic, but for what is below `ours`; none without a master.
std::map<std::string, std::string> publishedTypes(const std::string& ours) {
  std::map<std::string, std::string> types;
  ros::master::V_TopicInfo topics;
  // getTopics alone would wait for a master that is gone.
  if (!ros::master::check() || !ros::master::getTopics(topics)) return types;
  for (const ros::master::TopicInfo& topic : topics)
    if (topic.name.rfind(ours + "/", 0) != 0) types[topic.name] = topic.datatype;
  return types;
}

}  // namespace

LiveOdometry::Radar::Radar(const Config& its_config)
    : config(its_config),
      format(pointCloudFormat(config)),
      scan_rate(std::make_unique<TopicRate>(config.radar_topic)),
      trigger_rate(std::make_unique<TopicRate>(config.trigger_topic)) {
  if (config.extrinsics_source == ExtrinsicsSource::kParameters) T_IR = config.odometry.radar.T_IR;
  waiting_for =
      "the first scan" + withName("", config, " of radar ") + ", whose frame_id names the radar for tf";
}

LiveOdometry::LiveOdometry(const ros::NodeHandle& node, const ros::NodeHandle& private_node,
                           const std::string& name)
    : name_(name),
      log_(name),
      configured_(configFromRos(private_node)),
      // Checks again, since remapping and namespace may give two radars one topic.
      config_(withParameters(withResolvedTopics(configured_, node), {})),
      node_(node),
      private_node_(private_node),
      imu_rate_(config_.imu_topic),
      pressure_rate_(config_.barometer_topic),
      odom_rate_(private_node_.resolveName("odom")),
      monitor_(config_),
      publisher_(config_, onQueue(private_node, &input_queue_)),
      frames_(config_, node, name),
      options_(config_.odometry),
      live_config_(config_),
      imu_check_(options_.imu_input_check) {
  for (const Config& radar : configsOfRadars(config_)) radars_.emplace_back(radar);
  if (config_.publish_tf || config_.publish_radar_tf)
    tf_watch_.emplace(onQueue(node, &input_queue_), placedFrames(config_),
                      [this] { return publisher_.tfSent(); });
  if (const std::string fault = faultOfOutput(config_.trajectory_file, {}); !fault.empty())
    ROS_WARN_STREAM(name_ << ": ~save_trajectory will fail, trajectory_file " << fault);
  showEffectiveParameters(private_node_, config_);
  startSessionWhenReady(ros::Time::now());
  addDiagnostics();
  subscribe();
  solver_ = std::thread([this] { solve(); });
  imu_spinner_.emplace(1, &imu_queue_);
  input_spinner_.emplace(1, &input_queue_);
  imu_spinner_->start();
  input_spinner_->start();
  ROS_INFO_STREAM(name_ << ": IMU " << imu_subscriber_.getTopic());
  for (const Radar& radar : radars_) {
    ROS_INFO_STREAM(name_ << ": " << withName("radar", radar.config) << " " << radar.scans.getTopic() << " ("
                          << radar.format.name << "), stamps from " << toString(radar.config.stamp_source));
  }
}

LiveOdometry::~LiveOdometry() {
  // First no more callbacks, then no more solving: the optimisation thread is the last to touch the
  // publishers.
  imu_subscriber_.shutdown();
  barometer_subscriber_.shutdown();
  for (Radar& radar : radars_) {
    radar.scans.shutdown();
    radar.triggers.shutdown();
  }
  reset_server_.shutdown();
  save_server_.shutdown();
  diagnostics_timer_.stop();
  imu_spinner_->stop();
  input_spinner_->stop();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopping_ = true;
  }
  work_to_do_.notify_all();
  if (solver_.joinable()) solver_.join();
}

void LiveOdometry::subscribe() {
  const ros::TransportHints fast = ros::TransportHints().tcpNoDelay();
  ros::NodeHandle imu_node = onQueue(node_, &imu_queue_);
  ros::NodeHandle input_node = onQueue(node_, &input_queue_);
  ros::NodeHandle service_node = onQueue(private_node_, &input_queue_);
  const std::vector<Config> configured_radars = configsOfRadars(configured_);

  for (std::size_t k = 0; k < radars_.size(); ++k) {
    Radar& radar = radars_[k];
    const boost::function<void(const Event<std_msgs::Header>&)> trigger = [this, k](const auto& event) {
      onTrigger(k, event);
    };
    const boost::function<void(const Event<sensor_msgs::PointCloud2>&)> scan = [this, k](const auto& event) {
      onScan(k, event);
    };
    if (radar.config.stamp_source == StampSource::kTrigger)
      radar.triggers = input_node.subscribe<std_msgs::Header>(configured_radars[k].trigger_topic, kImuQueue,
                                                              trigger, ros::VoidConstPtr(), fast);
    radar.scans = input_node.subscribe<sensor_msgs::PointCloud2>(configured_radars[k].radar_topic, kScanQueue,
                                                                 scan, ros::VoidConstPtr(), fast);
  }
  if (!configured_.barometer_topic.empty())
    barometer_subscriber_ =
        input_node.subscribe(configured_.barometer_topic, kImuQueue, &LiveOdometry::onPressure, this, fast);
  imu_subscriber_ = imu_node.subscribe(configured_.imu_topic, kImuQueue, &LiveOdometry::onImu, this, fast);
  reset_server_ = service_node.advertiseService("reset", &LiveOdometry::onReset, this);
  save_server_ = service_node.advertiseService("save_trajectory", &LiveOdometry::onSaveTrajectory, this);
  reconfigure_ =
      std::make_unique<dynamic_reconfigure::Server<LiveParameters>>(reconfigure_mutex_, service_node);
  reconfigure_->setCallback([this](LiveParameters& values, std::uint32_t level) {
    constexpr std::uint32_t kAtStart = ~0U;
    if (level == kAtStart) {
      values = LiveParameters(live_config_);
    } else {
      onReconfigure(values);
    }
  });
  const boost::function<void(const ros::WallTimerEvent&)> tell = [this](const ros::WallTimerEvent&) {
    log_.guarded("diagnostics", [this] { onDiagnosticsTimer(); });
  };
  diagnostics_timer_ = service_node.createWallTimer(ros::WallDuration(kDiagnosticPeriod), tell);
}

void LiveOdometry::addDiagnostics() {
  diagnostics_.emplace(node_, private_node_, name_);
  diagnostics_->setHardwareID("none");
  using Status = LiveMonitor::Status;
  // Before the odometry, which says what is wrong with its IMU.
  diagnostics_->add("input", [this](Status& s) {
    LiveMonitor::RosView view;
    // Before the monitor is locked: the master may take its time.
    if (monitor_.lacksInput()) view.topic_types = publishedTypes(private_node_.getNamespace());
    view.publishers[config_.imu_topic] = imu_subscriber_.getNumPublishers();
    if (barometer_subscriber_)
      view.publishers[config_.barometer_topic] = barometer_subscriber_.getNumPublishers();
    for (const Radar& radar : radars_) {
      view.publishers[radar.config.radar_topic] = radar.scans.getNumPublishers();
      if (radar.triggers) view.publishers[radar.config.trigger_topic] = radar.triggers.getNumPublishers();
    }
    const ros::Time clock = ros::Time::now();
    view.now = toTime(clock);
    view.clock_stands = ros::Time::isSimTime() && !clock.isZero() && clock == last_clock_;
    last_clock_ = clock;
    monitor_.setRosView(std::move(view));
    monitor_.describeInput(s, session_.get().get());
    const std::chrono::duration<double> ran = std::chrono::steady_clock::now() - began_;
    const bool lacks_clock = ros::Time::isSimTime() && clock.isZero();
    if (lacks_clock && !LiveMonitor::describeMissingClock(s, ran.count())) return;  // nothing to log yet
    log_.status(s);
  });
  diagnostics_->add("odometry", [this](Status& s) {
    const Session now = session_.get();
    monitor_.describeOdometry(s, now.get());
    if (const std::string others = tf_watch_ ? tf_watch_->others() : ""; !others.empty())
      s.mergeSummary(diagnostic_msgs::DiagnosticStatus::WARN,
                     "others publish tf to frames of rio_t, which jump between them: " + others +
                         ". Stop them, name other frames (odom_frame, base_link_frame, radar_frame), set "
                         "publish_tf or publish_radar_tf to false, or leave the tf out of the bag that is "
                         "played (bag_topics)");
    log_.status(s);  // a divergence, too: log_.health tells it only while scans come
  });
  if (!config_.barometer_topic.empty())
    diagnostics_->add("barometer", [this](Status& s) { monitor_.describeBarometer(s); });
  if (config_.odometry.platform == Platform::kGroundVehicle)
    diagnostics_->add("ground vehicle", [this](Status& s) { monitor_.describeGroundVehicle(s); });
  if (config_.odometry.landmarks.enabled)
    diagnostics_->add("landmarks", [this](Status& s) { monitor_.describeLandmarks(s); });
  diagnostics_->add("solver", [this](Status& s) { monitor_.describeSolver(s); });
  for (std::size_t k = 0; k < radars_.size(); ++k) {
    const Config& radar = radars_[k].config;
    diagnostics_->add(withName("time offset", radar),
                      [this, k](Status& s) { monitor_.describeTimeOffset(s, k); });
    if (radar.odometry.smoother.estimate_extrinsics != EstimateExtrinsics::kNone)
      diagnostics_->add(withName("extrinsics", radar),
                        [this, k](Status& s) { monitor_.describeExtrinsics(s, k); });
  }
  diagnostics_->add(imu_rate_);
  if (!config_.barometer_topic.empty()) diagnostics_->add(pressure_rate_);
  for (Radar& radar : radars_) {
    diagnostics_->add(*radar.scan_rate);
    if (radar.config.stamp_source == StampSource::kTrigger) diagnostics_->add(*radar.trigger_rate);
  }
}

void LiveOdometry::onDiagnosticsTimer() {
  const bool runs = session_.get() != nullptr;
  if (runs) monitor_.waitFor(frames_.waitingFor());
  const std::string source = frames_.source();
  monitor_.setFrames({{"imu_frame", frames_.imuFrame().value_or("")}, {"base_extrinsics_from", source}});
  if (runs && !source.empty() && std::all_of(radars_.begin(), radars_.end(), Radar::isMounted))
    frames_.stopListening();
  // Before there is an odometry, its silence is no fault.
  if (odom_rate_.hasTicked() && !std::exchange(tells_odom_rate_, true)) diagnostics_->add(odom_rate_);
  // Not update(), which looks at ROS time: also a clock that stands still is worth a diagnosis.
  diagnostics_->force_update();
  log_.faults(session_.get());
}

void LiveOdometry::onReconfigure(LiveParameters& values) {
  std::string refused_because;
  try {
    live_config_ = withParameters(live_config_, values.changesFrom(live_config_));
    publisher_.tune(live_config_);
    monitor_.tune(live_config_.odometry.imu_noise);
    const Tuning tuning = tuningOf(live_config_.odometry);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      apply(tuning, options_);
    }
    if (const Session now = session_.get()) now->tune(tuning);
  } catch (const std::exception& error) {
    refused_because = error.what();
    ROS_ERROR_STREAM(name_ << ": the change of parameters was refused, nothing was changed: "
                           << error.what());
  }
  // Without a master this would wait for one, and the input with it.
  if (refused_because.empty() && ros::master::check()) showEffectiveParameters(private_node_, live_config_);
  monitor_.reconfigured(refused_because);
  values = LiveParameters(live_config_);
}

void LiveOdometry::wakeSolver() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    has_work_ = true;
  }
  work_to_do_.notify_one();
}

void LiveOdometry::startSessionWhenReady(const ros::Time& now) {
  const auto missing = std::find_if_not(radars_.begin(), radars_.end(), Radar::isMounted);
  if (missing != radars_.end()) {
    if (!mounted_since_ && std::any_of(radars_.begin(), radars_.end(), Radar::isMounted))
      mounted_since_ = now;
    const double waited = mounted_since_ ? (now - *mounted_since_).toSec() : 0.0;
    if (waited <= config_.odometry.health.coasting_after) return monitor_.waitFor(missing->waiting_for);
    ROS_WARN_STREAM(name_ << ": starts" << withName("", missing->config, " without radar ")
                          << ", which waits for " << missing->waiting_for);
  }
  takeExtrinsics();
  session_.replace(std::make_shared<LiveSession>(config_, options_));
  monitor_.waitFor("");
}

void LiveOdometry::takeExtrinsics() {
  OdometryOptions options = live_config_.odometry;
  if (radars_.front().T_IR) options.radar.T_IR = *radars_.front().T_IR;
  for (std::size_t k = 0; k < options.radars.size(); ++k)
    if (radars_.at(k).T_IR) options.radars[k].T_IR = *radars_[k].T_IR;
  const std::lock_guard<std::mutex> lock(mutex_);
  options_ = options;
}

void LiveOdometry::reset(const std::string& reason, bool at_once) {
  const InitMode mode = config_.odometry.init_mode;
  const bool wants_rest = mode == InitMode::kStatic || (mode == InitMode::kAuto && !at_once);
  ROS_WARN_STREAM(name_ << ": reset: " << reason << "; starts again" << (wants_rest ? ", stand still" : ""));
  // Without a session there is nothing to reset.
  if (session_.get()) {
    OdometryOptions options;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      options = options_;
    }
    if (at_once) options.init_motion_after = 0.0;
    const auto fresh = std::make_shared<LiveSession>(config_, options);
    session_.replace(fresh);
    // A change of parameters that came meanwhile went to the old session.
    const std::lock_guard<std::mutex> lock(mutex_);
    fresh->tune(tuningOf(options_));
  }
  monitor_.reset(reason);
}

bool LiveOdometry::onReset(std_srvs::Empty::Request& /*request*/, std_srvs::Empty::Response& /*response*/) {
  try {
    reset("asked for by ~reset");
  } catch (const std::exception& error) {
    ROS_ERROR_STREAM(name_ << ": ~reset failed: " << error.what());
    return false;
  }
  return true;
}

bool LiveOdometry::onSaveTrajectory(std_srvs::Trigger::Request& /*request*/,
                                    std_srvs::Trigger::Response& response) {
  try {
    const Session now = session_.get();
    std::size_t stride = 1;
    const Trajectory trajectory = now ? now->trajectory(&stride) : Trajectory();
    if (trajectory.empty()) throw std::runtime_error("no optimised pose yet");
    // With its folder, since the caller may not know where the node runs.
    const std::string file = std::filesystem::absolute(config_.trajectory_file).string();
    if (const std::string fault = faultOfOutput(file, {}); !fault.empty()) throw std::runtime_error(fault);
    writeTum(file, trajectory);
    response.success = 1U;
    response.message = std::to_string(trajectory.size()) + " poses in " + file;
    if (monitor_.wasReset()) response.message += ", all since the last reset";
    if (stride > 1)
      response.message += ", one in " + std::to_string(stride) + ": more than " +
                          std::to_string(LiveSession::kMaxPoses) + " are not kept";
  } catch (const std::exception& error) {
    response.success = 0U;
    response.message = error.what();
  }
  return true;
}

void LiveOdometry::solve() {
  Session published;                     // whose results ~path holds
  std::vector<RadarKnowledge> reported;  // of the radars of that session
  bool has_reported_start = false;       // of that session
  while (true) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      work_to_do_.wait(lock, [this] { return has_work_ || stopping_; });
      if (stopping_) return;
      has_work_ = false;
    }
    const Session now = session_.get();
    if (!now) continue;
    if (published != now) {
      if (published) publisher_.clear();
      published = now;
      reported.assign(radars_.size(), RadarKnowledge());
      has_reported_start = false;
    }
    try {
      bool more = false;
      for (const LiveSession::Result& result : now->process(&more)) {
        LivePublisher::Frames frames{
            frames_.imuFrame().value_or(config_.base_link_frame), frames_.imuInBody(), {}, {}};
        if (result.result.updated) frames.body = frames_.place(*now, result.result.state);
        frames.world = now->world();
        const bool current = session_.speak(Speaker::kOptimisation, now, [&] {
          // Not a fault of the estimator: `stamp - t_O` of an odd stamp may be no time that ROS can hold.
          log_.guarded("a result was not published", [&] { publisher_.result(result, frames); });
          log_.health(result.result);
          monitor_.result(result);
        });
        if (!current) break;  // reset meanwhile: not of this world any more
      }
      if (!has_reported_start && now->odometry().start()) {
        has_reported_start = true;
        const std::string waiting_for = frames_.waitingFor();
        ROS_INFO_STREAM(name_ << ": started from " << toString(now->odometry().start()->from) << "; ~odom "
                              << (waiting_for.empty() ? "is published" : "waits for " + waiting_for));
      }
      for (std::size_t k = 0; k < radars_.size(); ++k)
        log_.doppler(radars_[k].config, now->odometry().radarKnowledge(k), &reported[k]);
      if (more) wakeSolver();  // one scan at a time, so that stopping and resets are heeded between them
    } catch (const std::exception& error) {
      ROS_ERROR_STREAM(name_ << ": the estimator failed: " << error.what());
      if (session_.get() == now) reset(std::string("the estimator failed: ") + error.what());
    }
  }
}

}  // namespace rio_t
