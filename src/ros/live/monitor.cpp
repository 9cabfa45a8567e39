#include "rio_t/ros/live/monitor.h"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <algorithm>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>

#include "../text.h"
#include "rio_t/core/sigmas.h"
#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Windows by which the solver is judged: 2 s at ten scans a second.
constexpr std::size_t kWindowsJudged = 20;
/// Calls of describeInput, seconds that is, over which the use of a radar's scans is judged.
constexpr std::size_t kInputsJudged = 4;
/// Calls of describeOdometry, seconds that is, after which a verdict that is not good is a warning: one bad
/// second early in a run is a large share of it.
constexpr std::size_t kVerdictHolds = 5;
/// 2007-01-01. ROS began in that year, so no ROS time is earlier, but for that of a simulation.
constexpr Time kBeginOfRos = Time::fromNanoseconds(1'167'609'600'000'000'000);
/// No message comes then, and no sensor is at fault.
constexpr const char* kClockStands =
    "ROS time stands still: /clock is paused, or its publisher has ended (a bag?)";
/// A scan waits until the IMU covers it, so a pause of the IMU fills the queue, too.
constexpr const char* kScansWaitedTooLong =
    "scans waited too long for the IMU or the solver, and the oldest were dropped (max_queued_scans)";

double velocitySigma(const NavigationState& state) {
  return sigmasOf(state.covariance).segment<3>(StateBlock::kV).maxCoeff();
}

/// Whether a scan could not be used because it came before tf had named the radar.
bool isBeforeExtrinsics(const std::string& reason) {
  return reason == "scan_before_extrinsics" || reason == "frame_not_usable";
}

/// What to do about windows that keep ending so.
std::string advice(SolverTermination termination) {
  constexpr const char* kAdvice[] = {
      "", "at the bound of the offset: max_time_offset is too small, or the stamps are wrong",
      "at max_iterations", "without a step that lowers the cost"};
  static_assert(std::size(kAdvice) == static_cast<std::size_t>(SolverTermination::kNoDecrease) + 1);
  return kAdvice[static_cast<std::size_t>(termination)];
}

}  // namespace

std::string noisyImu(const MeasuredImuNoise& noise, const ImuNoise& configured) {
  std::ostringstream text;
  text << "the IMU vibrates or is noisier than configured: accelerometer " << noise.accel_density
       << " m/s^2/sqrt(Hz), imu_accel_noise_density " << configured.accel_density << "; gyro "
       << noise.gyro_density << " rad/s/sqrt(Hz), imu_gyro_noise_density " << configured.gyro_density
       << ". The estimate takes the measured noise. A softer mount makes it better.";
  return text.str();
}

LiveMonitor::LiveMonitor(const Config& config) : config_(config), collector_(config) {
  config_.mode = RunMode::kOnline;  // the mode is for bags
  for (Config& radar : configsOfRadars(config)) radars_.emplace_back(std::move(radar));
}

std::string LiveMonitor::called(const Radar& radar) {
  return radar.config.radar_name.empty() ? "the radar" : "radar " + radar.config.radar_name;
}

void LiveMonitor::Latency::add(double seconds) {
  worst = std::max(worst, seconds);
  sum += seconds;
  ++count;
}

void LiveMonitor::imu() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++imu_.count;
}

void LiveMonitor::scan(std::size_t radar) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++radars_.at(radar).scans.count;
}

void LiveMonitor::trigger(std::size_t radar) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++radars_.at(radar).triggers.count;
}

void LiveMonitor::zeroTrigger(std::size_t radar) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++radars_.at(radar).dropped["trigger_stamp_zero"];
  collector_.addZeroTrigger(radar);
}

void LiveMonitor::odometry(const NavigationState& state, double latency) {
  const std::lock_guard<std::mutex> lock(mutex_);
  newest_state_ = state;
  odometry_latency_.add(latency);
}

void LiveMonitor::imuDropped(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++imu_dropped_[reason];
}

