#include "rio_t/ros/live/live_log.h"

#include <diagnostic_msgs/DiagnosticStatus.h>
#include <ros/console.h>

#include <algorithm>
#include <cctype>
#include <iterator>

#include "radar_texts.h"

namespace rio_t {
namespace {

/// Whether `health` logs what this counter counts.
bool isToldByHealth(const std::string& counter) {
  return counter == "diverged" || counter == "reinitialized" || counter == "ground_vehicle_contradicted";
}

/// Whether it counts what the estimate does, and no fault of the input.
bool isOfEstimate(const std::string& counter) {
  return counter == "time_offset_step" || counter == "landmarks_dropped";
}

}  // namespace

bool LiveLog::isTimeToTell(const std::string& kind, double period) {
  const auto now = std::chrono::steady_clock::now();
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto [told, is_first] = told_at_.try_emplace(kind, now);
  if (!is_first && now - told->second < std::chrono::duration<double>(period)) return false;
  told->second = now;
  return true;
}

bool LiveLog::warn(const std::string& kind, const std::string& text, double period) {
  if (!isTimeToTell(kind, period)) return false;
  ROS_WARN_STREAM(name_ << ": " << text);
  return true;
}

bool LiveLog::error(const std::string& kind, const std::string& text, double period) {
  if (!isTimeToTell(kind, period)) return false;
  ROS_ERROR_STREAM(name_ << ": " << text);
  return true;
}

void LiveLog::status(const LiveMonitor::Status& status) {
  constexpr double kStatusPeriod = 60.0;  // [s] A status may stay for as long as the node runs.
  // Two statuses may have the same text. The numbers in it change all the time.
  std::string problem;
  std::copy_if(status.message.begin(), status.message.end(), std::back_inserter(problem),
               [](unsigned char c) { return std::isdigit(c) == 0 && c != '.'; });
  using Level = diagnostic_msgs::DiagnosticStatus;
  if (status.level == Level::OK) return;
  if (status.level == Level::WARN) {
    warn(problem, status.message, kStatusPeriod);
  } else {
    error(problem, status.message, kStatusPeriod);
  }
}

void LiveLog::health(const ScanResult& result) {
  if (result.reinitialized)
    ROS_WARN_STREAM(name_ << ": re-initialised in motion; position and heading go on");
  if (result.ground_vehicle && result.ground_vehicle->is_contradicted)
    ROS_WARN_STREAM(name_ << ": " << kGroundVehicleContradicted);
  if (result.health == Health::kDiverged)
    error("diverged",
          std::string("diverged, ") +
              (result.is_contradicted ? "radar and IMU contradict each other" : "the velocity is lost") +
              ": do not trust the estimate (see diagnostics, on_divergence)");
}

void LiveLog::faults(const std::shared_ptr<LiveSession>& session) {
  if (!session) return;
  if (faults_of_.lock() != session) {
    faults_of_ = session;
    faults_told_.clear();
  }
  for (const auto& [fault, count] : session->odometry().faults()) {
    if (isToldByHealth(fault)) continue;
    const std::string kind = (isOfEstimate(fault) ? "counted " : "input fault ") + fault;
    std::uint64_t& told = faults_told_[fault];
    if (count != told && warn(kind, kind + ", " + std::to_string(count) + " so far")) told = count;
  }
}

void LiveLog::doppler(const Config& radar, const RadarKnowledge& now, RadarKnowledge* reported) const {
  const auto changed = [](const KnownDoppler& known, const KnownDoppler& before) {
    return known.source != DopplerSource::kUnknown &&
           (known.source != before.source || known.value != before.value);
  };
  const auto from = [](const KnownDoppler& known) {
    return known.source == DopplerSource::kGiven ? "given" : "read off the data";
  };
  const std::string whose = withName(name_ + ": Doppler of radar", radar);
  const KnownDoppler& step = now.doppler_step;
  if (changed(step, reported->doppler_step)) {
    if (step.value > 0.0) {
      ROS_INFO_STREAM(whose << " comes in steps of " << step.value << " m/s, " << from(step));
    } else {
      ROS_INFO_STREAM(whose << " has no steps, " << from(step));
    }
  }
  const KnownDoppler& span = now.doppler_span;
  if (changed(span, reported->doppler_span))
    ROS_INFO_STREAM(whose << " spans " << span.value << " m/s, " << from(span)
                          << ": faster points come back on the other side");
  *reported = now;
}

}  // namespace rio_t
