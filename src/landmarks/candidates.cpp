#include "rio_t/landmarks/candidates.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace rio_t {
namespace {

/// [sigma^2 of one detection] A second point nearer than this could be confused with the first.
constexpr double kApart = 16.0;

/// [1] Sigma of s below which 0 and 1 are five sigmas apart.
constexpr double kMaxSlideSigma = 0.2;
/// Twice the four unknowns of (m, s): two ghosts far apart would fit any s.
constexpr std::size_t kMinSightings = 8;
/// [sigma] of s: a twentieth of the static points lies beyond.
constexpr double kMaxSlide = 2.0;

double squaredSigmas(const Eigen::Vector3d& d, const Eigen::Matrix3d& S) { return d.dot(S.llt().solve(d)); }

void addTo(Candidate& candidate, const PlacedDetection& seen) {
  const Eigen::Matrix3d information = seen.covariance.inverse();
  const Eigen::Vector3d ray = (seen.p_W - seen.radar_W).normalized();
  const Eigen::Vector3d way = seen.radar_W - candidate.first_radar_W;
  Eigen::Matrix<double, 3, 4> J;
  J << Eigen::Matrix3d::Identity(), way - ray.dot(way) * ray;
  candidate.fit_information += J.transpose() * information * J;
  candidate.fit_vector += J.transpose() * information * seen.p_W;
  candidate.snr_sum += seen.snr_db;
  ++candidate.count;
  candidate.last_seen = seen.time;
  candidate.sightings.push_back(seen.sighting);
}

}  // namespace

Eigen::Vector3d Candidate::position() const { return information().llt().solve(fit_vector.head<3>()); }

bool Candidate::isProven() const {
  if (count < kMinSightings) return false;
  const Eigen::LDLT<Eigen::Matrix4d> factor(fit_information);
  if (factor.info() != Eigen::Success || factor.vectorD().minCoeff() <= 0.0) return false;
  const double sigma = std::sqrt(factor.solve(Eigen::Vector4d::UnitW())[3]);
  return sigma < kMaxSlideSigma && std::abs(factor.solve(fit_vector)[3]) < kMaxSlide * sigma;
}

void Candidates::add(const std::vector<PlacedDetection>& detections) {
  struct Fit {
    std::size_t detection, candidate;
  };
  const std::size_t known = candidates_.size();
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Matrix3d> covariances;
  for (const Candidate& candidate : candidates_) {
    positions.push_back(candidate.position());
    covariances.emplace_back(candidate.information().inverse());
  }
  std::vector<Fit> fits;
  std::vector<int> fits_of_detection(detections.size(), 0), fits_of_candidate(known, 0);
  for (std::size_t i = 0; i < detections.size(); ++i) {
    const double reach = kGate * detections[i].covariance.trace();
    for (std::size_t k = 0; k < known; ++k) {
      const Eigen::Vector3d d = detections[i].p_W - positions[k];
      if (d.squaredNorm() > reach + kGate * covariances[k].trace()) continue;
      if (squaredSigmas(d, detections[i].covariance + covariances[k]) > kGate) continue;
      fits.push_back({i, k});
      ++fits_of_detection[i];
      ++fits_of_candidate[k];
    }
  }
  for (const Fit& fit : fits) {
    if (fits_of_detection[fit.detection] > 1 || fits_of_candidate[fit.candidate] > 1) continue;
    addTo(candidates_[fit.candidate], detections[fit.detection]);
  }
  for (std::size_t i = 0; i < detections.size() && candidates_.size() < kMax; ++i) {
    if (fits_of_detection[i] > 0) continue;
    Candidate candidate;
    candidate.first_radar_W = detections[i].radar_W;
    addTo(candidate, detections[i]);
    candidates_.push_back(std::move(candidate));
  }
}

void Candidates::forgetOld(Time now, Time oldest_node) {
  const auto is_old = [&](const Candidate& candidate) { return now - candidate.last_seen > kMaxUnseen; };
  candidates_.erase(std::remove_if(candidates_.begin(), candidates_.end(), is_old), candidates_.end());
  for (Candidate& candidate : candidates_) {
    std::vector<Sighting>& sightings = candidate.sightings;
    const auto is_gone = [&](const Sighting& sighting) { return sighting.node_time < oldest_node; };
    sightings.erase(std::remove_if(sightings.begin(), sightings.end(), is_gone), sightings.end());
  }
}

bool Candidates::isAlone(std::size_t k, const std::vector<Eigen::Vector3d>& landmarks_W) const {
  const Candidate& own = candidates_[k];
  const Eigen::Vector3d p_W = own.position();
  const Eigen::Matrix3d of_one = static_cast<double>(own.count) * own.information().inverse();
  const auto isNear = [&](const Eigen::Vector3d& other_W) {
    return squaredSigmas(other_W - p_W, of_one) < kApart;
  };
  if (std::any_of(landmarks_W.begin(), landmarks_W.end(), isNear)) return false;
  for (std::size_t j = 0; j < candidates_.size(); ++j)
    if (j != k && candidates_[j].count > 1 && isNear(candidates_[j].position())) return false;
  return true;
}

std::vector<Candidate> Candidates::takeProven(const std::vector<Eigen::Vector3d>& landmarks_W,
                                              std::size_t count) {
  std::vector<std::size_t> proven;
  for (std::size_t k = 0; k < candidates_.size() && proven.size() < count; ++k) {
    // A landmark needs a sighting that determines its position.
    if (candidates_[k].sightings.empty() || !candidates_[k].isProven()) continue;
    if (isAlone(k, landmarks_W)) proven.push_back(k);
  }
  std::vector<Candidate> taken;
  taken.reserve(proven.size());
  for (const std::size_t k : proven) taken.push_back(candidates_[k]);
  for (auto k = proven.rbegin(); k != proven.rend(); ++k)
    candidates_.erase(candidates_.begin() + static_cast<std::ptrdiff_t>(*k));
  return taken;
}

}  // namespace rio_t
