#pragma once

#include <diagnostic_updater/diagnostic_updater.h>

#include <memory>
#include <string>

namespace rio_t {

/// How often a topic comes, as a task of /diagnostics. Silence is an error, any rate is right.
class TopicRate {
 public:
  /// `updater` must live longer.
  TopicRate(const std::string& topic, diagnostic_updater::Updater& updater);
  ~TopicRate();
  TopicRate(const TopicRate&) = delete;
  TopicRate& operator=(const TopicRate&) = delete;

  /// A message came. Thread-safe.
  void tick();

 private:
  // Debian 11's diagnostic_updater/publisher.h defines a function that is not inline: one file may include
  // it.
  struct Task;
  std::unique_ptr<Task> task_;
};

}  // namespace rio_t
