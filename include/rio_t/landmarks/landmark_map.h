#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "rio_t/landmarks/candidates.h"
#include "rio_t/landmarks/landmark_answer.h"
#include "rio_t/landmarks/options.h"
#include "rio_t/smoother/fixed_lag_smoother.h"

namespace rio_t {

/// Probability that a pair within the gate is true, if the share `by_chance` of the pairs is false.
double probabilityOfTruth(double squared_sigmas, double by_chance);
/// The share of false pairs. `sum` is over the squared sigmas of all pairs, divided by 3.
double shareByChance(double sum, double pairs);

/// Static detections as landmarks: points of the world in the window of the smoother, correlated with all
/// that is estimated (docs/method.md, section 16). One map for all radars. Not thread-safe.
class LandmarkMap {
 public:
  /// `imu` must outlive the map.
  LandmarkMap(const LandmarkOptions& options, const Eigen::Vector3d& g_W, const ImuBuffer& imu);

  /// State and landmarks jointly, when a scan was taken.
  struct Prediction {
    Time measured;
    PredictedState state;  ///< joint with the extrinsics, if they are estimated, and with the landmarks
    std::vector<int> mounting_columns;   ///< Manifold::columns of the extrinsics, if they are estimated
    std::size_t first_landmark = 0;      ///< column of the first landmark in the covariance
    std::vector<std::size_t> landmarks;  ///< their indices, in the order of the columns
  };
  /// Call it before the terms of the scan go into the window. None if the time is before the window.
  std::optional<Prediction> predict(const FixedLagSmoother& smoother, Time measured,
                                    const Block& extrinsics) const;
  /// Associates the detections, adds the terms of those that match, and adds and drops landmarks. The window
  /// must be optimised afterwards. `node` is that of the scan.
  LandmarkAnswer use(const Prediction& prediction, const std::vector<Detection>& detections, Block& node,
                     Block& extrinsics, FixedLagSmoother& smoother);
  /// Clears the map, since the window has started again without landmarks.
  void forget();

 private:
  struct Landmark {
    std::shared_ptr<Block> block;
    LandmarkPoint point;
    Time last_seen;
    double conflicts = 0.0;
    double in_view = 0.0, seen_again = 0.0;  ///< scans since it is a landmark
    Eigen::Vector3d p_W() const { return block->x; }
  };
  struct Match {
    std::size_t detection, landmark;
    double squared_sigmas;
  };
  struct Association {
    std::vector<Match> matches;
    std::vector<std::size_t> free;       ///< detections far from every landmark
    std::vector<std::size_t> conflicts;  ///< landmarks with a detection just beyond the gate, and no match
    /// Per predicted landmark: its position is so uncertain that false detections are likely in the gate.
    std::vector<bool> is_vague;
  };
  Association associate(const Prediction& prediction, const Extrinsics& T_IR,
                        const std::vector<Detection>& detections) const;
  /// The position at which the radar should see a landmark.
  struct Expected {
    Eigen::Vector3d p_R;
    Eigen::Matrix3d covariance;  ///< of p_R [m^2]
  };
  /// Predicts the landmark in this column of the prediction.
  Expected expected(const Prediction& prediction, const Extrinsics& T_IR, std::size_t column) const;
  struct Pair {
    Match match;
    double score;  ///< twice the negative logarithm of its likelihood
  };
  /// Returns the pairs within the gate whose detection and landmark are in no other likely pair.
  static std::vector<Match> clearMatches(const std::vector<Pair>& pairs);
  /// The detections that belong to no landmark become candidates. `delta` as in a LandmarkFactor.
  void addCandidates(const Prediction& prediction, const std::vector<Detection>& detections,
                     const Association& association, const Block& node, const ImuDelta& delta,
                     Block& extrinsics);
  void retire(std::size_t k);
  void dropUseless(const Eigen::Vector3d& p_W);
  void makeRoom(Time now);
  void promote(FixedLagSmoother& smoother, Time now);
  /// Judges the map by the recent matches. Returns false if the map must be dropped.
  bool judge(const Prediction& prediction, const Extrinsics& T_IR, const Association& association);
  bool contradicts() const;
  std::vector<LandmarkPoint> points() const;

  LandmarkOptions options_;  // read-only after construction, as the next three
  Eigen::Vector3d g_W_;
  const ImuBuffer* imu_;
  std::shared_ptr<const Manifold> manifold_;
  std::shared_ptr<ceres::LossFunction> loss_;
  std::vector<Landmark> landmarks_;
  Candidates candidates_;
  std::uint64_t next_id_ = 0;
  double reach_ = 0.0;                    ///< [m] of the farthest static detection so far
  double in_view_ = 0.0, matched_ = 0.0;  ///< fading sums: landmarks in view, and matches
  double sigmas_ = 0.0;                   ///< fading sum of the matches' squared sigmas over 3
  bool is_trusted_ = false;
};

}  // namespace rio_t
