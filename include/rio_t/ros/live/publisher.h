#pragma once

#include <nav_msgs/Path.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/odometry/body_odometry.h"
#include "rio_t/ros/live/session.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// Thins out a stream by its stamps: the first message of each period is published. The periods count from
/// the epoch, so the same stamps give the same choice, whenever one starts. `set` may be called from any
/// thread, `isDue` from one.
class PublishRate {
 public:
  explicit PublishRate(double hz) : hz_(hz) {}
  void set(double hz) { hz_ = hz; }  ///< [Hz] 0: every message

  bool isDue(Time stamp) {
    const double hz = hz_;
    if (hz <= 0.0) return true;
    const double period = std::floor(stamp.seconds() * hz);
    if (period == last_) return false;
    last_ = period;
    return true;
  }

 private:
  std::atomic<double> hz_;
  double last_ = std::numeric_limits<double>::quiet_NaN();  ///< period of the last message; NaN equals none
};

/// Publishes the messages of the live node. `odometry` belongs to the IMU thread, `result` and `clear` to the
/// optimisation thread, `tune` to any. If the radars have names, the topics of a radar are in the namespace
/// of its name. Messages go out as shared pointers, so that subscribers in the same nodelet manager get them
/// without a copy; nobody changes a message after it was published.
class LivePublisher {
 public:
  /// `private_node` carries the callback queue that serves new subscribers of ~path.
  LivePublisher(const Config& config, const ros::NodeHandle& private_node);

  /// ~odom and tf, each at its rate. Whether ~odom was published.
  bool odometry(const BodyOdometry& body);
  /// How often the tf of the body was published, the one that is being published included. Any thread.
  std::uint64_t tfSent() const { return tf_sent_; }

  /// The frames that a result is published in.
  struct Frames {
    std::string imu;
    std::optional<ImuInBody> T_BI;     ///< none while it is not known: then there is no tf of radars
    std::optional<WorldInOdom> world;  ///< for the map; none before it is known
    std::optional<BodyOdometry> body;  ///< of the result's state; none if it was not updated
  };
  /// ~odom_optimized, ~imu_bias, ~path; of the radar: ~time_offset, ~ego_velocity, ~innovation, ~points,
  /// ~inliers, tf and, if they are estimated, ~extrinsics. ~map, if landmarks are on.
  void result(const LiveSession::Result& live, const Frames& frames);
  /// Empties ~path and ~map: a new session begins.
  void clear();

  /// Takes odom_rate, tf_rate, path_max_poses and correct_stamps; in effect from the next message on.
  void tune(const Config& config);

 private:
  struct Radar {
    Radar(const Config& config, const ros::NodeHandle& private_node);

    std::string frame;
    ros::Publisher time_offset, ego_velocity, innovation, points, inliers;
    std::optional<ros::Publisher> extrinsics;  ///< none if they are not estimated
    bool has_static_tf = false;
  };

  void radarFrame(Radar& radar, const LiveSession::Result& live, const Frames& frames, Time stamp);
  void extendPath(const BodyOdometry& body);
  nav_msgs::Path path();
  void map(const std::vector<LandmarkPoint>& points, const WorldInOdom& T_OW, Time stamp);

  const Config config_;
  std::vector<Radar> radars_;  // optimisation thread only, after construction
  ros::Publisher odom_, odom_optimized_, path_, imu_bias_;
  std::optional<ros::Publisher> map_;  ///< none without landmarks
  PublishRate odom_rate_, tf_rate_;
  PublishRate path_rate_{1.0};  ///< [Hz] for people: a path of 2000 poses has 160 kB
  std::atomic<bool> correct_stamps_;
  std::atomic<std::size_t> path_max_poses_;
  // None where they are not wanted. One for each thread: they share nothing.
  std::optional<tf2_ros::TransformBroadcaster> tf_, radar_tf_;
  std::optional<tf2_ros::StaticTransformBroadcaster> static_tf_;
  std::atomic<std::uint64_t> tf_sent_{0};  // by tf_
  std::mutex path_mutex_;                  // never held while something is published
  nav_msgs::Path path_message_;            // guarded by path_mutex_
};

}  // namespace rio_t
