#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/core/sigmas.h"
#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/radar/point_filter.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// If the median scan has fewer points, its velocities are biased: the mounting that check_bag finds may be
/// off by 20 degrees, or upside down.
constexpr double kSparsePoints = 15.0;

using Counts = std::map<std::string, std::uint64_t>;
/// Zero for a name that is not there.
std::uint64_t countOf(const Counts& counts, const std::string& name);

/// The mounting of a radar: as configured at the start, and as estimated at the end.
struct ExtrinsicsSummary {
  Extrinsics configured, T_IR;
  Covariance6 covariance;  ///< as ScanResult::T_IR_covariance

  // Zero if it is not estimated.
  Eigen::Vector3d translationSigma() const { return sigmasOf(covariance).head<3>(); }  ///< [m]
  Eigen::Vector3d rotationSigma() const { return sigmasOf(covariance).tail<3>(); }  ///< [rad] about axes of I
};

/// The calibration of one radar at the end of a run.
struct RadarEstimate {
  double final_offset_s = 0.0;
  double final_offset_sigma_s = 0.0;
  std::optional<ExtrinsicsSummary> extrinsics;  ///< only if they are estimated
};

/// The numbers of one radar. The live node leaves the estimates unset. With several radars, the keys in
/// `summary.yaml` end in the name of the radar.
struct RadarSummary : RadarEstimate {
  std::string name;               ///< empty if there is only one radar
  std::uint64_t scans_total = 0;  ///< received
  std::uint64_t scans_used = 0;
  std::uint64_t triggers_zero = 0;         ///< trigger messages with a stamp of zero
  std::uint64_t scans_before_start = 0;    ///< before the estimate was initialised
  std::uint64_t scans_before_imu = 0;      ///< of scans_before_start, stamped before the oldest IMU sample
  double seconds_before_imu = 0.0;         ///< of the first of scans_before_imu, before that sample
  std::uint64_t scans_ahead_at_start = 0;  ///< of scans_before_start, stamped ahead of the newest IMU sample
  double seconds_ahead_of_imu = 0.0;       ///< largest lead of a stamp over the newest IMU sample
  Counts scans_rejected;                   ///< by reason
  Counts velocity_status;                  ///< of the scans before the start, by EgoVelocityStatus
  std::uint64_t points = 0;                ///< of all scans
  std::uint64_t points_not_finite = 0;     ///< not in `points`: the decoder dropped them
  std::uint64_t padding = 0;               ///< padding that the decoder dropped
  std::array<std::uint64_t, kPointVerdicts> points_by_verdict = {};
  std::uint64_t scans_empty = 0;  ///< scans without a point
  /// Scans that had enough points for a velocity before the filter, but not after it, by the verdict that
  /// removed the most.
  std::array<std::uint64_t, kPointVerdicts> scans_emptied = {};
  double snr_sum_db = 0.0;                ///< over `points`
  std::uint64_t points_with_doppler = 0;  ///< of `points`, those whose Doppler is not zero
  /// Scans after which the estimate moved so fast that the Doppler of a usual radar does not round to zero.
  std::uint64_t scans_fast = 0;
  double silent_seconds = 0.0;  ///< as RunEvidence::silent_seconds, but of this radar alone
  RadarKnowledge knowledge;     ///< at the end; the file has standard deviations of the noise
  std::array<std::uint64_t, 3> points_per_scan = {};  ///< quantiles of 10, 50 and 90 % of the scans
  std::vector<double> pass_offsets_s;                 ///< after each pass; only with mode refine
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< [rad] from the configured mounting to the newest one
  CalibrationErrors errors;  ///< errors of what is not estimated, as the scans show them
};

/// The trajectory starts again here: the stamps of the IMU jumped, or the gap between usable samples was too
/// long to bridge. It is counted as "imu_clock_restart".
struct ImuRestart {
  Time before;                  ///< newest stamp used before it
  Time after;                   ///< first stamp used after it
  Counts dropped = {};          ///< samples between the two, by fault
  bool stamps_went_on = false;  ///< no stamp jumped: the dropped samples make the gap
};

struct BarometerCounts {
  std::uint64_t pressures = 0;          ///< messages
  std::uint64_t used = 0;               ///< means that went into the window
  std::uint64_t steps = 0;              ///< steps of the pressure, after which the bias was estimated again
  Counts rejected;                      ///< means by the reason why they were rejected
  std::optional<BarometerAnswer> last;  ///< the last mean, used or not
  double bias = 0.0, bias_sigma = 0.0;  ///< [m] of the last mean that was used
  double innovation_square = 0.0;       ///< [m^2] sum over the used means, except those of a step

  void add(const ScanResult& result);
};

struct GroundVehicleCounts {
  std::uint64_t used = 0;
  std::uint64_t left_out = 0;             ///< terms that contradicted the estimate
  std::optional<double> contradicted_at;  ///< [s] after the first scan judged
  std::optional<Time> first_judged;
  std::optional<GroundVehicleAnswer> last;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< newest rotation of the vehicle frame
  Eigen::Vector3d rotation_sigma = Eigen::Vector3d::Zero();      ///< [rad] about the axes of I

  void add(const ScanResult& result);
};