void LiveMonitor::imuUsable(Time stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++usable_imu_.count;
  imu_stamp_ = stamp;
  collector_.addImu(stamp);
}

void LiveMonitor::imuUnusable(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  why_unusable_ = why;
}

void LiveMonitor::dropped(std::size_t radar, const std::string& reason, std::uint64_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Radar& of = radars_.at(radar);
  of.dropped[reason] += count;
  if (isBeforeExtrinsics(reason)) {
    of.early += count;
  } else if (reason == "points_not_finite") {
    collector_.addNotFinite(radar, count);
  } else {
    collector_.addDropped(radar, reason, count);
  }
}

void LiveMonitor::padding(std::size_t radar, std::uint64_t points) {
  const std::lock_guard<std::mutex> lock(mutex_);
  collector_.addPadding(radar, points);
}

void LiveMonitor::result(const LiveSession::Result& result) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Radar& radar = radars_.at(result.result.scan.radar);
  collector_.add(result.result);
  barometer_.add(result.result);
  if (result.result.used) {
    ++radar.used;
    last_used_ = result.result.scan.stamp;
    age_of_used_ = newest_state_ ? newest_state_->time - *last_used_ : 0.0;
  } else if (!result.result.rejected_because.empty()) {
    ++radar.dropped[result.result.rejected_because];
    // Once the estimate runs, such a scan has a stamp of another clock.
    if (result.result.rejected_because == "before_initialization" && !newest_state_) ++radar.early;
  }
  if (!result.result.updated) return;
  ++updates_;
  const SolverTermination termination = result.result.solver_termination;
  ++terminations_[termination];
  last_terminations_.push_back(termination);
  if (last_terminations_.size() > kWindowsJudged) last_terminations_.pop_front();
  scan_latency_.add(result.latency);
  last_update_ = result;
  last_update_->result.scan.points.clear();  // not needed here
  radar.last_update = last_update_;
}

bool LiveMonitor::wasReset() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return resets_ > 0;
}

void LiveMonitor::reset(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++resets_;
  collector_ = EvidenceCollector(config_);
  imu_before_session_ = imu_.count;
  not_usable_before_session_ = countOf(imu_dropped_, kImuNotUsable);
  last_reset_ = reason;
  last_terminations_.clear();
  last_update_.reset();
  last_used_.reset();
  age_of_used_ = 0.0;
  newest_state_.reset();
  barometer_.last.reset();
  for (Radar& radar : radars_) {
    radar.last_update.reset();
    radar.accounts.clear();
  }
}

void LiveMonitor::waitFor(const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_for_ = what;
}

void LiveMonitor::setFrames(const std::map<std::string, std::string>& frames) {
  const std::lock_guard<std::mutex> lock(mutex_);
  frames_ = frames;
}

bool LiveMonitor::lacksInput() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!config_.barometer_topic.empty() && barometer_.messages.count == 0) return true;
  return imu_.count == 0 || std::any_of(radars_.begin(), radars_.end(), [](const Radar& radar) {
           return radar.scans.count == 0 ||
                  (radar.config.stamp_source == StampSource::kTrigger && radar.triggers.count == 0);
         });
}

void LiveMonitor::setRosView(RosView view) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ros_ = std::move(view);
}

std::string LiveMonitor::whatIsPublished(const std::string& topic, const std::string& expected) const {
  const auto found = ros_.topic_types.find(topic);
  if (found != ros_.topic_types.end()) {
    // "*": whatever the publisher has.
    if (found->second == expected || found->second == "*") return "";
    return ", which is published as " + found->second + ", expected " + expected;
  }
  std::string others;
  for (const auto& [other, type] : ros_.topic_types)
    if (type == expected) appendItem(&others, other);
  return others.empty() ? "" : ", which nobody publishes; topics of type " + expected + ": " + others;
}

void LiveMonitor::tune(const ImuNoise& configured) {
  const std::lock_guard<std::mutex> lock(mutex_);
  config_.odometry.imu_noise = configured;
}

