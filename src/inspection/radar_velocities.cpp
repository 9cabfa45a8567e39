#include "rio_t/inspection/radar_velocities.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rio_t/core/quantile.h"
#include "rio_t/radar/direction.h"
#include "rio_t/radar/ego_velocity.h"
#include "rio_t/sensors/scan_pool.h"

namespace rio_t {
namespace {

constexpr double kGroupSpan = 0.12;      // [s]
constexpr double kFlatElevation = 0.02;  // [rad] if nine in ten points are below, the radar has no elevation
constexpr double kVerticalSigma = 1.0;   // [m/s] of a radar without elevation

bool hasElevation(const std::vector<RadarScan>& scans) {
  std::size_t all = 0, flat = 0;
  for (const RadarScan& scan : scans) {
    for (const RadarPoint& point : scan.points) {
      ++all;
      if (std::abs(elevationOf(point.position_R)) < kFlatElevation) ++flat;
    }
  }
  return 10 * flat < 9 * all;
}

/// Combines the next scans, from `*next` on, to one.
RadarScan nextGroup(const std::vector<RadarScan>& scans, std::size_t* next) {
  RadarScan group = scans[*next];
  double stamps = 0.0;  // sum of the stamps after the first, weighted with the points
  const Time first = group.stamp;
  for (++*next; *next < scans.size() && group.points.size() < ScanPool::kEnoughPoints; ++*next) {
    const RadarScan& scan = scans[*next];
    const double after = scan.stamp - first;
    if (after < 0.0 || after > kGroupSpan) break;
    stamps += after * static_cast<double>(scan.points.size());
    group.points.insert(group.points.end(), scan.points.begin(), scan.points.end());
  }
  if (!group.points.empty()) group.stamp = first + stamps / static_cast<double>(group.points.size());
  return group;
}

/// A radar without elevation does not see the vertical velocity. Adds points straight up and down that show
/// it as zero.
void addVertical(RadarScan* scan) {
  const std::size_t count = 1 + scan->points.size() / 8;
  for (std::size_t i = 0; i < count; ++i) {
    for (const double side : {-1.0, 1.0})
      scan->points.push_back({{0.0, 0.0, 5.0 * side}, 0.0, scan->points.front().snr_db});
  }
}

EgoVelocityOptions inspectionOptions() {
  EgoVelocityOptions options;
  options.min_range = 0.1;
  options.max_range = 1e4;
  options.min_snr_db = -1e9;
  options.max_azimuth = M_PI;
  options.max_elevation = M_PI_2;  // the default is a hair less, and addVertical() adds points straight up
  options.max_sigma = 2.0;
  return options;
}

// Pairs of scans whose ranges are compared.
constexpr double kMinApart = 0.15, kMaxApart = 0.6;  // [s]
constexpr double kMaxTurn = 0.12;                    // [rad]
const double kSameDirection = std::cos(0.14);        // 8 degrees: the noise of an elevation

struct RangedPoint {
  Eigen::Vector3d u_R;
  double range, doppler;
};
/// A scan for the comparison with others.
struct RangedScan {
  Time stamp;
  std::vector<RangedPoint> points;
};

/// Every n-th scan is compared, so that the rate is 20 to 40 Hz. At 20 Hz a scan has ten partners. The number
/// of pairs grows with the square of the rate, and more pairs show no more, since neighbouring scans see the
/// same things.
std::size_t stepOf(const std::vector<RadarScan>& scans) {
  constexpr double kRate = 20.0;  // [Hz]
  const double span = scans.empty() ? 0.0 : scans.back().stamp - scans.front().stamp;
  const double step = span > 0.0 ? static_cast<double>(scans.size() - 1) / span / kRate : 1.0;
  return std::max<std::size_t>(1, static_cast<std::size_t>(step));
}

std::vector<RangedScan> rangedScans(const std::vector<RadarScan>& scans) {
  // Each point is compared with each point of the other scan. So many show the sign; more take minutes.
  constexpr std::size_t kMost = 200;
  std::vector<RangedScan> result;
  const std::size_t step = stepOf(scans);
  for (std::size_t k = 0; k < scans.size(); k += step) {
    const RadarScan& scan = scans[k];
    result.push_back({scan.stamp, {}});
    const std::size_t stride = 1 + scan.points.size() / (kMost + 1);
    for (std::size_t i = 0; i < scan.points.size(); i += stride) {
      const RadarPoint& point = scan.points[i];
      const double range = point.position_R.norm();
      result.back().points.push_back({point.position_R / range, range, point.doppler});
    }
  }
  return result;
}

/// Calls `compare` with the two scans of each pair, and the time between them [s].
template <typename Compare>
void forPairs(const std::vector<RangedScan>& scans, const InertialTrack& track, Compare&& compare) {
  for (std::size_t i = 0; i < scans.size(); ++i) {
    for (std::size_t k = i + 1; k < scans.size(); ++k) {
      const double apart = scans[k].stamp - scans[i].stamp;
      if (apart < kMinApart) continue;
      if (apart > kMaxApart) break;
      if (!track.covers(scans[i].stamp) || !track.covers(scans[k].stamp)) break;
      if (track.rotation(scans[i].stamp).angularDistance(track.rotation(scans[k].stamp)) > kMaxTurn) continue;
      compare(scans[i], scans[k], apart);
    }
  }
}

/// Returns half of the 90 % quantile of the Doppler: above it, noise matters little. It needs no unit.
double largeDoppler(const std::vector<RadarScan>& scans) {
  std::vector<double> dopplers;
  for (const RadarScan& scan : scans)
    for (const RadarPoint& point : scan.points) dopplers.push_back(std::abs(point.doppler));
  return 0.5 * quantile(std::move(dopplers), 0.9);
}

/// Counts how many matches agree on a ratio, over the logarithm of the ratio, for both signs.
class RatioVotes {
 public:
  RatioVotes() : votes_(2 * kBins, 0.0) {}

