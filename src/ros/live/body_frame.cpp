#include "rio_t/ros/live/body_frame.h"

#include <ros/console.h>

#include <utility>

#include "rio_t/ros/frames/frames.h"
#include "rio_t/ros/messages/conversions.h"

namespace rio_t {
namespace {

bool wantsTf(const Config& config) {
  if (config.base_extrinsics_source != BaseExtrinsicsSource::kParameters) return true;
  for (const Config& radar : configsOfRadars(config))
    if (radar.extrinsics_source == ExtrinsicsSource::kTf) return true;
  return false;
}

}  // namespace

BodyFrame::BodyFrame(const Config& config, const ros::NodeHandle& node, std::string name)
    : config_(config), name_(std::move(name)) {
  if (!config.imu_frame.empty()) imu_frame_ = rio_t::imuFrame(config, "");
  if (config.base_extrinsics_source == BaseExtrinsicsSource::kParameters)
    decide(config.T_BI, "parameters base_extrinsics_*");
  if (!wantsTf(config)) return;
  tf_.emplace();
  listener_ = std::make_unique<tf2_ros::TransformListener>(*tf_, node);
}

void BodyFrame::hear(const std::string& imu_frame_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (imu_frame_) return;
  imu_frame_ = rio_t::imuFrame(config_, imu_frame_id);
  if (imu_frame_id.empty())
    ROS_WARN_STREAM(name_ << ": the IMU's messages have no frame_id: the IMU is taken to be "
                          << config_.base_link_frame << " (imu_frame names another frame)");
}

std::optional<std::string> BodyFrame::imuFrame() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return imu_frame_;
}

std::optional<Extrinsics> BodyFrame::radarExtrinsics(const Config& radar, const std::string& cloud_frame_id,
                                                     std::string* waiting_for) const {
  const std::string cloud = cloudFrame(radar, cloud_frame_id);
  const std::optional<std::string> imu = imuFrame();
  if (!imu) {
    *waiting_for = "the first IMU message, whose frame_id names the IMU for tf";
    return std::nullopt;
  }
  try {
    return rio_t::radarExtrinsics(*tf_, radar, *imu, cloud);
  } catch (const tf2::TransformException& error) {
    *waiting_for = "tf from " + cloud + " to " + *imu + " (" + error.what() + ")";
    return std::nullopt;
  }
}

void BodyFrame::decide(const ImuInBody& T_BI, const std::string& source) {
  T_BI_ = T_BI;
  source_ = source;
  waiting_for_.clear();
}

bool BodyFrame::tryTf() {
  if (T_BI_) return true;
  if (!imu_frame_) return false;
  if (*imu_frame_ == config_.base_link_frame) {
    // tf has nothing to say, so with `auto` the parameters hold.
    if (config_.base_extrinsics_source == BaseExtrinsicsSource::kTf)
      decide({}, "the IMU's frame is " + config_.base_link_frame);
    else
      decide(config_.T_BI,
             "parameters base_extrinsics_*, since the IMU's frame is " + config_.base_link_frame);
    return true;
  }
  try {
    const auto transform = tf_->lookupTransform(config_.base_link_frame, *imu_frame_, ros::Time(0));
    decide(toImuInBody(transform.transform), "tf from " + *imu_frame_);
  } catch (const tf2::TransformException& error) {
    waiting_for_ = "tf from " + *imu_frame_ + " to " + config_.base_link_frame + " (" + error.what() + ")";
    return false;
  }
  ROS_INFO_STREAM(name_ << ": pose of the IMU in " << config_.base_link_frame << " from tf " << *imu_frame_
                        << " -> " << config_.base_link_frame << ": translation [" << T_BI_->p_B.transpose()
                        << "], rotation xyzw [" << T_BI_->q_BI.coeffs().transpose() << "]");
  return true;
}

std::optional<ImuInBody> BodyFrame::imuInBody() {
  const std::lock_guard<std::mutex> lock(mutex_);
  tryTf();
  return T_BI_;
}

std::optional<BodyOdometry> BodyFrame::place(LiveSession& session, const NavigationState& state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!tryTf()) {
    if (config_.base_extrinsics_source == BaseExtrinsicsSource::kTf) return std::nullopt;
    ROS_WARN_STREAM(name_ << ": no tf from the IMU's frame " << imu_frame_.value_or("") << " to "
                          << config_.base_link_frame
                          << ": the parameters base_extrinsics_* hold, which put the IMU at ["
                          << config_.T_BI.p_B.transpose() << "] (base_extrinsics_source: tf would wait)");
    decide(config_.T_BI, "parameters base_extrinsics_*, since tf does not have it");
  }
  std::optional<WorldInOdom> T_OW = session.world();
  if (!T_OW) {
    const auto start = session.start();
    if (!start) return std::nullopt;
    const StampedPose pose{start->time, start->prior.x0.p_W(), start->prior.x0.q_WI()};
    const bool goes_on = last_ && config_.reset_pose == ResetPose::kKeep;
    T_OW = placeWorld(pose, *T_BI_, goes_on ? *last_ : BodyOdometry());
    session.setWorld(*T_OW);
  }
  return bodyOdometry(state, session.rateSigma(), *T_BI_, *T_OW);
}

void BodyFrame::published(const BodyOdometry& body) {
  const std::lock_guard<std::mutex> lock(mutex_);
  last_ = body;
}

std::string BodyFrame::waitingFor() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  // With `auto`, nothing waits: the parameters hold if tf knows nothing once the odometry starts.
  return T_BI_ || config_.base_extrinsics_source != BaseExtrinsicsSource::kTf ? "" : waiting_for_;
}

std::string BodyFrame::source() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return source_;
}

void BodyFrame::stopListening() { listener_.reset(); }

}  // namespace rio_t