struct LandmarkCounts {
  std::uint64_t scans = 0;          ///< scans that were compared with the map
  std::uint64_t scans_trusted = 0;  ///< of them, those after which the map was trusted
  std::uint64_t most_in_map = 0;    ///< landmarks at once
  bool is_trusted = false;          ///< now
  std::uint64_t in_map = 0;         ///< now

  void add(const ScanResult& result);
};

struct RunEvidence {
  bool initialized = false;
  InitializedFrom initialized_from = InitializedFrom::kRest;
  StartWait waiting_for;       ///< while not initialised
  double heading_sigma = 0.0;  ///< of the newest state [rad]
  std::uint64_t imu_count = 0;
  // Intervals between the stamps of usable IMU samples. Jumps, and gaps too long to bridge, do not count.
  std::uint64_t imu_steps = 0, imu_gaps = 0;        ///< all intervals, and those longer than max_imu_gap
  double imu_seconds = 0.0, imu_gap_seconds = 0.0;  ///< [s] likewise
  Counts input_faults;  ///< RadarInertialOdometry::faults(), with those of the messages
  std::uint64_t divergences = 0, reinitializations = 0;
  Health health = Health::kOk;
  std::uint64_t scans_judged = 0;        ///< after the start
  std::uint64_t scans_diverged = 0;      ///< of scans_judged, those after which the health was "diverged"
  std::uint64_t scans_contradicted = 0;  ///< of scans_diverged; the scans contradicted the estimate
  /// Windows by the reason why the solver stopped. With mode batch, the one solve of the whole run.
  Counts solver_terminations;
  MeasuredImuNoise imu_noise;  ///< of the run, root mean square
  // [s] of IMU time since the start, without jumps of the clock. Zero in the live node, whose monitor reports
  // silence itself.
  double run_seconds = 0.0;
  double silent_seconds = 0.0;                    ///< more than `coasting_after` after the last used scan
  double silence_begin = 0.0, silence_end = 0.0;  ///< of the longest silence
  std::vector<ImuRestart> imu_restarts;  ///< empty in the live node, whose evidence starts anew after each
  std::vector<std::string> several_publishers;        ///< a sentence for each topic of a bag that has several
  std::vector<RadarSummary> radars;                   ///< in the order of the configuration
  std::optional<GroundVehicleCounts> ground_vehicle;  ///< only with platform: ground_vehicle
  std::optional<LandmarkCounts> landmarks;            ///< only with landmarks: true
};

/// Collects the evidence from the results of the scans. Not thread-safe.
class EvidenceCollector {
 public:
  explicit EvidenceCollector(const Config& config);

  void add(const ScanResult& result);
  void addImu(Time time) {
    if (!oldest_imu_ || time < *oldest_imu_) oldest_imu_ = time;  // its clock may jump back
    const double step = newest_imu_ ? time - *newest_imu_ : 0.0;
    newest_imu_ = time;
    if (step <= 0.0 || step > max_bridged_gap_) return;
    ++evidence_.imu_steps;
    evidence_.imu_seconds += step;
    if (step <= max_imu_gap_) return;
    ++evidence_.imu_gaps;
    evidence_.imu_gap_seconds += step;
  }
  /// A sample of the IMU after the start.
  void addState(Time time);
  /// Scans that were dropped before the odometry saw them.
  void addDropped(std::size_t radar, const std::string& reason, std::uint64_t count);
  void addNotFinite(std::size_t radar, std::uint64_t count) {
    evidence_.radars.at(radar).points_not_finite += count;
  }
  void addPadding(std::size_t radar, std::uint64_t count) { evidence_.radars.at(radar).padding += count; }
  /// A trigger that was dropped because its stamp is zero.
  void addZeroTrigger(std::size_t radar) { ++evidence_.radars.at(radar).triggers_zero; }
  /// Only with platform: ground_vehicle.
  const std::optional<GroundVehicleCounts>& groundVehicle() const { return evidence_.ground_vehicle; }
  /// Only with landmarks: true.
  const std::optional<LandmarkCounts>& landmarks() const { return evidence_.landmarks; }
  /// Returns the evidence so far, with what `odometry` knows, and its `start`. `scans_total` counts the
  /// results and the dropped scans.
  RunEvidence evidence(const RadarInertialOdometry& odometry,
                       const std::optional<RadarInertialOdometry::Start>& start) const;

 private:
  /// Adds the points of one scan, by the verdict on them.
  static void addPoints(const std::array<std::uint64_t, kPointVerdicts>& of_scan, RadarSummary* radar);

  std::vector<PointFilter> filters_;                       // by RadarScan::radar
  double coasting_after_, max_bridged_gap_, max_imu_gap_;  // [s]
  std::optional<Time> oldest_imu_, newest_imu_, newest_state_;
  std::vector<Time> last_used_;  // by radar: stamp of its last used scan, or of the start
  RunEvidence evidence_;
};

/// The remedy for a topic that has several publishers.
constexpr const char* kSeveralPublishersRemedy = "Stop one of them, or remap it to a topic of its own.";

/// The warning if the platform does not move like a ground vehicle.
constexpr const char* kGroundVehicleContradicted =
    "the motion contradicted platform: ground_vehicle, and the constraint is switched off until the "
    "estimate starts again: the platform moves sideways or upwards. Is it a ground vehicle, does "
    "vehicle_frame_rotation_xyzw say which way it drives, and vehicle_frame_translation which point does not "
    "slip?";

}  // namespace rio_t
