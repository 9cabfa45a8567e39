#include "rio_t/ros/live/topic_rate.h"

#include <diagnostic_updater/publisher.h>

#include <limits>

namespace rio_t {

struct TopicRate::Task {
  Task(const std::string& topic, diagnostic_updater::Updater& updater)
      : diagnostic(topic, updater, {&least, &most, 0.0}) {}

  double least = 0.0, most = std::numeric_limits<double>::infinity();  // [Hz]
  diagnostic_updater::HeaderlessTopicDiagnostic diagnostic;
};

TopicRate::TopicRate(const std::string& topic, diagnostic_updater::Updater& updater)
    : task_(std::make_unique<Task>(topic, updater)) {}
TopicRate::~TopicRate() = default;

void TopicRate::tick() { task_->diagnostic.tick(); }

}  // namespace rio_t
