#include "rio_t/ros/live/monitor.h"

#include <diagnostic_msgs/DiagnosticStatus.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "rio_t/factors/state_block.h"

namespace rio_t {
namespace {

using diagnostic_msgs::DiagnosticStatus;

/// Windows by which the solver is judged: 2 s at ten scans a second.
constexpr std::size_t kWindowsJudged = 20;

double velocitySigma(const NavigationState& state) {
  const Eigen::Vector3d variances = state.covariance.diagonal().segment<3>(StateBlock::kV);
  return std::sqrt(std::max(0.0, variances.maxCoeff()));
}

/// What to do about windows that keep ending so.
std::string advice(SolverTermination termination) {
  switch (termination) {
    case SolverTermination::kAtBound:
      return "at the bound of the offset: max_time_offset is too small, or the stamps are wrong";
    case SolverTermination::kIterationLimit:
      return "at max_iterations";
    case SolverTermination::kNoDecrease:
      return "without a step that lowers the cost";
    case SolverTermination::kConverged:
      break;
  }
  return "";
}

}  // namespace

void LiveMonitor::Latency::add(double seconds) {
  worst = std::max(worst, seconds);
  sum += seconds;
  ++count;
}

void LiveMonitor::imu() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++imu_.count;
}

void LiveMonitor::scan() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++scans_.count;
}

void LiveMonitor::trigger() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++triggers_.count;
}

void LiveMonitor::odometry(double latency) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++odometry_.count;
  odometry_latency_.add(latency);
}

void LiveMonitor::dropped(const std::string& reason, std::uint64_t count) {
  const std::lock_guard<std::mutex> lock(mutex_);
  dropped_[reason] += count;
}

void LiveMonitor::result(const LiveSession::Result& result) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_scan_ = result.result.scan.stamp;
  if (result.result.used) {
    ++used_;
    last_used_ = last_scan_;
  } else if (!result.result.rejected_because.empty()) {
    ++dropped_[result.result.rejected_because];
  }
  if (!result.result.updated) return;
  ++updates_;
  const SolverTermination termination = result.result.solver_termination;
  ++terminations_[termination];
  last_terminations_.push_back(termination);
  if (last_terminations_.size() > kWindowsJudged) last_terminations_.pop_front();
  scan_latency_.add(result.latency);
  solver_failure_.clear();
  last_update_ = result;
  last_update_->result.scan.points.clear();  // not needed here
}

void LiveMonitor::solverFailed(const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  solver_failure_ = what;
}

void LiveMonitor::reset(const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++resets_;
  last_reset_ = reason;
  last_terminations_.clear();
  last_update_.reset();
  last_used_.reset();
}

void LiveMonitor::waitFor(const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_for_ = what;
}

void LiveMonitor::describeOdometry(Status& status, const LiveSession* session) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool initialized = session != nullptr && session->odometry().initialized();
  status.add("initialized", initialized ? "true" : "false");
  status.add("resets", resets_);
  status.add("last_reset_because", last_reset_);
  if (!initialized) {
    const std::string what = session == nullptr ? waiting_for_ : session->odometry().waitingFor();
    status.add("waiting_for", what);
    status.summary(DiagnosticStatus::WARN, "initialising, waiting for " + what);
    return;
  }
  if (!last_update_) {
    status.summary(DiagnosticStatus::WARN, "initialised, no scan used yet");
    return;
  }
  const NavigationState& state = last_update_->result.state;
  const RadarInertialOdometry& odometry = session->odometry();
  const Health health = odometry.health();
  const std::map<std::string, std::uint64_t> faults = odometry.faults();
  const auto count = [&](const char* name) {
    const auto found = faults.find(name);
    return found == faults.end() ? std::uint64_t{0} : found->second;
  };
  status.add("initialized_from", toString(odometry.start()->from));
  status.add("health", toString(health));
  status.add("divergences", count("diverged"));
  status.add("reinitializations", count("reinitialized"));
  status.add("speed_m_s", state.v_W.norm());
  status.add("velocity_sigma_m_s", velocitySigma(state));
  status.add("seconds_since_a_scan_was_used", last_used_ ? last_scan_ - *last_used_ : 0.0);
  if (health == Health::kDiverged) {
    status.summary(DiagnosticStatus::ERROR,
                   config_.odometry.health.on_divergence == OnDivergence::kReinitialize
                       ? "diverged: do not trust the estimate; finding the state anew"
                       : "diverged: do not trust the estimate; call ~reset");
  } else if (health == Health::kCoasting) {
    status.summary(DiagnosticStatus::ERROR, "no scan is used: the IMU alone carries the estimate");
  } else {
    status.summary(DiagnosticStatus::OK, "running");
  }
}

std::string noisyImu(const MeasuredImuNoise& noise, const ImuNoise& told) {
  std::ostringstream text;
  text << "the IMU vibrates or is noisier than told: accelerometer " << noise.accel_density
       << " m/s^2/sqrt(Hz), imu_accel_noise_density " << told.accel_density << "; gyro " << noise.gyro_density
       << " rad/s/sqrt(Hz), imu_gyro_noise_density " << told.gyro_density
       << ". The estimate takes the measured noise. A softer mount makes it better.";
  return text.str();
}

