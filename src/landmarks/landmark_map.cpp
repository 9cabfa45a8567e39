#include "rio_t/landmarks/landmark_map.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace rio_t {
namespace {

/// [sigma^2] A detection beyond this is of something else: only 1 in 100 000 true pairs lies beyond.
constexpr double kElsewhere = 25.9;
/// Competing pairs must be 20 times less likely: twice the logarithm of that.
constexpr double kClearly = 6.0;
/// [sigma] of Cauchy's loss: a match at the gate counts 0.6 of its weight.
constexpr double kLoss = 4.0;
/// [s] If the map is full, a landmark that is unseen for this time makes room for a new one.
constexpr double kLongUnseen = 30.0;
/// False pairs are uniform over the gate, so the mean of their squared sigmas is 3/5 of it. The mean of true
/// pairs is 3. This is the ratio of both.
constexpr double kMeanSquareByChance = Candidates::kGate / 5.0;
/// Half way between the means of true and false pairs. Above it, the map contradicts the estimate. 100
/// matches show the mean with a sigma of 0.08.
constexpr double kMaxMeanSquare = 0.5 * (1.0 + kMeanSquareByChance);
/// Bounds on the share of false pairs. The gate leaves out a hundredth of the true pairs, so the map cannot
/// measure a smaller share. With a share of half, kMaxMeanSquare drops the map.
constexpr double kLeastByChance = 0.01, kMostPairsByChance = 0.5;
/// The number of matches that the map needs before it is trusted: they show the mean with a sigma of 0.15.
constexpr double kProof = 30.0;
/// A reflector is seen in at least this share of the scans that have it in view. In a scene full of
/// highlights that come and go, hardly any landmark is seen again.
constexpr double kMinShare = 0.1;
/// Time constant of the fading sums, in scans.
constexpr double kMemory = 100.0;
/// In view: within this of the middle of the field of view, as the cosine.
constexpr double kCosView = 0.707;

/// [detections] If more false ones are expected in its gate, a landmark is vague. In a room a landmark is
/// seen in 0.2 to 0.4 of the scans.
constexpr double kMostByChance = 0.5;

/// [m^3] in which a detection passes the gate, without its own noise.
double gateVolume(const Eigen::Matrix3d& covariance) {
  return 4.0 / 3.0 * M_PI * std::pow(Candidates::kGate, 1.5) *
         std::sqrt(std::max(0.0, covariance.determinant()));
}

/// [m^3] that a radar sees to this range.
double viewVolume(double range) { return 2.0 / 3.0 * M_PI * (1.0 - kCosView) * range * range * range; }

/// The measurement with its information multiplied by `weight`.
PolarMeasurement weighted(PolarMeasurement z, double weight) {
  const double wider = 1.0 / std::sqrt(weight);
  z.range_sigma *= wider;
  z.azimuth_sigma *= wider;
  z.elevation_sigma *= wider;
  return z;
}

}  // namespace

double probabilityOfTruth(double squared_sigmas, double by_chance) {
  const double true_density =
      (1.0 - by_chance) * std::pow(2.0 * M_PI, -1.5) * std::exp(-0.5 * squared_sigmas);
  const double chance_density = by_chance / gateVolume(Eigen::Matrix3d::Identity());
  return true_density / (true_density + chance_density);
}

double shareByChance(double sum, double pairs) {
  if (pairs <= 0.0) return kMostPairsByChance;
  const double share = (sum / pairs - 1.0) / (kMeanSquareByChance - 1.0);
  return std::clamp(share, kLeastByChance, kMostPairsByChance);
}

LandmarkMap::LandmarkMap(const LandmarkOptions& options, const Eigen::Vector3d& g_W, const ImuBuffer& imu)
    : options_(options),
      g_W_(g_W),
      imu_(&imu),
      manifold_(std::make_shared<PointManifold>()),
      loss_(std::make_shared<ceres::CauchyLoss>(kLoss)) {}

void LandmarkMap::forget() {
  landmarks_.clear();
  candidates_.clear();
  in_view_ = matched_ = sigmas_ = 0.0;
  is_trusted_ = false;
}

std::vector<LandmarkPoint> LandmarkMap::points() const {
  std::vector<LandmarkPoint> points;
  for (const Landmark& landmark : landmarks_) {
    points.push_back(landmark.point);
    points.back().p_W = landmark.p_W();
  }
  return points;
}

