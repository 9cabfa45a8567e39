#pragma once

#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace rio_t {

/// Watches tf for other nodes that place our frames. A frame of tf has one parent. With two publishers the
/// frame jumps between their answers, and tf tells nobody. Thread-safe.
class TfWatch {
 public:
  /// The frames that this node places.
  struct Frames {
    std::string body;              ///< that moves; empty: none
    std::set<std::string> radars;  ///< below it
  };

  /// `sent`: how often this nodelet has published the tf of the body, the current time included. Nodelets of
  /// one manager publish under one name, so a tf of the body that comes oftener is that of another nodelet.
  /// Nothing tells whose the frame of a radar is: there, only other nodes are noticed.
  TfWatch(ros::NodeHandle node, Frames frames, std::function<std::uint64_t()> sent);
  /// Who else places which frame, as "base_link from /wheels (below map)"; empty if nobody does.
  std::string others() const;

 private:
  using Event = ros::MessageEvent<tf2_msgs::TFMessage const>;
  using Clock = std::chrono::steady_clock;
  void add(const Event& event, bool is_static);
  /// Whether a tf of the body under our name is one too many. Call with mutex_ held.
  bool isOneTooMany();

  const Frames frames_;
  const std::function<std::uint64_t()> sent_;
  mutable std::mutex mutex_;  // guards what follows
  struct Other {
    std::string parent;
    std::optional<Clock::time_point> last;  ///< none: a static transform, which stays
  };
  std::map<std::pair<std::string, std::string>, Other> others_;  ///< by frame and name of the node
  std::uint64_t heard_ = 0;                                      ///< tf of the body under our name
  std::uint64_t too_many_ = 0;  ///< how many more we have heard than sent, at most
  ros::Subscriber tf_, tf_static_;
};

}  // namespace rio_t