void LiveMonitor::reconfigured(const std::string& refused_because) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++reconfigurations_;
  refused_because_ = refused_because;
}

Diagnosis LiveMonitor::addDiagnosis(Status& status, const LiveSession& session, std::string* why) const {
  RunEvidence evidence = collector_.evidence(session.odometry(), session.start());
  evidence.imu_count = imu_.count - imu_before_session_;
  if (const std::uint64_t all = countOf(imu_dropped_, kImuNotUsable); all > not_usable_before_session_)
    evidence.input_faults[kImuNotUsable] = all - not_usable_before_session_;
  Diagnosis diagnosis = diagnose(evidence, config_);
  if (evidence.initialized) status.add("verdict", toString(diagnosis.verdict));
  const auto came = [](const RadarSummary& radar) { return radar.scans_total > 0; };
  const bool none_came = std::none_of(evidence.radars.begin(), evidence.radars.end(), came);
  // Nothing else that is wrong keeps the scans away.
  if (none_came)
    *why = whyCoasting();
  else if (!diagnosis.causes.empty())
    *why = ". Likely cause: " + diagnosis.causes.front().text + " " + diagnosis.causes.front().remedy;
  for (std::size_t i = 0; i < diagnosis.causes.size(); ++i) {
    const Cause& cause = diagnosis.causes[i];
    status.add("likely_cause_" + std::to_string(i + 1), cause.text + " " + cause.remedy);
  }
  if (!diagnosis.causes.empty() || !evidence.initialized) return diagnosis;
  std::size_t red = 0;
  for (const Check& check : diagnosis.checks) {
    if (check.good()) continue;
    if (red == 0 && !none_came) *why = ": " + describe(check);
    status.add("red_check_" + std::to_string(++red), describe(check));
  }
  return diagnosis;
}

void LiveMonitor::describeOdometry(Status& status, const LiveSession* session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool initialized = session != nullptr && session->odometry().initialized();
  status.add("initialized", initialized ? "true" : "false");
  status.add("resets", resets_);
  status.add("last_reset_because", last_reset_);
  if (resets_ > 0)
    status.add("after_reset", config_.reset_pose == ResetPose::kKeep
                                  ? "goes on from the last pose (reset_pose: keep)"
                                  : "starts at the origin (reset_pose: zero)");
  for (const auto& [key, value] : frames_) status.add(key, value);
  if (reconfigurations_ > 0) {
    status.add("reconfigurations", reconfigurations_);
    status.add("last_reconfiguration", refused_because_.empty() ? "done" : "refused: " + refused_because_);
  }
  std::string why;
  const Diagnosis diagnosis = session != nullptr ? addDiagnosis(status, *session, &why) : Diagnosis();
  calls_not_good_ = initialized && diagnosis.verdict != RunVerdict::kGood ? calls_not_good_ + 1 : 0;
  if (ros_.clock_stands) {
    status.summary(DiagnosticStatus::WARN, kClockStands);
    return;
  }
  if (initialized && !imu_fault_.empty()) {
    status.summary(DiagnosticStatus::ERROR, imu_fault_ + ": no odometry is published");
    return;
  }
  if (!initialized || !waiting_for_.empty()) {
    const std::string what = waiting_for_.empty() ? session->odometry().waitingFor().text : waiting_for_;
    status.add("waiting_for", what);
    status.summary(DiagnosticStatus::WARN, "initialising, waiting for " + what);
    return;
  }
  const RadarInertialOdometry& odometry = session->odometry();
  const Health health = odometry.health();
  const std::map<std::string, std::uint64_t> faults = odometry.faults();
  const std::optional<RadarInertialOdometry::Start> start = session->start();
  if (start) status.add("initialized_from", toString(start->from));
  status.add("health", toString(health));
  status.add("divergences", countOf(faults, "diverged"));
  status.add("reinitializations", countOf(faults, "reinitialized"));
  if (newest_state_) {
    // Not those of the last scan: they would stand still once no more scans come.
    status.add("speed_m_s", newest_state_->v_W.norm());
    status.add("velocity_sigma_m_s", velocitySigma(*newest_state_));
    const Time since = last_used_ ? *last_used_ : start ? start->time : newest_state_->time;
    status.add("seconds_since_a_scan_was_used", std::max(0.0, newest_state_->time - since));
  }
  // The health comes first: where no scan was ever used, the IMU alone leads astray, too.
  if (health == Health::kDiverged) {
    status.summary(DiagnosticStatus::ERROR,
                   (config_.odometry.health.on_divergence == OnDivergence::kReinitialize
                        ? "diverged: do not trust the estimate; re-initialising"
                        : "diverged: do not trust the estimate; call ~reset") +
                       why);
  } else if (health == Health::kCoasting && usesScansLate()) {
    status.summary(DiagnosticStatus::ERROR,
                   "scans are used " + fixedText(age_of_used_, 1) +
                       " s after their stamps, and the IMU alone carries the estimate from there: they come "
                       "late, their clock is behind that of the IMU, or the solver is slow "
                       "(scan_to_optimised_mean_ms of the status solver)");
  } else if (health == Health::kCoasting) {
    // Once a scan was used, the causes are of the whole run, and may be over.
    status.summary(DiagnosticStatus::ERROR, "no scan is used: the IMU alone carries the estimate" +
                                                (last_used_ ? whyCoasting() : why));
  } else if (!last_update_) {
    // No fault yet: the first scan of a run is used some moments after its start.
    status.summary(DiagnosticStatus::OK, "initialised, no scan used yet");
  } else if (calls_not_good_ > kVerdictHolds) {
    status.summary(DiagnosticStatus::WARN, "running, but the run is " + toString(diagnosis.verdict) + why);
  } else {
    status.summary(DiagnosticStatus::OK, "running");
  }
}

