#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/diagnosis/diagnosis.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

/// Errors against ground truth, as evo gives them.
struct TruthErrors {
  double ate_m = 0.0;               ///< rmse, origins aligned
  std::optional<double> t_rel;      ///< [m/m] over 1 m, rmse; none if the estimate is shorter
  std::optional<double> r_rel_deg;  ///< [deg/m] likewise
};

/// How the solver of mode batch ended.
struct BatchSummary {
  int iterations = 0;
  int placements = 0;  ///< how often the nodes were placed
  bool converged = false;
};

/// Messages of one topic that cannot be used for one reason.
struct NotUsable {
  std::string kind, topic;
  std::string why;  ///< of the first of them
  std::uint64_t count = 0;
  bool is_scan = false;

  std::string text() const { return why + " (messages: " + std::to_string(count) + ")"; }
};

/// The result of a run: the evidence for the diagnosis, and what else the files and the table show.
struct RunSummary : RunEvidence {
  explicit RunSummary(RunEvidence evidence = {}) : RunEvidence(std::move(evidence)) {}

  std::string mode = "online";
  std::optional<BatchSummary> batch;  ///< only with mode batch
  std::vector<std::string> warnings;  ///< for the user; not in the file
  std::vector<NotUsable> not_usable;  ///< likewise
  double path_length_m = 0.0;         ///< of the optimised poses
  // Only if the trajectory never starts again (no `imu_restarts`), from its first to its last causal pose:
  double end_to_start_2d_m = 0.0;  ///< horizontal
  double end_to_start_3d_m = 0.0;
  std::optional<BarometerCounts> barometer;  ///< only with a barometer_topic
  Diagnosis diagnosis;                       ///< whether the run is good, and if not, why
  std::optional<TruthErrors> truth;          ///< none if the trajectory starts again
  double estimation_seconds = 0.0;           ///< reading, decoding and estimating, wall clock
  double realtime_factor = 0.0;              ///< seconds of data per second of estimation_seconds

  // Over all radars.
  std::uint64_t scansTotal() const;
  std::uint64_t scansUsed() const;
  Counts scansRejected() const;
};

/// The text of summary.yaml. `saved`: the files of the run.
std::string summaryText(const RunSummary& summary, const std::vector<std::string>& saved);

/// A file of a run and its header line, which may be empty.
struct RunFile {
  std::string name, header;
};

/// Which files a run writes. With several radars, those of a radar carry its name.
struct RunFiles {
  std::vector<std::string> radars = {""};  ///< names, as in RadarSummary
  bool extrinsics = false;                 ///< the run estimates them
  bool barometer = false;                  ///< the run has a barometer
  bool ground_vehicle = false;             ///< the platform is a ground vehicle
  bool map = false;                        ///< landmarks are on

  std::vector<RunFile> all() const;  ///< all except summary.yaml
  std::vector<std::string> names() const;
};
RunFiles runFiles(const Config& config);

/// A file of the run cannot be written. The bag is not at fault.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Locks a folder, so that no two runs write there at once. Throws OutputError if another run has the lock.
/// It has no effect on a file system without locks.
class FolderLock {
 public:
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

/// The files of a run: docs/ros.md (Outputs) says what is in them. The same calls write the same bytes.
class RunOutput {
 public:
  /// Makes the folder and opens the files. Throws OutputError if a file cannot be written, or if another run
  /// writes there. Removes the files that summary.yaml of an earlier run lists, so that nobody takes them for
  /// files of this run.
  explicit RunOutput(const std::string& folder, const RunFiles& files = {});
  /// Saves the tables of a run that failed, as far as they go. Such a run has no summary.yaml.
  ~RunOutput();
  RunOutput(const RunOutput&) = delete;
  RunOutput& operator=(const RunOutput&) = delete;

  // These throw OutputError if the disk is full.
  void addState(const NavigationState& state);
  void addResult(const ScanResult& result);
  void finish(const RunSummary& summary);

 private:
  /// A table with a large buffer. The columns of a line are added one after the other.
  struct File {
    std::string path;
    std::ofstream stream;
    std::string buffer;

    /// Empties it, and begins it with `text`.
    void open(const std::string& path_in, const std::string& text);
    void flush();
    void flushIfFull();
    File& add(std::initializer_list<double> values, int decimals);
    File& add(const Eigen::Vector3d& v, int decimals);
    File& add(const Eigen::Quaterniond& q, int decimals);  ///< x, y, z, w
    File& add(const std::string& text);
    void endLine();
  };

  File& file(std::string_view name) { return open_.find(name)->second; }  // one of files_
  File& row(std::string_view name, Time stamp);                           // begins a line of that file
  void addAids(const ScanResult& result);
  void addPose(std::string_view name, const StampedPose& pose);

  std::string folder_;
  RunFiles files_;
  std::optional<FolderLock> lock_;
  std::map<std::string, File, std::less<>> open_;     // by name
  std::map<std::uint64_t, LandmarkPoint> landmarks_;  // every landmark of the run, by id, in its last state
  std::optional<Time> last_navigation_;               // of the last line in navigation.csv
};

}  // namespace rio_t