std::optional<LandmarkMap::Prediction> LandmarkMap::predict(const FixedLagSmoother& smoother, Time measured,
                                                            const Block& extrinsics) const {
  std::vector<const Block*> blocks;
  Prediction prediction;
  prediction.measured = measured;
  prediction.first_landmark = StateBlock::kTangent;
  if (!extrinsics.is_constant) {
    blocks.push_back(&extrinsics);
    prediction.mounting_columns = extrinsics.manifold->columns();
    prediction.first_landmark += prediction.mounting_columns.size();
  }
  const std::optional<NodeEstimate> node = smoother.nodeBefore(measured);
  if (!node) return std::nullopt;
  const Extrinsics T_IR = toExtrinsics(extrinsics.x.data());
  const Eigen::Matrix3d R_RW = (node->x.q_WI() * T_IR.q_IR).conjugate().toRotationMatrix();
  const Eigen::Vector3d radar_W = node->x.p_W() + node->x.q_WI() * T_IR.l_I;
  for (std::size_t k = 0; k < landmarks_.size(); ++k) {
    if ((R_RW * (landmarks_[k].p_W() - radar_W)).y() <= 0.0) continue;  // behind the radar
    prediction.landmarks.push_back(k);
    blocks.push_back(landmarks_[k].block.get());
  }
  std::optional<PredictedState> state = smoother.predict(measured, blocks);
  if (!state) return std::nullopt;
  prediction.state = std::move(*state);
  return prediction;
}

LandmarkMap::Expected LandmarkMap::expected(const Prediction& prediction, const Extrinsics& T_IR,
                                            std::size_t column) const {
  const Eigen::MatrixXd& P = prediction.state.covariance;
  const auto shared = static_cast<Eigen::Index>(prediction.first_landmark);
  const SeenPoint seen = seenFrom(MotionView(prediction.state.x.data()), ImuDelta(), g_W_, T_IR,
                                  landmarks_[prediction.landmarks[column]].p_W());
  // The derivative by state, extrinsics and landmark, in their tangents.
  Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, shared + 3);
  J.setZero();
  J.leftCols<3>() = seen.J_motion.leftCols<3>();
  J.middleCols<3>(StateBlock::kP) = seen.J_motion.middleCols<3>(StateBlock::kPStored);
  Eigen::Index mounting = StateBlock::kTangent;
  for (const int stored : prediction.mounting_columns) J.col(mounting++) = seen.J_extrinsics.col(stored);
  J.rightCols<3>() = seen.J_point;
  Eigen::MatrixXd own(shared + 3, shared + 3);
  const Eigen::Index at = shared + 3 * static_cast<Eigen::Index>(column);
  own.topLeftCorner(shared, shared) = P.topLeftCorner(shared, shared);
  own.topRightCorner(shared, 3) = P.block(0, at, shared, 3);
  own.bottomLeftCorner(3, shared) = P.block(at, 0, 3, shared);
  own.bottomRightCorner<3, 3>() = P.block<3, 3>(at, at);
  return {seen.p_R, J * own * J.transpose()};
}

LandmarkMap::Association LandmarkMap::associate(const Prediction& prediction, const Extrinsics& T_IR,
                                                const std::vector<Detection>& detections) const {
  std::vector<PolarNoise> noises;
  std::vector<double> spreads;  // [m^2] trace of the covariance
  for (const Detection& detection : detections) {
    noises.emplace_back(detection.z);
    spreads.push_back(noises.back().covariance().trace());
  }
  Association result;
  std::vector<Pair> pairs;
  std::vector<bool> is_free(detections.size(), true);
  for (std::size_t column = 0; column < prediction.landmarks.size(); ++column) {
    const std::size_t k = prediction.landmarks[column];
    const LandmarkPoint& point = landmarks_[k].point;
    const Expected expected = this->expected(prediction, T_IR, column);
    const double by_chance =
        static_cast<double>(detections.size()) * gateVolume(expected.covariance) / viewVolume(reach_);
    result.is_vague.push_back(by_chance > kMostByChance);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < detections.size(); ++i) {
      const Detection& detection = detections[i];
      const double away = (detection.z.position_R - expected.p_R).squaredNorm();
      if (away > kElsewhere * (expected.covariance.trace() + spreads[i])) continue;
      const PolarResidual residual = noises[i].at(expected.p_R);
      Eigen::Matrix3d S = residual.J * expected.covariance * residual.J.transpose();
      S.diagonal().array() += 1.0;
      const double squared = residual.value.dot(S.llt().solve(residual.value));
      if (squared > kElsewhere) continue;
      is_free[i] = false;
      nearest = std::min(nearest, squared);
      const double strength = (detection.snr_db - point.snr_db) / kEchoScatter;
      const double n = static_cast<double>(point.sightings);
      const double score = squared + std::log(S.determinant()) + strength * strength / (1.0 + 1.0 / n);
      pairs.push_back({{i, k, squared}, score});
    }
    if (nearest > Candidates::kGate && nearest <= kElsewhere) result.conflicts.push_back(k);
  }
  for (std::size_t i = 0; i < detections.size(); ++i)
    if (is_free[i]) result.free.push_back(i);
  result.matches = clearMatches(pairs);
  return result;
}

