#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "rio_t/odometry/radar_inertial_odometry.h"
#include "rio_t/smoother/batch_smoother.h"

namespace rio_t {

/// The whole run solved at once.
struct BatchResult {
  /// State at each IMU sample from the start on, carried between the nodes by the IMU.
  std::vector<NavigationState> trajectory;
  /// The results of the online run with the states, offsets and sigmas of the batch, sorted by stamp.
  /// `left_window` of a result has the pose of its node, unless an earlier scan has it already.
  std::vector<ScanResult> scans;
  BatchSolution solution;
};

/// Remembers an online run, then solves the graph over all of it at once (docs/method.md, section 10).
///
/// The online run decides which points and scans are outliers. The batch begins from the online states.
class BatchOdometry {
 public:
  BatchOdometry(const OdometryOptions& options, const BatchOptions& batch);

  /// Adds the samples that the online run has taken, with its bridges (see RadarInertialOdometry::addImu).
  void addImu(const std::vector<ImuMeasurement>& taken);
  /// Call it before addImu if the clock of the IMU jumped before the samples. Drops all samples so far.
  /// Throws std::runtime_error if the online run `has_started`.
  void startAgain(bool has_started);
  /// Adds the result of a scan, without its points.
  void addResult(ScanResult result);

  /// `start`: of the online run. Throws std::runtime_error if no scan was used.
  BatchResult solve(const RadarInertialOdometry::Start& start) const;

 private:
  /// The graph, and for each of its scans the index in scans_.
  struct Run {
    BatchProblem problem;
    std::vector<std::size_t> source;
  };

  Run makeRun(const RadarInertialOdometry::Start& start) const;
  /// None if the platform is free, or if its motion contradicted the constraint of the vehicle.
  std::optional<BatchVehicle> vehicle(const RadarInertialOdometry::Start& start) const;
  /// The means of the pressures that the online run used.
  std::vector<BatchHeight> heights() const;
  /// Sets the measurement of `scan`.
  void setMeasurement(const ScanResult& result, BatchScan& scan) const;
  std::vector<NavigationState> trajectory(const BatchSolution& solution) const;
  std::vector<ScanResult> results(const Run& run, const BatchSolution& solution) const;

  OdometryOptions options_;         // read-only after construction
  BatchOptions batch_;              // read-only after construction
  Eigen::Vector3d g_W_;             // read-only after construction
  double model_error_scale_ = 1.0;  ///< of the online run at its end
  ImuBuffer imu_;
  std::vector<ScanResult> scans_;
};

}  // namespace rio_t