std::optional<LiveMonitor::Finding> LiveMonitor::describeRadar(Status& status, Radar& radar,
                                                               bool initialized) const {
  const Config& config = radar.config;
  const std::string key = prefixOf(radar.config.radar_name);
  const bool is_silent = radar.scans.isSilent(kSilentCalls);
  status.add(key + "scans", radar.scans.count);
  status.add(key + "scans_used", radar.used);
  for (const auto& [reason, count] : radar.dropped) status.add(key + "dropped_" + reason, count);
  const bool wants_trigger = config.stamp_source == StampSource::kTrigger;
  if (wants_trigger) status.add(key + "triggers", radar.triggers.count);

  const std::optional<std::string> mostly_rejected = judgeUse(radar, initialized);
  const std::string of = radars_.size() == 1 ? "" : called(radar) + ": ";
  if (radar.scans.count == 0)
    return Finding{DiagnosticStatus::ERROR,
                   of + "no scan yet on " + config.radar_topic +
                       whatIsPublished(config.radar_topic, "sensor_msgs/PointCloud2")};
  if (wants_trigger && radar.triggers.count == 0) {
    return Finding{DiagnosticStatus::ERROR,
                   of + "no trigger yet on " + config.trigger_topic +
                       whatIsPublished(config.trigger_topic, "std_msgs/Header") +
                       ", and stamp_source is trigger; header and arrival need none"};
  }
  if (is_silent)
    return Finding{DiagnosticStatus::WARN, called(radar) + " is silent, topic " + config.radar_topic};
  if (mostly_rejected) return Finding{DiagnosticStatus::WARN, of + *mostly_rejected};
  return std::nullopt;
}

