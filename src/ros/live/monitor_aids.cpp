// LiveMonitor: barometer, ground vehicle and landmarks.
#include <diagnostic_msgs/DiagnosticStatus.h>

#include <cmath>
#include <string>

#include "../text.h"
#include "rio_t/ros/live/monitor.h"

namespace rio_t {

using diagnostic_msgs::DiagnosticStatus;

void LiveMonitor::pressure() {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++barometer_.messages.count;
}

void LiveMonitor::pressureDropped(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++barometer_.not_usable;
  barometer_.why_not_usable = why;
}

void LiveMonitor::describeBarometer(Status& status) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_silent = barometer_.messages.isSilent(kSilentCalls);
  const std::uint64_t fresh_used = barometer_.used - barometer_.used_reported;
  barometer_.used_reported = barometer_.used;
  status.add("pressures", barometer_.messages.count);
  status.add("pressures_not_usable", barometer_.not_usable);
  status.add("means_used", barometer_.used);
  for (const auto& [reason, count] : barometer_.rejected) status.add("means_rejected_" + reason, count);
  status.add("steps", barometer_.steps);
  if (barometer_.last) {
    status.add("height_m", barometer_.last->height);
    status.add("innovation_m", barometer_.last->innovation);
    status.add("innovation_sigma_m", barometer_.last->innovation_sigma);
    status.add("bias_m", barometer_.last->bias);
    status.add("bias_sigma_m", barometer_.last->bias_sigma);
  }
  if (barometer_.messages.count == 0) {
    status.summary(DiagnosticStatus::WARN,
                   "no pressure yet on " + config_.barometer_topic +
                       whatIsPublished(config_.barometer_topic, "sensor_msgs/FluidPressure"));
  } else if (is_silent) {
    status.summary(DiagnosticStatus::WARN, "the barometer is silent, topic " + config_.barometer_topic);
  } else if (barometer_.not_usable == barometer_.messages.count) {
    status.summary(DiagnosticStatus::WARN, "no pressure can be used: " + barometer_.why_not_usable);
  } else if (fresh_used == 0 && barometer_.last && !barometer_.last->rejected_because.empty()) {
    status.summary(DiagnosticStatus::WARN,
                   "no pressure is used now, rejected as " + barometer_.last->rejected_because);
  } else {
    status.summary(DiagnosticStatus::OK, barometer_.used > 0 ? "in use" : "pressures are coming");
  }
}

void LiveMonitor::describeGroundVehicle(Status& status) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const GroundVehicleCounts& vehicle = collector_.groundVehicle().value();
  status.add("terms_used", vehicle.used);
  status.add("terms_left_out", vehicle.left_out);
  if (!vehicle.last) {
    status.summary(DiagnosticStatus::OK, "no motion judged yet");
    return;
  }
  const GroundVehicleAnswer& last = *vehicle.last;
  status.add("velocity_sideways_m_s", last.v_V.y());
  status.add("velocity_upwards_m_s", last.v_V.z());
  if (last.contradiction) status.add("contradiction", *last.contradiction);
  status.add("vehicle_frame_rotation_xyzw", "[" + fixedTexts(last.q_IV.coeffs(), 6) + "]");
  if (last.is_contradicted) {
    status.summary(DiagnosticStatus::WARN, kGroundVehicleContradicted);
  } else {
    status.summary(DiagnosticStatus::OK, "the motion agrees");
  }
}

void LiveMonitor::describeLandmarks(Status& status) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const LandmarkCounts& landmarks = collector_.landmarks().value();
  status.add("landmarks", landmarks.in_map);
  status.add("scans", landmarks.scans);
  status.add("scans_trusted", landmarks.scans_trusted);
  status.summary(DiagnosticStatus::OK, landmarks.is_trusted
                                           ? "the map helps the estimate"
                                           : "too few landmarks were seen again, the map waits");
}

}  // namespace rio_t
