#pragma once

#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "rio_t/odometry/body_odometry.h"
#include "rio_t/ros/live/session.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// The frames of the live node: the IMU's, and the body whose odometry is published. Thread-safe. It holds
/// T_BI, and each session's world in the odometry frame, so that a reset goes on from the last pose.
class BodyFrame {
 public:
  /// Listens to tf only if something is wanted from it.
  BodyFrame(const Config& config, const ros::NodeHandle& node, std::string name);

  /// Takes the frame_id of an IMU message; the first one names the frame of the IMU.
  void hear(const std::string& imu_frame_id);
  /// The frame of the IMU; none before the first message, unless `imu_frame` names it.
  std::optional<std::string> imuFrame() const;

  /// T_IR of a radar from tf. None while something is missing: `waiting_for` then names it, for people.
  /// Throws std::runtime_error if it can never be found (see cloudFrame()).
  std::optional<Extrinsics> radarExtrinsics(const Config& radar, const std::string& cloud_frame_id,
                                            std::string* waiting_for) const;

  /// T_BI, if it is known.
  std::optional<ImuInBody> imuInBody();
  /// The odometry of the body. None while its frames are not known (see waitingFor()). Here `auto` decides
  /// for the parameters if tf does not connect IMU and body.
  std::optional<BodyOdometry> place(LiveSession& session, const NavigationState& state);
  /// The odometry that was published last: the next session goes on from there.
  void published(const BodyOdometry& body);

  /// The frame or transform that the odometry waits for; empty: none.
  std::string waitingFor() const;
  std::string source() const;  ///< where T_BI came from, for people; empty while it is not known

  /// No tf is wanted any more.
  void stopListening();

 private:
  bool tryTf();  // call with mutex_ held
  void decide(const ImuInBody& T_BI, const std::string& source);

  const Config config_;
  const std::string name_;
  std::optional<tf2_ros::Buffer> tf_;  // thread-safe
  std::unique_ptr<tf2_ros::TransformListener> listener_;

  mutable std::mutex mutex_;  // guards what follows
  std::optional<std::string> imu_frame_;
  std::optional<ImuInBody> T_BI_;
  std::string source_, waiting_for_;
  std::optional<BodyOdometry> last_;
};

}  // namespace rio_t