std::string LiveMonitor::useBetween(const Account& then, const Account& now) {
  std::pair<std::string, std::uint64_t> most;
  for (const auto& [reason, count] : now.dropped) {
    if (isBeforeExtrinsics(reason) || reason == "points_not_finite") continue;  // the latter counts points
    const std::uint64_t fresh = count - countOf(then.dropped, reason);
    if (fresh > most.second) most = {reason, fresh};
  }
  return std::to_string(now.used - then.used) + " of the last " + std::to_string(now.usable - then.usable) +
         " scans were used" + (most.first.empty() ? "" : ", rejected mostly as " + most.first);
}

std::string LiveMonitor::whyCoasting() const {
  std::string why;
  for (const Radar& radar : radars_) {
    const auto since = std::find_if(radar.accounts.begin(), radar.accounts.end(), [&](const Account& then) {
      return then.used == radar.accounts.back().used;
    });
    // One was used in the last second.
    if (since == radar.accounts.end() || std::next(since) == radar.accounts.end()) continue;
    const Account& now = radar.accounts.back();
    const std::string of = radars_.size() == 1 ? "" : called(radar) + ": ";
    appendItem(&why,
               now.usable > since->usable ? of + useBetween(*since, now)
                                          : "no scan comes on " + radar.config.radar_topic,
               "; ");
  }
  return why.empty() ? "" : "; " + why;
}

bool LiveMonitor::usesScansLate() const {
  const double coasting_after = config_.odometry.health.coasting_after;
  if (!last_used_ || !newest_state_ || age_of_used_ <= coasting_after) return false;
  const double since_use = newest_state_->time - *last_used_ - age_of_used_;
  return since_use <= coasting_after;
}

std::optional<std::string> LiveMonitor::judgeUse(Radar& radar, bool initialized) {
  if (!initialized) {
    radar.accounts.clear();
    return std::nullopt;
  }
  radar.accounts.push_back({radar.scans.count - radar.early, radar.used, radar.dropped});
  if (radar.accounts.size() <= kInputsJudged) return std::nullopt;
  const Account then = std::move(radar.accounts.front());
  radar.accounts.pop_front();
  const Account& now = radar.accounts.back();
  const std::uint64_t used = now.used - then.used;
  if (now.usable < then.usable + kInputsJudged || 2 * used >= now.usable - then.usable) return std::nullopt;
  return useBetween(then, now);
}

void LiveMonitor::describeInput(Status& status, const LiveSession* session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool none_came = imu_.isSilent(1), none_is_usable = usable_imu_.isSilent(1);
  imu_fault_ = ros_.clock_stands ? ""
               : none_came       ? "the IMU is silent"
               : none_is_usable  ? "no IMU message can be used (" + why_unusable_ + ")"
                                 : "";
  status.add("imu_messages", imu_.count);
  for (const auto& [reason, count] : imu_dropped_) status.add("dropped_" + reason, count);
  if (session != nullptr) {
    for (const auto& [name, count] : session->odometry().faults()) {
      // Reported with the odometry.
      if (name != "diverged" && name != "reinitialized") status.add("fault_" + name, count);
    }
  }
  const ImuNoise& configured = config_.odometry.imu_noise;
  const MeasuredImuNoise noise = session != nullptr ? session->odometry().imuNoise() : MeasuredImuNoise();
  status.add("imu_accel_noise_measured", noise.accel_density);
  status.add("imu_gyro_noise_measured", noise.gyro_density);

  const bool initialized = session != nullptr && session->odometry().initialized();
  Finding radars;
  bool one_works = false;
  std::uint64_t queue_full = 0;
  for (Radar& radar : radars_) {
    const std::optional<Finding> finding = describeRadar(status, radar, initialized);
    one_works = one_works || !finding;
    if (finding) appendItem(&radars.text, finding->text, "; ");
    if (finding) radars.level = std::max(radars.level, finding->level);
    queue_full += countOf(radar.dropped, "queue_full");
  }
  // What one radar lacks is no error while another works.
  if (one_works) radars.level = std::min(radars.level, std::uint8_t{DiagnosticStatus::WARN});

  if (imu_.count == 0) {
    status.summary(DiagnosticStatus::ERROR, "no IMU message yet on " + config_.imu_topic +
                                                whatIsPublished(config_.imu_topic, "sensor_msgs/Imu"));
  } else if (ros_.clock_stands) {
    status.summary(DiagnosticStatus::WARN, kClockStands);
  } else if (!imu_fault_.empty()) {
    status.summary(DiagnosticStatus::ERROR, imu_fault_ + ", topic " + config_.imu_topic);
  } else if (!radars.text.empty()) {
    status.summary(radars.level, radars.text);
  } else if (queue_full > queue_full_reported_) {
    status.summary(DiagnosticStatus::WARN, kScansWaitedTooLong);
  } else if (noise.isFarAbove(configured)) {
    status.summary(DiagnosticStatus::WARN, noisyImu(noise, configured));
  } else {
    status.summary(DiagnosticStatus::OK,
                   radars_.size() == 1 ? "IMU and radar are coming" : "IMU and radars are coming");
  }
  queue_full_reported_ = queue_full;
  for (const auto& [topic, count] : ros_.publishers) {
    if (count < 2) continue;
    status.mergeSummary(DiagnosticStatus::WARN,
                        "topic " + topic + " has " + std::to_string(count) +
                            " publishers, and rio_t takes them for one sensor: stop one of them, or remap it "
                            "to a topic of its own");
  }
  if (imu_stamp_ && *imu_stamp_ < kBeginOfRos && ros_.now >= kBeginOfRos)
    status.mergeSummary(
        DiagnosticStatus::WARN,
        "topic " + config_.imu_topic + " has stamps of the year 1970 (" + fixedText(*imu_stamp_ - Time(), 0) +
            " s, the uptime of a sensor?), and so have ~odom and tf: other nodes look for them "
            "at the ROS time of today. Let the driver stamp with ROS time");
}