  /// Adds a range that changed by `change`, while the Doppler says `shift` [m].
  void add(double change, double shift) {
    const double size = std::abs(change), said = std::abs(shift);
    const std::size_t sign = (change > 0.0) == (shift > 0.0) ? 0 : kBins;
    const double first = std::ceil(binOf((size - kTolerance) / said));
    const double last = std::floor(binOf((size + kTolerance) / said));
    for (double bin = std::max(0.0, first); bin <= std::min(kBins - 1.0, last); bin += 1.0) {
      const double error = (size - said * std::exp(logOf(bin))) / kTolerance;
      votes_[sign + static_cast<std::size_t>(bin)] += std::max(0.0, 1.0 - error * error);
    }
  }
  void add(const RatioVotes& other, double sign) {
    for (std::size_t k = 0; k < votes_.size(); ++k) votes_[k] += sign * other.votes_[k];
  }
  /// Returns the logarithm of the ratio that has the most votes beyond those of the same ratio with the other
  /// sign. Matches by chance vote for both alike.
  double peak() const {
    std::size_t top = 0;
    for (std::size_t k = 1; k < votes_.size(); ++k)
      if (lead(k) > lead(top)) top = k;
    const std::size_t bin = top % kBins;
    if (bin == 0 || bin == kBins - 1) return logOf(static_cast<double>(bin));
    const double before = lead(top - 1), at = lead(top), after = lead(top + 1);
    const double curvature = before - 2.0 * at + after;  // a parabola through the three
    return logOf(static_cast<double>(bin) + (curvature < 0.0 ? 0.5 * (before - after) / curvature : 0.0));
  }

  static constexpr double kTolerance = 0.1;  ///< [m] pairs that are farther off are no match

 private:
  static constexpr double kLargest = 200.0, kStep = 0.02;
  static constexpr std::size_t kBins = 531;  // from 1 / kLargest to kLargest
  static double binOf(double ratio) { return (std::log(ratio) + std::log(kLargest)) / kStep; }
  double lead(std::size_t bin) const { return votes_[bin] - votes_[(bin + kBins) % (2 * kBins)]; }
  static double logOf(double bin) { return bin * kStep - std::log(kLargest); }