std::vector<LandmarkMap::Match> LandmarkMap::clearMatches(const std::vector<Pair>& pairs) {
  std::vector<Match> matches;
  for (const Pair& pair : pairs) {
    if (pair.match.squared_sigmas > Candidates::kGate) continue;
    const bool is_clear = std::none_of(pairs.begin(), pairs.end(), [&](const Pair& other) {
      const bool competes =
          (other.match.detection == pair.match.detection) != (other.match.landmark == pair.match.landmark);
      return competes && other.score < pair.score + kClearly;
    });
    if (is_clear) matches.push_back(pair.match);
  }
  return matches;
}

LandmarkAnswer LandmarkMap::use(const Prediction& prediction, const std::vector<Detection>& detections,
                                Block& node, Block& extrinsics, FixedLagSmoother& smoother) {
  LandmarkAnswer answer;
  for (const Detection& detection : detections) reach_ = std::max(reach_, detection.z.position_R.norm());
  const Extrinsics T_IR = toExtrinsics(extrinsics.x.data());
  const Association association = associate(prediction, T_IR, detections);
  if (!judge(prediction, T_IR, association)) {
    while (!landmarks_.empty()) retire(landmarks_.size() - 1);
    forget();
    answer.dropped_map = true;
    return answer;
  }
  const StateView at_node(node.x.data(), smoother.biases().x.data());
  const ImuDelta delta = integrate(*imu_, *node.time, prediction.measured, at_node.b_g, at_node.b_a);
  for (const Match& match : association.matches) {
    Landmark& landmark = landmarks_[match.landmark];
    if (is_trusted_) {
      const double weight = probabilityOfTruth(match.squared_sigmas, shareByChance(sigmas_, matched_));
      const PolarMeasurement z = weighted(detections[match.detection].z, weight);
      smoother.window().add(std::make_unique<LandmarkFactor>(z, delta, g_W_),
                            {&node, &extrinsics, landmark.block.get()}, loss_);
    }
    landmark.last_seen = prediction.measured;
    LandmarkPoint& point = landmark.point;
    ++point.sightings;
    point.snr_db +=
        (detections[match.detection].snr_db - point.snr_db) / static_cast<double>(point.sightings);
    landmark.conflicts = std::max(0.0, landmark.conflicts - 1.0);
  }
  for (std::size_t column = 0; column < prediction.landmarks.size(); ++column) {
    const auto at = static_cast<Eigen::Index>(prediction.first_landmark + 3 * column);
    landmarks_[prediction.landmarks[column]].point.sigma =
        std::sqrt(prediction.state.covariance.diagonal().segment<3>(at).sum());
  }
  for (const std::size_t k : association.conflicts) landmarks_[k].conflicts += 1.0;
  candidates_.forgetOld(prediction.measured, smoother.node(0).time);
  addCandidates(prediction, detections, association, node, delta, extrinsics);
  dropUseless(prediction.state.x.p_W());
  promote(smoother, prediction.measured);
  answer.is_trusted = is_trusted_;
  answer.map = points();
  return answer;
}

void LandmarkMap::addCandidates(const Prediction& prediction, const std::vector<Detection>& detections,
                                const Association& association, const Block& node, const ImuDelta& delta,
                                Block& extrinsics) {
  const StateBlock& x = prediction.state.x;
  const Extrinsics T_IR = toExtrinsics(extrinsics.x.data());
  const Eigen::Quaterniond q_WR = x.q_WI() * T_IR.q_IR;
  const Eigen::Matrix3d R_WR = q_WR.toRotationMatrix();
  const Eigen::Vector3d radar_W = x.p_W() + x.q_WI() * T_IR.l_I;
  std::vector<PlacedDetection> placed;
  for (const std::size_t i : association.free) {
    const Detection& detection = detections[i];
    placed.push_back({radar_W + R_WR * detection.z.position_R,
                      R_WR * PolarNoise(detection.z).covariance() * R_WR.transpose(), radar_W,
                      detection.snr_db, prediction.measured,
                      Sighting{*node.time, delta, &extrinsics, detection.z}});
  }
  candidates_.add(placed);
}

