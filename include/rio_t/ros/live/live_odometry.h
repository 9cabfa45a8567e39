#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <ros/callback_queue.h>
#include <ros/message_event.h>
#include <ros/node_handle.h>
#include <ros/spinner.h>
#include <sensor_msgs/FluidPressure.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/PointCloud2.h>
#include <std_msgs/Header.h>
#include <std_srvs/Empty.h>
#include <std_srvs/Trigger.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "rio_t/ros/live/body_frame.h"
#include "rio_t/ros/live/live_log.h"
#include "rio_t/ros/live/live_parameters.h"
#include "rio_t/ros/live/monitor.h"
#include "rio_t/ros/live/publisher.h"
#include "rio_t/ros/live/session.h"
#include "rio_t/ros/live/tf_watch.h"
#include "rio_t/ros/live/topic_rate.h"

namespace rio_t {

/// The live odometry: what both the nodelet and the node own. Threads and topics only; the estimator is the
/// same as the bag runner's.
///
/// Three threads of its own, so it needs none of the caller's: the IMU thread publishes ~odom and never waits
/// for the solver; the input thread takes scans, triggers, services and diagnostics; the optimisation thread
/// solves.
class LiveOdometry {
 public:
  /// `name` is for diagnostics. Throws ConfigError or std::runtime_error for wrong parameters.
  LiveOdometry(const ros::NodeHandle& node, const ros::NodeHandle& private_node, const std::string& name);
  /// Returns when all threads have ended; waits for the solver at most for the scan it is at.
  ~LiveOdometry();
  LiveOdometry(const LiveOdometry&) = delete;
  LiveOdometry& operator=(const LiveOdometry&) = delete;

 private:
  using Session = CurrentSession::Session;
  using Speaker = CurrentSession::Speaker;
  template <typename Message>
  using Event = ros::MessageEvent<const Message>;

  /// Samples: seconds of input, so that nothing is lost while a callback is late.
  static constexpr std::uint32_t kImuQueue = 5000;

  struct Received {
    ImuMeasurement imu;
    Time record;  ///< of receipt
  };

  struct Radar {
    explicit Radar(const Config& its_config);
    static bool isMounted(const Radar& radar) { return radar.T_IR.has_value(); }

    Config config;  ///< with its topics as they are resolved
    PointCloudFormat format;
    std::optional<Extrinsics> T_IR;  ///< configured; none until tf has it. Input thread only, as the next
    std::string waiting_for;         ///< what T_IR waits for
    ros::Subscriber scans, triggers;
    std::unique_ptr<TopicRate> scan_rate, trigger_rate;
  };

  /// Subscribes to the topics as the user wrote them: ROS would remap resolved ones once more.
  void subscribe();
  void addDiagnostics();
  void onDiagnosticsTimer();
  /// Changes what may change while the node runs; what is refused stays as it was. Input thread.
  void onReconfigure(LiveParameters& values);
  void onImu(const Event<sensor_msgs::Imu>& event);
  void onScan(std::size_t radar, const Event<sensor_msgs::PointCloud2>& event);
  void onPressure(const Event<sensor_msgs::FluidPressure>& event);
  void onTrigger(std::size_t radar, const Event<std_msgs::Header>& event);
  bool onReset(std_srvs::Empty::Request& request, std_srvs::Empty::Response& response);
  bool onSaveTrajectory(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);

  /// Takes T_IR from tf, once it is there. `cloud_frame`: of the cloud's header.
  void lookUpExtrinsics(Radar& radar, const std::string& cloud_frame);
  /// Starts the session if T_IR of all radars is known, or if one is and the others have been silent since
  /// for `coasting_after`; else says what is waited for.
  void startSessionWhenReady(const ros::Time& now);
  /// Sets options_ to what is configured, with the T_IR that are known.
  void takeExtrinsics();
  /// After it returns, the node publishes nothing of the old session. Any thread.
  /// `at_once`: does not wait for rest first.
  void reset(const std::string& reason, bool at_once = false);
  /// Resets the whole session, with what it stamps by: the clock of the IMU jumped by `jump` [s]. IMU thread.
  void restartClock(const ImuSampleCheck::Verdict& checked, Time time);
  /// Gives a sample to a session. Returns the state that is to be published, if there is one.
  std::optional<NavigationState> feed(LiveSession& session, const Received& received);
  void account(const std::vector<LiveSession::GivenUp>& given_up);
  void wakeSolver();
  void solve();  ///< body of the optimisation thread

  const std::string name_;
  LiveLog log_;              // thread-safe, but for the faults: input thread
  const Config configured_;  // topics as the user wrote them
  const Config config_;      // topics as they are resolved
  ros::NodeHandle node_, private_node_;
  TopicRate imu_rate_, pressure_rate_, odom_rate_;  // they tick in any thread
  ros::CallbackQueue imu_queue_, input_queue_;
  LiveMonitor monitor_;                                     // thread-safe
  LivePublisher publisher_;                                 // see there
  BodyFrame frames_;                                        // thread-safe
  std::optional<TfWatch> tf_watch_;                         // thread-safe; none if no tf is published
  std::optional<diagnostic_updater::Updater> diagnostics_;  // input thread
  ros::Time last_clock_;          // of ROS, when `input` was told last; input thread
  bool tells_odom_rate_ = false;  // likewise

  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::optional<ros::Time> mounted_since_;  // when the first T_IR came; input thread only
  std::vector<Radar> radars_;               // read-only after construction, but for T_IR
  CurrentSession session_;                  // thread-safe; null until the extrinsics are known

  std::mutex mutex_;  // guards what follows, held for microseconds
  std::condition_variable work_to_do_;
  OdometryOptions options_;  // with the extrinsics that hold, tuned
  bool has_work_ = false;
  bool stopping_ = false;

  Config live_config_;                        // config_ with what was reconfigured; input thread only
  boost::recursive_mutex reconfigure_mutex_;  // the server's own
  std::unique_ptr<dynamic_reconfigure::Server<LiveParameters>> reconfigure_;

  ImuSampleCheck imu_check_;        // answers as the session's own. IMU thread only, as the next
  std::deque<Received> early_imu_;  // from before there was a session; it gets them first

  ros::Subscriber imu_subscriber_, barometer_subscriber_;
  ros::ServiceServer reset_server_, save_server_;
  ros::WallTimer diagnostics_timer_;
  std::thread solver_;
  std::optional<ros::AsyncSpinner> imu_spinner_, input_spinner_;
};

}  // namespace rio_t
