#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/odometry/radar_inertial_odometry.h"

namespace rio_t {

/// Errors against ground truth, as evo gives them.
struct TruthErrors {
  double ate_m = 0.0;               ///< rmse, origins aligned
  std::optional<double> t_rel;      ///< [m/m] over 1 m, rmse; none if the estimate is shorter
  std::optional<double> r_rel_deg;  ///< [deg/m] likewise
};

/// How the solver ended where the whole run was solved at once.
struct BatchSummary {
  int iterations = 0;
  int placements = 0;  ///< how often the nodes were placed
  bool converged = false;
  std::uint64_t scans_readmitted = 0;  ///< rejected by the online gate, taken by the batch
};

/// What a run comes to; `summary.yaml` has one key for each member.
struct RunSummary {
  std::string mode = "online";
  std::vector<double> pass_offsets_s;        ///< after each pass; only with mode refine
  std::vector<double> pass_offset_sigmas_s;  ///< likewise
  std::optional<BatchSummary> batch;         ///< only with mode batch
  std::uint64_t imu_count = 0;
  std::uint64_t scans_total = 0;  ///< used and rejected
  std::uint64_t scans_used = 0;
  std::map<std::string, std::uint64_t> scans_rejected;  ///< by reason
  std::map<std::string, std::uint64_t> input_faults;    ///< by name
  /// Why the solver stopped: windows by reason; with mode batch the one solve of the whole run.
  std::map<std::string, std::uint64_t> solver_terminations;
  std::vector<std::string> warnings;  ///< for people; not in the file
  std::string initialized_from;       ///< "rest" or "motion"; empty: never initialised
  std::string health_at_end = "ok";   ///< "ok", "coasting", "diverged"
  std::uint64_t divergences = 0;
  std::uint64_t reinitializations = 0;
  double path_length_m = 0.0;      ///< of the optimised poses
  double end_to_start_2d_m = 0.0;  ///< of the causal trajectory, horizontal
  double end_to_start_3d_m = 0.0;
  double final_offset_s = 0.0;
  double final_offset_sigma_s = 0.0;
  MeasuredImuNoise imu_noise;  ///< that the IMU showed at the end
  PointVariances radar_noise;  ///< of the radar's points, as learned; the file has its standard deviations
  DopplerStep radar_doppler_step;  ///< as known at the end; the file has its source as a key of its own
  std::array<std::uint64_t, 3> radar_points_per_scan = {};  ///< quantiles of 10, 50 and 90 % of the scans
  std::optional<TruthErrors> truth;
  double estimation_seconds = 0.0;  ///< reading, decoding and estimating, wall clock
  double realtime_factor = 0.0;     ///< seconds of data in a second of that
};

/// Appends `value` with that many decimals (at most 12), with a point whatever the locale; "nan", "inf".
void appendFixed(std::string* text, double value, int decimals);
/// Appends seconds with nine decimals, exactly.
void appendStamp(std::string* text, Time time);

/// The files of a run: trajectory.txt and trajectory_optimized.txt (TUM), navigation.csv, time_offset.csv,
/// ego_velocity.csv, biases.csv, summary.yaml. The same calls write the same bytes.
///
/// navigation.csv has the velocity that goes with trajectory.txt, and how sure the estimate is of itself, ten
/// times a second: v_W [m/s], and standard deviations of p_W [m], of a rotation about the axes of W [rad],
/// and of v_W [m/s].
class RunOutput {
 public:
  /// Makes the folder and opens the files; throws std::runtime_error naming what cannot be written. A summary
  /// of an earlier run is removed, so that one of a run that failed is never taken for its own.
  explicit RunOutput(const std::string& folder);

  void addState(const NavigationState& state);
  void addResult(const ScanResult& result);
  void finish(const RunSummary& summary);  ///< throws std::runtime_error where the disk is full

  static std::vector<std::string> fileNames();

 private:
  /// A file with a large buffer of its own.
  struct File {
    std::string path;
    std::ofstream stream;
    std::string buffer;

    void open(const std::string& path_in);
    void flush();
    void endLine();
  };

  void addPose(File& file, Time time, const Eigen::Vector3d& p_W, const Eigen::Quaterniond& q_WI);

  std::string folder_;
  File trajectory_, optimized_, navigation_, time_offset_, ego_velocity_, biases_;
  std::optional<Time> last_navigation_;  // of the last line in navigation.csv
};

}  // namespace rio_t
