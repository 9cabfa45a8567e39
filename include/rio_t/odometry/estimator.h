#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/imu/buffer.h"
#include "rio_t/landmarks/landmark_map.h"
#include "rio_t/odometry/calibration_check.h"
#include "rio_t/odometry/health_monitor.h"
#include "rio_t/odometry/initializer.h"
#include "rio_t/odometry/model_error_scale.h"
#include "rio_t/odometry/navigation.h"
#include "rio_t/odometry/options.h"
#include "rio_t/odometry/scan_result.h"
#include "rio_t/sensors/barometer_channel.h"
#include "rio_t/sensors/ground_vehicle_channel.h"
#include "rio_t/sensors/radar_channel.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {

/// Counts faults of the input by name. Thread-safe.
class FaultCounters {
 public:
  void count(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_[name];
  }
  std::map<std::string, std::uint64_t> get() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return counts_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> counts_;  // guarded by mutex_
};

/// The paper's optimisation thread: takes scans and checked IMU samples, and anchors the navigation at the
/// newest optimised state. Not thread-safe.
class Estimator {
 public:
  /// `navigation` and `faults` must outlive the estimator.
  Estimator(const OdometryOptions& options, Navigation& navigation, FaultCounters& faults);
  Estimator(const Estimator&) = delete;  // its parts refer to its IMU buffer
  Estimator& operator=(const Estimator&) = delete;

  /// Adds samples that Navigation checked, in time order.
  void addImu(const std::vector<ImuMeasurement>& samples);
  /// Changes options from the next scan on.
  void tune(const Tuning& tuning);
  /// Adds a pressure, in the order of arrival. Counts one that cannot be used in the faults.
  void addPressure(const Pressure& pressure);
  /// Call it if the IMU's clock jumped. No earlier data can be related to later data, so the state is
  /// dropped. The poses of the window go to the next result.
  void startAgain(std::uint64_t clock_restarts);
  std::uint64_t clockRestarts() const { return clock_restarts_; }
  /// Call it after addImu. Counts gaps of the radar. Moves the window if no scan does. `waiting`: next scans.
  void keepUp(bool scan_came, const std::vector<RadarScan>& waiting);

  /// Estimated time of the scan's node.
  Time nodeTime(const RadarScan& scan) const;
  /// Whether the IMU that covers the scan may still come.
  bool mustWait(const RadarScan& scan) const;
  /// `imu_has_ended`: no more IMU will come, so the scan cannot wait for it.
  ScanResult useScan(RadarScan scan, bool imu_has_ended);
  Health updateHealth();
  /// The optimised poses that no result has carried yet; for the end of the data.
  std::vector<StampedPose> remainingPoses();

  bool initialized() const { return smoother_.started(); }
  const StartWait& waitingFor() const { return waiting_for_; }  ///< while not initialised
  const std::optional<Initialization>& start() const { return start_; }
  const RadarChannel& radar(std::size_t radar) const { return radars_.at(radar); }

 private:
  /// Empty, or why the scan of a node at that time cannot be used now.
  std::string whyNotNow(Time node_time, bool imu_has_ended) const;
  /// Adds the terms of radar and aids for a scan at `node_time`, solves the window and judges the health.
  void putIntoWindow(Time node_time, RadarChannel& radar, ScanResult& result);
  void tryInitialize(const ImuMeasurement& sample);
  /// Starts a window.
  void begin(const Initialization& found);
  bool tryReinitialize(std::vector<StampedPose>& left);
  PoseAnchor anchorAt(Time time) const;
  void judge(const RadarAnswer& answer, const RadarScan& scan);
  /// `rests_now`: the platform is at rest at the newest node.
  void updateWindow(const RadarChannel& radar, bool rests_now, ScanResult& result);
  void seeLandmarks(const LandmarkMap::Prediction& expected, const RadarAnswer& answer,
                    const RadarChannel& radar, ScanResult& result);
  void publishNewest() { anchor(newestState(smoother_.newestCovariance({})), false); }
  void anchor(const NavigationState& state, bool at_rest);
  /// The poses that leave the window go to `left`.
  void marginalize(std::vector<StampedPose>& left);
  /// Adds the term that was judged, unless the platform is at rest.
  void constrainToGround(bool at_rest, ScanResult& result);
  /// Adds a drift of the position if the scans cease to contradict the estimate.
  void followContradiction(bool was_contradicted);
  ImuNoise imuNoise() const { return options_.imu_noise.scaled(model_error_scale_.value()); }
  NavigationState newestState(const StateCovariance& covariance) const;

  OdometryOptions options_;  ///< changed by tune() alone
  const Eigen::Vector3d g_W_;
  const double max_stamp_ahead_;  ///< [s]
  Navigation& navigation_;
  FaultCounters& faults_;

  ImuBuffer imu_;
  Initializer initializer_;
  FixedLagSmoother smoother_;
  std::vector<RadarChannel> radars_;                    ///< by RadarScan::radar
  std::optional<GroundVehicleChannel> ground_vehicle_;  ///< if the platform is one
  std::optional<BarometerChannel> barometer_;           ///< if it is used
  ModelErrorScale model_error_scale_;
  CalibrationCheck calibration_check_;
  RadarsHealth health_;
  Time contradicted_since_;
  Eigen::Vector3d corrected_W_ = Eigen::Vector3d::Zero();  ///< what scans added to v_W since then [m/s]
  std::optional<LandmarkMap> landmarks_;                   ///< none if they are off

  std::optional<Initialization> start_;
  StartWait waiting_for_;
  Time initialized_at_;
  Time last_used_;                         ///< stamp of the last scan that went into the window
  std::vector<StampedPose> left_between_;  ///< poses that left the window since the last result
  std::uint64_t clock_restarts_ = 0;
  std::optional<Time> radar_heard_;  ///< time of the IMU when the last scan came
  bool radar_is_silent_ = false;
};

}  // namespace rio_t
