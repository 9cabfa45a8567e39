#pragma once

#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace rio_t {

/// Watches tf for others who say where a frame is. A frame of tf has one parent. With two publishers the
/// frame jumps between their answers, and tf tells nobody. Nodelets of one manager count as one node, since
/// they publish under its name. Thread-safe.
class TfWatch {
 public:
  /// `child`: the frame that this node places.
  TfWatch(ros::NodeHandle node, const std::string& child);
  /// Who else places the frame, as "/wheels (from map)"; empty if nobody does.
  std::string others() const;

 private:
  using Event = ros::MessageEvent<tf2_msgs::TFMessage const>;
  using Clock = std::chrono::steady_clock;
  void add(const Event& event, bool is_static);

  const std::string child_;
  mutable std::mutex mutex_;
  struct Other {
    std::string parent;
    std::optional<Clock::time_point> last;  ///< none: a static transform, which stays
  };
  std::map<std::string, Other> others_;  ///< by the name of the node; guarded by mutex_
  ros::Subscriber tf_, tf_static_;
};

}  // namespace rio_t
