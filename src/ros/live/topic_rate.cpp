#include "topic_rate.h"

#include <diagnostic_updater/publisher.h>

#include <limits>
#include <memory>

namespace rio_t {
namespace {

// Debian 11's diagnostic_updater/publisher.h defines a function that is not inline: one file may include it.
struct Task {
  Task(const std::string& topic, diagnostic_updater::Updater& updater)
      : diagnostic(topic, updater, {&least, &most, 0.0}) {}

  double least = 0.0, most = std::numeric_limits<double>::infinity();  // [Hz]
  diagnostic_updater::HeaderlessTopicDiagnostic diagnostic;
};

}  // namespace

std::function<void()> topicRate(const std::string& topic, diagnostic_updater::Updater& updater) {
  return [task = std::make_shared<Task>(topic, updater)] { task->diagnostic.tick(); };
}

}  // namespace rio_t