  std::vector<double> votes_;  // same sign, then the contrary
};

}  // namespace

RadarVelocities radarVelocities(const std::vector<RadarScan>& scans) {
  RadarVelocities result;
  EgoVelocityEstimator estimator(inspectionOptions());
  for (const RadarScan& scan : scans) estimator.observe(scan);  // the step, before the first velocity
  result.doppler_step = estimator.knowledge().doppler_step;
  result.has_elevation = hasElevation(scans);
  for (std::size_t next = 0; next < scans.size();) {
    RadarScan group = nextGroup(scans, &next);
    if (group.points.empty()) continue;
    if (!result.has_elevation) addVertical(&group);
    const EgoVelocity velocity = estimator.estimate(group);
    if (!isValid(velocity.status)) continue;
    if (velocity.status == EgoVelocityStatus::kMoving && result.has_elevation)
      estimator.learn(group, velocity);
    RadarVelocity found{group.stamp, velocity.v_R, velocity.covariance};
    if (!result.has_elevation) found.covariance(2, 2) = kVerticalSigma * kVerticalSigma;
    result.velocities.push_back(found);
  }
  return result;
}

DopplerSign dopplerSignFromRanges(const std::vector<RadarScan>& scans, const InertialTrack& track) {
  constexpr double kMinShift = 0.15;  // [m] by which a range must change
  constexpr double kFar = 0.3;        // [m] a match that is farther off is none
  constexpr double kClear = 3.0;      // [sigma]
  DopplerSign result;
  double sum = 0.0, squares = 0.0;
  int pairs = 0;  // of scans that voted
  forPairs(rangedScans(scans), track, [&](const RangedScan& scan, const RangedScan& later, double apart) {
    double vote = 0.0;
    for (const RangedPoint& point : scan.points) {
      const double shift = point.doppler * apart;
      if (std::abs(shift) < kMinShift) continue;
      double receding = kFar, approaching = kFar;  // nearest match under either sign
      for (const RangedPoint& other : later.points) {
        if (point.u_R.dot(other.u_R) < kSameDirection) continue;
        const double change = other.range - point.range;
        receding = std::min(receding, std::abs(change - shift));
        approaching = std::min(approaching, std::abs(change + shift));
      }
      vote += approaching - receding;
    }
    if (vote == 0.0) return;
    ++pairs;
    sum += vote;
    squares += vote * vote;
  });
  // Neighbouring pairs share their points, up to all pairs that one scan is in.
  if (pairs < 20) return result;
  constexpr double kShared = 4.0;
  result.significance = sum / std::sqrt(squares) / std::sqrt(kShared);
  if (std::abs(result.significance) > kClear) result.sign = result.significance > 0.0 ? 1 : -1;
  return result;
}

RangeRatio rangeRatio(const std::vector<RadarScan>& scans, const InertialTrack& track) {
  constexpr std::size_t kParts = 10, kMinMatches = 200;
  constexpr double kMinChange = 2.0 * RatioVotes::kTolerance;  // else matches of anything would vote
  RangeRatio result;
  const double large = largeDoppler(scans);
  if (large == 0.0) return result;
  RatioVotes all;
  std::vector<RatioVotes> parts(kParts);
  std::size_t matches = 0;
  const std::vector<RangedScan> ranged = rangedScans(scans);
  forPairs(ranged, track, [&](const RangedScan& scan, const RangedScan& later, double apart) {
    const auto index = static_cast<std::size_t>(&scan - ranged.data());
    RatioVotes& part = parts[index * kParts / ranged.size()];
    for (const RangedPoint& point : scan.points) {
      if (std::abs(point.doppler) < large) continue;
      for (const RangedPoint& other : later.points) {
        const double change = other.range - point.range;
        if (std::abs(change) < kMinChange) continue;
        if (point.u_R.dot(other.u_R) < kSameDirection) continue;
        const double doppler = 0.5 * (point.doppler + other.doppler);  // it may change on the way
        if (std::abs(doppler) < large) continue;
        part.add(change, doppler * apart);
        ++matches;
      }
    }
  });
  if (matches < kMinMatches) return result;
  for (const RatioVotes& part : parts) all.add(part, 1.0);
  const double peak = all.peak();
  double squares = 0.0;
  for (const RatioVotes& part : parts) {
    RatioVotes others = all;
    others.add(part, -1.0);
    squares += std::pow(others.peak() - peak, 2);
  }
  constexpr double kFloor = 0.1;  // slow motions and noise give a ratio of up to 1.3 for a right Doppler
  result.ratio = std::exp(peak);
  result.log_sigma = std::sqrt(kFloor * kFloor + squares * (kParts - 1.0) / kParts);
  return result;
}

}  // namespace rio_t
