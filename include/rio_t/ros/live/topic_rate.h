#pragma once

#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <diagnostic_updater/diagnostic_updater.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>

namespace rio_t {

/// A task of /diagnostics: how often a topic came over the last runs of the task. Silence is an error, any
/// rate is right. The texts are those of diagnostic_updater, but the time is real: that of ROS goes back
/// where a bag loops.
class TopicRate final : public diagnostic_updater::DiagnosticTask {
 public:
  explicit TopicRate(const std::string& topic) : DiagnosticTask(topic + " topic status") {}

  void tick() { ++messages_; }                      ///< for each message, by any thread
  bool hasTicked() const { return messages_ > 0; }  ///< ever; any thread

  void run(diagnostic_updater::DiagnosticStatusWrapper& status) override {
    const auto [since, before] = runs_.front();
    const auto now = Clock::now();
    const std::uint64_t count = messages_;
    runs_.emplace_back(now, count);
    if (runs_.size() > kRuns) runs_.pop_front();
    const std::uint64_t came = count - before;
    const std::chrono::duration<double> seconds = now - since;
    using diagnostic_msgs::DiagnosticStatus;
    status.summary(came > 0 ? DiagnosticStatus::OK : DiagnosticStatus::ERROR,
                   came > 0 ? "Desired frequency met" : "No events recorded.");
    status.add("Events in window", came);
    status.add("Duration of window (s)", seconds.count());
    status.add("Actual frequency (Hz)", static_cast<double>(came) / seconds.count());
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kRuns = 5;  ///< as in diagnostic_updater::FrequencyStatus

  std::atomic<std::uint64_t> messages_{0};
  std::deque<std::pair<Clock::time_point, std::uint64_t>> runs_ = {{Clock::now(), 0}};
};

}  // namespace rio_t
