#pragma once

#include <Eigen/Core>
#include <vector>

#include "rio_t/core/time.h"
#include "rio_t/factors/landmark_factor.h"
#include "rio_t/graph/window.h"
#include "rio_t/imu/preintegration.h"

namespace rio_t {

/// A point of a scan that looks static by its Doppler.
struct Detection {
  PolarMeasurement z;
  double snr_db = 0.0;
};

/// A detection as a term of the window needs it.
struct Sighting {
  Time node_time;
  ImuDelta delta;               ///< from the node to the time of measurement
  Block* extrinsics = nullptr;  ///< of the radar that saw it
  PolarMeasurement z;
};

/// [dB] Scatter of the echo of one reflector from scan to scan: the power of many small reflectors is
/// exponentially distributed (Swerling), and 10 log10 of that has this standard deviation.
constexpr double kEchoScatter = 5.57;

/// Detections of one point that may become a landmark.
///
/// A highlight on a wall slides along with the radar, and a part of the platform moves with it. So the
/// detections are fitted by p = m + s d, where d is the motion of the radar since the first of them, across
/// the ray: s is 0 for a static point, and up to 1 for one that slides.
struct Candidate {
  std::vector<Sighting> sightings;  ///< those of the window, in the order of time
  Time last_seen;
  Eigen::Vector3d first_radar_W = Eigen::Vector3d::Zero();    ///< where the radar was at first [m]
  Eigen::Matrix4d fit_information = Eigen::Matrix4d::Zero();  ///< of (m, s)
  Eigen::Vector4d fit_vector = Eigen::Vector4d::Zero();       ///< fit_information times (m, s)
  double snr_sum = 0.0;
  std::size_t count = 0;  ///< of all detections

  /// Information of the position, if the point does not slide (s = 0) [1/m^2].
  Eigen::Matrix3d information() const { return fit_information.topLeftCorner<3, 3>(); }
  Eigen::Vector3d position() const;  ///< p_W [m]
  double snr_db() const { return snr_sum / static_cast<double>(count); }
  /// Whether the detections show that the point does not slide.
  bool isProven() const;
};

/// A detection in W, with the pose as predicted.
struct PlacedDetection {
  Eigen::Vector3d p_W;
  Eigen::Matrix3d covariance;  ///< of the measurement alone, in W [m^2]
  Eigen::Vector3d radar_W;     ///< where the radar was [m]
  double snr_db = 0.0;
  Time time;
  Sighting sighting;
};

/// At most kMax candidates. One that is not seen for kMaxUnseen is dropped. Not thread-safe.
class Candidates {
 public:
  /// chi-squared of 3 degrees of freedom: 1 % of the true pairs of detections and points lie beyond.
  static constexpr double kGate = 11.34;
  static constexpr std::size_t kMax = 300;
  static constexpr double kMaxUnseen = 2.0;  ///< [s]

  /// Adds the detections of a scan, each to the one candidate that it fits, or as a new one. A detection that
  /// fits several is left out.
  void add(const std::vector<PlacedDetection>& detections);
  /// Forgets unseen candidates, and sightings from before `oldest_node`: their poses are gone.
  void forgetOld(Time now, Time oldest_node);
  void clear() { candidates_.clear(); }
  std::size_t size() const { return candidates_.size(); }
  /// Removes and returns proven candidates, at most `count`. No other candidate or landmark is near them.
  std::vector<Candidate> takeProven(const std::vector<Eigen::Vector3d>& landmarks_W, std::size_t count);

 private:
  bool isAlone(std::size_t k, const std::vector<Eigen::Vector3d>& landmarks_W) const;

  std::vector<Candidate> candidates_;
};

}  // namespace rio_t