bool LiveMonitor::describeMissingClock(Status& status, double seconds) {
  if (seconds > kClockPatience) {
    status.mergeSummary(DiagnosticStatus::WARN, "use_sim_time is true, and nothing publishes /clock");
    return true;
  }
  status.summary(DiagnosticStatus::WARN, "waits for /clock, since use_sim_time is true");
  return false;
}

void LiveMonitor::describeSolver(Status& status) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto latency = [&](const std::string& name, const Latency& of) {
    status.add(name + "_mean_ms", of.count > 0 ? 1e3 * of.sum / static_cast<double>(of.count) : 0.0);
    status.add(name + "_worst_ms", 1e3 * of.worst);
  };
  latency("imu_to_odometry", odometry_latency_);
  latency("scan_to_optimised", scan_latency_);
  status.add("updates", updates_);
  for (const auto& [termination, count] : terminations_) status.add(toString(termination), count);
  if (!last_update_) {
    status.summary(DiagnosticStatus::OK, "nothing to solve yet");
    return;
  }
  status.add("iterations", last_update_->result.solver_iterations);
  status.add("termination", toString(last_terminations_.back()));
  // A window gets a few iterations from where the last one ended: one of them that does not converge is no
  // fault.
  const auto ended = [&](SolverTermination termination) {
    return std::count(last_terminations_.begin(), last_terminations_.end(), termination);
  };
  const auto full = static_cast<std::ptrdiff_t>(kWindowsJudged);
  const std::ptrdiff_t converged = ended(SolverTermination::kConverged);
  if (last_terminations_.size() < kWindowsJudged || 2 * converged >= full) {
    status.summary(DiagnosticStatus::OK, "solving");
    return;
  }
  SolverTermination worst = SolverTermination::kAtBound;
  for (const SolverTermination other : {SolverTermination::kIterationLimit, SolverTermination::kNoDecrease})
    if (ended(other) > ended(worst)) worst = other;
  status.summary(DiagnosticStatus::WARN, std::to_string(ended(worst)) + " of the last " +
                                             std::to_string(full) + " windows ended " + advice(worst));
}

}  // namespace rio_t
