#include "rio_t/ros/live/tf_watch.h"

#include <boost/function.hpp>

#include "../text.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {
namespace {

/// [s] A publisher that said nothing for so long has stopped: tf comes several times a second.
constexpr std::chrono::seconds kStopped{5};

}  // namespace

TfWatch::TfWatch(ros::NodeHandle node, Frames frames, std::function<std::uint64_t()> sent)
    : frames_(std::move(frames)), sent_(std::move(sent)) {
  const boost::function<void(const Event&)> on_tf = [this](const Event& event) { add(event, false); };
  const boost::function<void(const Event&)> on_static = [this](const Event& event) { add(event, true); };
  tf_ = node.subscribe<tf2_msgs::TFMessage>("/tf", 100, on_tf);
  tf_static_ = node.subscribe<tf2_msgs::TFMessage>("/tf_static", 100, on_static);
}

void TfWatch::add(const Event& event, bool is_static) {
  const std::string& publisher = event.getPublisherName();
  const bool has_our_name = publisher == ros::this_node::getName();
  for (const geometry_msgs::TransformStamped& transform : event.getConstMessage()->transforms) {
    const std::string child = withoutSlash(transform.child_frame_id);
    const bool is_body = child == frames_.body;
    if (!is_body && (has_our_name || frames_.radars.count(child) == 0)) continue;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (has_our_name && !is_static && !isOneTooMany()) continue;
    Other& other = others_[{child, has_our_name ? "another nodelet of " + publisher : publisher}];
    other.parent = transform.header.frame_id;
    other.last = is_static ? std::nullopt : std::make_optional(Clock::now());
  }
}

bool TfWatch::isOneTooMany() {
  ++heard_;
  const std::uint64_t expected = sent_() + too_many_;
  if (heard_ <= expected) return false;  // some may still be on their way
  too_many_ += heard_ - expected;
  return true;
}

std::string TfWatch::others() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string names;
  for (const auto& [who, other] : others_)
    if (!other.last || Clock::now() - *other.last < kStopped)
      appendItem(&names, who.first + " from " + who.second + " (below " + other.parent + ")", ", ");
  return names;
}

}  // namespace rio_t