bool LandmarkMap::judge(const Prediction& prediction, const Extrinsics& T_IR,
                        const Association& association) {
  const double keep = 1.0 - 1.0 / kMemory;
  in_view_ *= keep;
  matched_ *= keep;
  sigmas_ *= keep;
  const StateBlock& x = prediction.state.x;
  const Eigen::Vector3d radar_W = x.p_W() + x.q_WI() * T_IR.l_I;
  const Eigen::Vector3d forward_W = x.q_WI() * T_IR.q_IR * Eigen::Vector3d::UnitY();
  double in_view = 0.0, vague = 0.0;
  for (std::size_t column = 0; column < prediction.landmarks.size(); ++column) {
    const std::size_t k = prediction.landmarks[column];
    if (forward_W.dot((landmarks_[k].p_W() - radar_W).normalized()) < kCosView) continue;
    landmarks_[k].in_view += 1.0;
    in_view += 1.0;
    if (association.is_vague[column]) vague += 1.0;
  }
  in_view_ += in_view;
  for (const Match& match : association.matches) {
    landmarks_[match.landmark].seen_again += 1.0;
    matched_ += 1.0;
    sigmas_ += match.squared_sigmas / 3.0;
  }
  const bool is_wrong = contradicts();
  if (matched_ >= kProof && matched_ >= kMinShare * in_view_ && !is_wrong) is_trusted_ = true;
  return !is_wrong && vague <= 0.5 * in_view;
}

/// Whether the matches do not fit the map, or a trusted map is hardly seen any more.
bool LandmarkMap::contradicts() const {
  if (matched_ >= kProof && sigmas_ > kMaxMeanSquare * matched_) return true;
  return is_trusted_ && in_view_ > kProof / kMinShare && matched_ < 0.5 * kMinShare * in_view_;
}

void LandmarkMap::retire(std::size_t k) {
  landmarks_[k].block->is_retired = true;
  landmarks_.erase(landmarks_.begin() + static_cast<std::ptrdiff_t>(k));
}

void LandmarkMap::dropUseless(const Eigen::Vector3d& p_W) {
  constexpr double kMaxConflicts = 3.0;
  for (std::size_t k = landmarks_.size(); k-- > 0;) {
    const bool is_far = (landmarks_[k].p_W() - p_W).norm() > 1.2 * reach_;
    const Landmark& landmark = landmarks_[k];
    const bool is_gone =
        landmark.in_view > kMemory && landmark.seen_again < 0.5 * kMinShare * landmark.in_view;
    if (is_far || is_gone || landmark.conflicts > kMaxConflicts) retire(k);
  }
}

void LandmarkMap::makeRoom(Time now) {
  while (landmarks_.size() >= options_.max_landmarks && !landmarks_.empty()) {
    const auto oldest =
        std::min_element(landmarks_.begin(), landmarks_.end(),
                         [](const auto& a, const auto& b) { return a.last_seen < b.last_seen; });
    if (now - oldest->last_seen < kLongUnseen) return;
    retire(static_cast<std::size_t>(oldest - landmarks_.begin()));
  }
}

void LandmarkMap::promote(FixedLagSmoother& smoother, Time now) {
  std::vector<Eigen::Vector3d> landmarks_W;
  for (const Landmark& landmark : landmarks_) landmarks_W.push_back(landmark.p_W());
  makeRoom(now);
  if (landmarks_.size() >= options_.max_landmarks) return;
  const std::vector<Candidate> proven =
      candidates_.takeProven(landmarks_W, options_.max_landmarks - landmarks_.size());
  for (const Candidate& candidate : proven) {
    Landmark landmark;
    landmark.block = smoother.window().addCalibration(manifold_, candidate.position());
    landmark.last_seen = now;
    landmark.point.id = next_id_++;
    landmark.point.sightings = candidate.count;
    landmark.point.snr_db = candidate.snr_db();
    // One sighting only places the landmark. More also constrain the motion, as only a trusted map may.
    for (auto sighting = candidate.sightings.rbegin(); sighting != candidate.sightings.rend(); ++sighting) {
      Block* node = smoother.nodeAt(sighting->node_time);
      smoother.window().add(std::make_unique<LandmarkFactor>(sighting->z, sighting->delta, g_W_),
                            {node, sighting->extrinsics, landmark.block.get()}, loss_);
      if (!is_trusted_) break;
    }
    landmarks_.push_back(std::move(landmark));
  }
}

}  // namespace rio_t
