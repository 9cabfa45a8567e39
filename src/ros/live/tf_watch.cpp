#include "rio_t/ros/live/tf_watch.h"

#include <boost/function.hpp>

#include "../text.h"

namespace rio_t {
namespace {

/// [s] A publisher that said nothing for so long has stopped: tf comes several times a second.
constexpr std::chrono::seconds kStopped{5};

}  // namespace

TfWatch::TfWatch(ros::NodeHandle node, const std::string& child) : child_(child) {
  const boost::function<void(const Event&)> on_tf = [this](const Event& event) { add(event, false); };
  const boost::function<void(const Event&)> on_static = [this](const Event& event) { add(event, true); };
  tf_ = node.subscribe<tf2_msgs::TFMessage>("/tf", 100, on_tf);
  tf_static_ = node.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, on_static);
}

void TfWatch::add(const Event& event, bool is_static) {
  if (event.getPublisherName() == ros::this_node::getName()) return;
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    const std::string& child = transform.child_frame_id;
    if (child != child_ && child != "/" + child_) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    Other& other = others_[event.getPublisherName()];
    other.parent = transform.header.frame_id;
    other.last = is_static ? std::nullopt : std::make_optional(Clock::now());
  }
}

std::string TfWatch::others() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string names;
  for (const auto& [name, other] : others_)
    if (!other.last || Clock::now() - *other.last < kStopped)
      appendItem(&names, name + " (from " + other.parent + ")", ", ");
  return names;
}

}  // namespace rio_t
