#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/landmarks/detection.h"

namespace rio_t {

/// A thing that may become a landmark: detections of the last window that lie on one point.
struct Candidate {
  std::vector<Sighting> sightings;  ///< in the order of time
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  ///< of the position [1/m^2]
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();       ///< information times position
  double snr_sum = 0.0;

  Eigen::Vector3d position() const { return information.llt().solve(vector); }  ///< p_W [m]
  double snr_db() const { return snr_sum / static_cast<double>(sightings.size()); }
};

/// A detection in W, with the pose as predicted.
struct PlacedDetection {
  Eigen::Vector3d p_W;
  Eigen::Matrix3d covariance;  ///< of the measurement alone, in W [m^2]
  double snr_db;
  Sighting sighting;
};

/// The candidates. Bounded: a candidate lives for one window, and there are no more than kMax. Not
/// thread-safe.
class Candidates {
 public:
  static constexpr std::size_t kMax = 300;
  /// A static point shows itself so often within the window. Ghosts do not come back.
  static constexpr std::size_t kMinSightings = 4;

  /// Adds the detections of a scan, each to the one candidate that it fits, or as a new one. A detection that
  /// fits several is left out.
  void add(const std::vector<PlacedDetection>& detections);
  /// Forgets sightings from before `oldest_node`: their poses are gone.
  void dropBefore(Time oldest_node);
  void clear() { candidates_.clear(); }
  std::size_t size() const { return candidates_.size(); }
  /// Those that have proved static for `duration` and that nothing else can be taken for; they leave.
  std::vector<Candidate> takeProven(double duration, const std::vector<Eigen::Vector3d>& landmarks_W,
                                    std::size_t count);

 private:
  bool isAlone(std::size_t k, const std::vector<Eigen::Vector3d>& landmarks_W) const;

  std::vector<Candidate> candidates_;
};

}  // namespace rio_t