void LiveMonitor::describeInput(Status& status, const LiveSession* session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const Clock::time_point now = Clock::now();
  const double seconds = std::max(1e-3, std::chrono::duration<double>(now - told_).count());
  told_ = now;
  const auto hertz = [&](Rate& rate) {
    const double value = static_cast<double>(rate.count - rate.told) / seconds;
    rate.told = rate.count;
    return value;
  };
  const double imu_rate = hertz(imu_);
  const double scan_rate = hertz(scans_);
  const double trigger_rate = hertz(triggers_);
  status.add("imu_rate_hz", imu_rate);
  status.add("scan_rate_hz", scan_rate);
  status.add("odometry_rate_hz", hertz(odometry_));
  status.add("imu_messages", imu_.count);
  status.add("scans", scans_.count);
  status.add("scans_used", used_);
  for (const auto& [reason, count] : dropped_) status.add("dropped_" + reason, count);
  if (session != nullptr) {
    for (const auto& [name, count] : session->odometry().faults()) {
      // Told with the odometry.
      if (name != "diverged" && name != "reinitialized") status.add("fault_" + name, count);
    }
  }
  const ImuNoise& told = config_.odometry.imu_noise;
  const MeasuredImuNoise noise = session != nullptr ? session->odometry().imuNoise() : MeasuredImuNoise();
  status.add("imu_accel_noise_measured", noise.accel_density);
  status.add("imu_gyro_noise_measured", noise.gyro_density);
  const bool wants_trigger = config_.stamp_source == StampSource::kTrigger;
  if (wants_trigger) status.add("trigger_rate_hz", trigger_rate);

  const auto full = dropped_.find("queue_full");
  const std::uint64_t queue_full = full == dropped_.end() ? 0 : full->second;
  if (imu_.count == 0) {
    status.summary(DiagnosticStatus::ERROR, "no IMU message yet on " + config_.imu_topic);
  } else if (scans_.count == 0) {
    status.summary(DiagnosticStatus::ERROR, "no scan yet on " + config_.radar_topic);
  } else if (wants_trigger && triggers_.count == 0) {
    status.summary(DiagnosticStatus::ERROR,
                   "no trigger yet on " + config_.trigger_topic +
                       ", and stamp_source is trigger; header and arrival need none");
  } else if (imu_rate == 0.0 || scan_rate == 0.0) {
    status.summary(DiagnosticStatus::WARN, imu_rate == 0.0 ? "the IMU is silent" : "the radar is silent");
  } else if (queue_full > queue_full_told_) {
    status.summary(DiagnosticStatus::WARN, "the solver falls behind, scans were dropped");
  } else if (noise.isFarAbove(told)) {
    status.summary(DiagnosticStatus::WARN, noisyImu(noise, told));
  } else {
    status.summary(DiagnosticStatus::OK, "IMU and radar are coming");
  }
  queue_full_told_ = queue_full;
}

void LiveMonitor::describeSolver(Status& status, const LiveSession* session) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto latency = [&](const std::string& name, const Latency& of) {
    status.add(name + "_mean_ms", of.count > 0 ? 1e3 * of.sum / static_cast<double>(of.count) : 0.0);
    status.add(name + "_worst_ms", 1e3 * of.worst);
  };
  latency("imu_to_odometry", odometry_latency_);
  latency("scan_to_optimised", scan_latency_);
  status.add("updates", updates_);
  for (const auto& [termination, count] : terminations_) status.add(toString(termination), count);
  if (session != nullptr) status.add("queued_scans", session->queuedScans());
  if (!solver_failure_.empty()) {
    status.summary(DiagnosticStatus::ERROR, solver_failure_);
    return;
  }
  if (!last_update_) {
    status.summary(DiagnosticStatus::OK, "nothing to solve yet");
    return;
  }
  status.add("iterations", last_update_->result.solver_iterations);
  status.add("termination", toString(last_terminations_.back()));
  // A window gets a few iterations from where the last one ended: one of them that does not converge is no
  // fault.
  const auto countOf = [&](SolverTermination termination) {
    return std::count(last_terminations_.begin(), last_terminations_.end(), termination);
  };
  const auto full = static_cast<std::ptrdiff_t>(kWindowsJudged);
  const std::ptrdiff_t converged = countOf(SolverTermination::kConverged);
  if (last_terminations_.size() < kWindowsJudged || 2 * converged >= full) {
    status.summary(DiagnosticStatus::OK, "solving");
    return;
  }
  SolverTermination worst = SolverTermination::kAtBound;
  for (const SolverTermination other : {SolverTermination::kIterationLimit, SolverTermination::kNoDecrease})
    if (countOf(other) > countOf(worst)) worst = other;
  status.summary(DiagnosticStatus::WARN, std::to_string(countOf(worst)) + " of the last " +
                                             std::to_string(full) + " windows ended " + advice(worst));
}

void LiveMonitor::describeTimeOffset(Status& status) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!last_update_) {
    status.summary(DiagnosticStatus::OK, "not estimated yet");
    return;
  }
  const ScanResult& result = last_update_->result;
  status.add("offset_ms", 1e3 * result.time_offset);
  status.add("sigma_ms", 1e3 * result.time_offset_sigma);
  status.add("observable", last_update_->offset_observable ? "true" : "false");
  const double bound = config_.odometry.smoother.max_time_offset;
  if (std::abs(result.time_offset) > 0.99 * bound) {
    status.summary(DiagnosticStatus::WARN, "the offset is at its bound max_time_offset");
  } else {
    status.summary(DiagnosticStatus::OK, last_update_->offset_observable
                                             ? "observed by the motion now"
                                             : "kept: the motion says nothing now");
  }
}

}  // namespace rio_t
