#include "rio_t/simulation/radar_model.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "rio_t/core/angle.h"
#include "rio_t/core/format.h"
#include "rio_t/radar/direction.h"
#include "rio_t/simulation/random.h"
#include "rio_t/simulation/sample_count.h"

namespace rio_t::simulation {
namespace {

constexpr std::uint64_t kSceneStream = 20;
constexpr std::uint64_t kScanStream = 21;
constexpr std::uint64_t kPersonStream = 22;
constexpr std::uint64_t kDropoutStream = 23;
constexpr std::uint64_t kLatencyStream = 24;
constexpr std::uint64_t kCrowdStream = 25;
constexpr std::uint64_t kAmbiguousStream = 26;

// [m] Largest horizontal distance of a reflector from its station: a little beyond the range of such a radar.
constexpr double kSceneRadius = 13.0;

void check(const RadarModelOptions& o) {
  const auto require = [](bool ok, const char* what) {
    if (!ok) throw std::invalid_argument(std::string("radar: ") + what);
  };
  const auto is_share = [](double share) { return share >= 0.0 && share <= 1.0; };
  require(o.rate > 0.0, "rate must be positive");
  require(o.first_trigger >= 0.0, "first trigger cannot be before the start");
  require(o.frame_length >= 0.0, "frame length cannot be negative");
  require(o.latency >= 0.0 && o.latency_sigma >= 0.0, "latency cannot be negative");
  require(o.latency <= kLongest && o.latency_sigma <= kLongest,
          "latency and its sigma (latency, latency-sigma) must be at most 1e6 s, the longest motion");
  require(o.points_mean > 0.0 && o.points_sigma >= 0.0 && o.points_max > 0,
          "number of points must be positive");
  require(o.points_mean <= o.points_max,
          "mean number of points (points) must not be above its limit (points-max)");
  require(o.points_min >= 0 && o.points_min <= o.points_max,
          "fewest points (points-min) must be from 0 to the limit (points-max)");
  require(o.min_range >= 0.0 && o.max_range > o.min_range,
          "maximum range (max-range) must be above the minimum (min-range)");
  require(o.fov_azimuth > 0.0 && o.fov_azimuth <= 90.0,
          "azimuth limit (fov-azimuth-deg) must be in (0, 90] degrees");
  require(o.fov_elevation > 0.0 && o.fov_elevation <= 90.0,
          "elevation limit (fov-elevation-deg) must be in (0, 90] degrees");
  require(
      o.range_noise >= 0.0 && o.azimuth_noise >= 0.0 && o.elevation_noise >= 0.0 && o.doppler_noise >= 0.0,
      "noise cannot be negative");
  require(o.doppler_step >= 0.0, "Doppler quantisation cannot be negative");
  require(o.doppler_span >= 0.0, "Doppler span (doppler-span) cannot be negative");
  if (o.doppler_span > 0.0 && o.doppler_step > 0.0) {
    // The radar has the bins of a Fourier transform: the value beyond the last bin is the first one again.
    const double steps = o.doppler_span / o.doppler_step;
    require(steps > 0.5 && std::abs(steps - std::round(steps)) < 1e-6 * steps,
            "Doppler span (doppler-span) must be a whole number of steps (doppler-step)");
  }
  require(is_share(o.ghost_share) && is_share(o.ambiguous_share) && is_share(o.moving_share) &&
              is_share(o.dropout_share),
          "shares must be in [0, 1]");
  require(o.crowd >= 1, "a crowd must be one person or more");
}

struct RadarState {
  Eigen::Vector3d p_W;
  Eigen::Quaterniond q_WR;
  Eigen::Vector3d v_W;
};

RadarState radarState(const MotionState& imu, const Extrinsics& T_IR) {
  return {imu.p_W + imu.q_WI * T_IR.l_I, imu.q_WI * T_IR.q_IR,
          imu.v_W + imu.q_WI * imu.omega_I.cross(T_IR.l_I)};
}

// Not elevationOf(), which rounds differently: the same seed must always give the same bag.
double elevation(const Eigen::Vector3d& p_R) { return std::atan2(p_R.z(), std::hypot(p_R.x(), p_R.y())); }

/// A point at this range, anywhere in the view.
Eigen::Vector3d anywhere(double range, const RadarModelOptions& o, Random& random) {
  const double az = o.fov_azimuth * kDegree * random.uniform(-1.0, 1.0);
  const double el = o.fov_elevation * kDegree * random.uniform(-1.0, 1.0);
  return range * directionOf(az, o.measures_elevation ? el : 0.0);
}

bool visible(const Eigen::Vector3d& p_R, const RadarModelOptions& o) {
  const double range2 = p_R.squaredNorm();
  if (range2 > o.max_range * o.max_range || range2 < o.min_range * o.min_range) return false;
  return std::abs(azimuthOf(p_R)) <= o.fov_azimuth * kDegree &&
         std::abs(elevation(p_R)) <= o.fov_elevation * kDegree;
}

// Range rate of something at p_W that moves with v_W. The relative velocity along the ray needs no frame.
double rangeRate(const RadarState& radar, const Eigen::Vector3d& p_W, const Eigen::Vector3d& v_W) {
  return (p_W - radar.p_W).normalized().dot(v_W - radar.v_W);
}

struct Person {
  double from = 0.0, until = 0.0;                 // [s]
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();  // at `from`
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
};

Person makePerson(const RadarState& radar, double from, double until, Random& random) {
  Person person;
  person.from = from;
  person.until = until;
  const double elevation = random.uniform(-10.0, 10.0) * kDegree;
  const double azimuth = random.uniform(-40.0, 40.0) * kDegree;
  person.p_W = radar.p_W + radar.q_WR * (random.uniform(2.5, 6.0) * directionOf(azimuth, elevation));
  const double heading = random.uniform(-M_PI, M_PI);
  person.v_W = random.uniform(0.7, 1.6) * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
  return person;
}

// Visits of `crowd` persons each, who come and go together.
std::vector<Person> makePersons(const Motion& motion, const RadarModelOptions& o, const Extrinsics& T_IR,
                                std::uint64_t seed) {
  std::vector<Person> persons;
  if (o.moving_share <= 0.0) return persons;
  Random random(seed, kPersonStream);
  constexpr double kMeanVisit = 3.0;  // [s]
  const double mean_absence = kMeanVisit * (1.0 - o.moving_share) / o.moving_share;
  double t = mean_absence * random.uniform(0.0, 1.0);
  for (std::uint64_t visit = 0; t < motion.duration(); ++visit) {
    const double until = std::min(t + kMeanVisit * random.uniform(0.5, 1.5), motion.duration());
    const RadarState radar = radarState(motion.at(t), T_IR);
    persons.push_back(makePerson(radar, t, until, random));
    // The others have a sequence of their own, so that visits and first persons do not depend on the crowd.
    Random crowd_random(seed, kCrowdStream, visit);
    for (int i = 1; i < o.crowd; ++i) persons.push_back(makePerson(radar, t, until, crowd_random));
    t = until + mean_absence * random.uniform(0.5, 1.5);
  }
  return persons;
}

// Takes scans at any moment of the motion.
class Sensor {
 public:
  Sensor(const Motion& motion, const RadarSetup& setup, std::uint64_t seed)
      : motion_(motion),
        options_(setup.radar),
        T_IR_(setup.T_IR),
        scene_(makeScene(motion, seed, options_.points_mean)),
        persons_(makePersons(motion, options_, T_IR_, seed)) {}

  // Each point is a ghost with probability `ghost_share`.
  std::vector<SimulatedPoint> measure(double t, double ghost_share, Random& random) const {
    const Frame frame = frameAt(t);
    const int wanted = std::clamp(
        static_cast<int>(std::lround(options_.points_mean + options_.points_sigma * random.gaussian())),
        options_.points_min, options_.points_max);

    std::vector<Echo> echoes = personEchoes(t, frame, random);
    const std::vector<Echo> room = sceneEchoes(frame, wanted - static_cast<int>(echoes.size()), random);
    echoes.insert(echoes.end(), room.begin(), room.end());

    std::vector<SimulatedPoint> points;
    points.reserve(echoes.size());
    for (const Echo& echo : echoes) {
      points.push_back(random.chance(ghost_share) ? ghost(random) : detect(frame, echo, random));
    }
    return points;
  }

 private:
  // The radar at the measurement time and, for a Doppler averaged over the frame, around it.
  struct Frame {
    RadarState middle;
    std::array<RadarState, 3> nodes;  // three-point Gauss over the frame
  };
  struct Echo {
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d v_W = Eigen::Vector3d::Zero();
    double snr_db = 0.0;
  };

  Frame frameAt(double t) const {
    const auto at = [&](double time) {
      return radarState(motion_.at(std::clamp(time, 0.0, motion_.duration())), T_IR_);
    };
    const double reach = 0.5 * std::sqrt(0.6) * options_.frame_length;
    Frame frame;
    frame.middle = at(t);
    frame.nodes = {at(t - reach), frame.middle, at(t + reach)};
    return frame;
  }

  double trueDoppler(const Frame& frame, const Echo& echo) const {
    if (options_.frame_length <= 0.0) return rangeRate(frame.middle, echo.p_W, echo.v_W);
    return (5.0 * rangeRate(frame.nodes[0], echo.p_W, echo.v_W) +
            8.0 * rangeRate(frame.nodes[1], echo.p_W, echo.v_W) +
            5.0 * rangeRate(frame.nodes[2], echo.p_W, echo.v_W)) /
           18.0;
  }

  std::vector<Echo> personEchoes(double t, const Frame& frame, Random& random) const {
    std::vector<Echo> echoes;
    for (const Person& person : persons_) {
      if (t < person.from || t > person.until) continue;
      const Eigen::Vector3d middle_W = person.p_W + person.v_W * (t - person.from);
      const int count = 6 + static_cast<int>(random.uniform(0.0, 8.0));
      for (int i = 0; i < count; ++i) {
        const Eigen::Vector3d p_W =
            middle_W + random.gaussianVector().cwiseProduct(Eigen::Vector3d(0.15, 0.15, 0.4));
        const double snr_db = 18.0 + 3.0 * random.gaussian();
        if (visible(frame.middle.q_WR.conjugate() * (p_W - frame.middle.p_W), options_)) {
          echoes.push_back({p_W, person.v_W, snr_db});
        }
      }
    }
    // A single person may exceed the limit by a few points, so that bags of old seeds stay as they are.
    if (options_.crowd > 1 && echoes.size() > static_cast<std::size_t>(options_.points_max)) {
      keepStrongest(echoes, options_.points_max);
    }
    return echoes;
  }

  // The `wanted` strongest visible reflectors; strength falls with range and fluctuates from scan to scan.
  std::vector<Echo> sceneEchoes(const Frame& frame, int wanted, Random& random) const {
    std::vector<Echo> echoes;
    if (wanted <= 0) return echoes;
    const Eigen::Quaterniond q_RW = frame.middle.q_WR.conjugate();
    const double reach2 = options_.max_range * options_.max_range;
    constexpr double kRounding = 1e-3;  // [m] far more than the rounding errors
    const double station_reach = options_.max_range + kSceneRadius + kRounding;
    for (const Station& station : scene_) {
      // The radar sees no reflector of a station so far away.
      if ((station.p_W - frame.middle.p_W).head<2>().norm() > station_reach) continue;
      for (const Eigen::Vector3d& p_W : station.reflectors_W) {
        const Eigen::Vector3d d_W = p_W - frame.middle.p_W;
        if (d_W.squaredNorm() > reach2 || !visible(q_RW * d_W, options_)) continue;
        // Flatter than the radar equation: far things are larger (walls), and drivers compress.
        echoes.push_back(
            {p_W, Eigen::Vector3d::Zero(), 22.0 - 10.0 * std::log10(d_W.norm()) + 6.0 * random.gaussian()});
      }
    }
    keepStrongest(echoes, wanted);
    return echoes;
  }

  // Strongest first.
  static void keepStrongest(std::vector<Echo>& echoes, int wanted) {
    const auto kept = std::min(echoes.size(), static_cast<std::size_t>(wanted));
    std::partial_sort(echoes.begin(), echoes.begin() + static_cast<std::ptrdiff_t>(kept), echoes.end(),
                      [](const Echo& a, const Echo& b) { return a.snr_db > b.snr_db; });
    echoes.resize(kept);
  }

  // Returns the Doppler that the sensor reports for a range rate [m/s].
  double reported(double doppler) const {
    const double step = options_.doppler_step;
    const double span = options_.doppler_span;
    if (step <= 0.0) return span > 0.0 ? wrapped(doppler, span) : doppler;
    const double bin = std::round(doppler / step);
    // Wraps whole bins, so that rounding does not move a value out of the span.
    return step * (span > 0.0 ? wrapped(bin, std::round(span / step)) : bin);
  }

  // Into [-span / 2, span / 2).
  static double wrapped(double value, double span) { return value - span * std::floor(value / span + 0.5); }

  // The point as a flat radar reports it. A row of antennas measures range and the angle between the row and
  // the point. It does not see the elevation and takes the point to be in its plane.
  static Eigen::Vector3d flattened(const Eigen::Vector3d& p_R) {
    return {p_R.x(), std::hypot(p_R.y(), p_R.z()), 0.0};
  }

  SimulatedPoint detect(const Frame& frame, const Echo& echo, Random& random) const {
    const Eigen::Vector3d p_R = frame.middle.q_WR.conjugate() * (echo.p_W - frame.middle.p_W);
    const Eigen::Vector3d seen_R = options_.measures_elevation ? p_R : flattened(p_R);
    SimulatedPoint point;
    const double range = std::max(options_.min_range, p_R.norm() + options_.range_noise * random.gaussian());
    const double az = azimuthOf(seen_R) + options_.azimuth_noise * kDegree * random.gaussian();
    const double el = elevation(seen_R) + options_.elevation_noise * kDegree * random.gaussian();
    point.position_R = range * directionOf(az, options_.measures_elevation ? el : 0.0);
    point.doppler = reported(trueDoppler(frame, echo) + options_.doppler_noise * random.gaussian());
    point.snr_db = std::max(6.0, echo.snr_db);
    point.noise_db = 40.0 + 2.0 * random.gaussian();
    return point;
  }

  // Multipath and interference: position and Doppler are random.
  SimulatedPoint ghost(Random& random) const {
    SimulatedPoint point;
    point.position_R = anywhere(random.uniform(options_.min_range, options_.max_range), options_, random);
    point.doppler = reported(random.uniform(-2.5, 2.5));
    point.snr_db = random.uniform(6.0, 16.0);
    point.noise_db = 40.0 + 2.0 * random.gaussian();
    return point;
  }

  // All read-only after construction.
  const Motion& motion_;
  const RadarModelOptions& options_;
  const Extrinsics& T_IR_;
  std::vector<Station> scene_;
  std::vector<Person> persons_;
};

/// The spectrum of an echo's angles may have a second peak: the radar then reports two points.
void addSecondDirections(std::vector<SimulatedPoint>& points, const RadarModelOptions& o, Random& random) {
  const std::size_t echoes = points.size();
  for (std::size_t i = 0; i < echoes && points.size() < static_cast<std::size_t>(o.points_max); ++i) {
    if (!random.chance(o.ambiguous_share)) continue;
    SimulatedPoint second = points[i];
    second.position_R = anywhere(second.position_R.norm(), o, random);
    points.push_back(second);
  }
}

bool inAnyOf(const std::vector<RadarModelOptions::Interval>& intervals, double stamp) {
  return std::any_of(intervals.begin(), intervals.end(), [&](const RadarModelOptions::Interval& i) {
    return stamp >= i.start && stamp < i.start + i.duration;
  });
}

}  // namespace

void RadarModelOptions::removeErrors() {
  range_noise = azimuth_noise = elevation_noise = doppler_noise = doppler_step = 0.0;
  ghost_share = ambiguous_share = moving_share = dropout_share = latency_sigma = 0.0;
}

std::vector<Station> makeScene(const Motion& motion, std::uint64_t seed, double points_mean) {
  constexpr double kStationDistance = 4.0;  // [m]
  // About a quarter of them is in view.
  const int per_station = std::max(400, static_cast<int>(std::ceil(8.0 * points_mean)));
  Random random(seed, kSceneStream);
  std::vector<Station> scene;
  for (double t = 0.0; t < motion.duration(); t += 0.1) {
    const Eigen::Vector3d p_W = motion.at(t).p_W;
    const bool covered = std::any_of(scene.begin(), scene.end(), [&](const Station& s) {
      return (s.p_W - p_W).head<2>().norm() < kStationDistance;
    });
    if (covered) continue;
    scene.push_back({p_W, {}});
    for (int i = 0; i < per_station; ++i) {
      const double radius = kSceneRadius * std::sqrt(random.uniform());  // even over the disc
      const double direction = random.uniform(-M_PI, M_PI);
      const double height = random.uniform(-2.0, 3.5);
      scene.back().reflectors_W.emplace_back(
          p_W + Eigen::Vector3d(radius * std::cos(direction), radius * std::sin(direction), height));
    }
  }
  return scene;
}

std::vector<SimulatedScan> simulateRadar(const Motion& motion, const RadarSetup& setup, std::uint64_t seed,
                                         Time start) {
  const RadarModelOptions& options = setup.radar;
  check(options);
  checkSampleCount("radar-rate", options.rate, motion.duration());
  const Sensor sensor(motion, setup, seed);
  std::vector<SimulatedScan> scans;
  std::uint32_t seq = 0;
  for (std::uint32_t k = 0;; ++k) {
    const double stamp = options.first_trigger + k / options.rate;
    if (stamp > motion.duration()) break;
    SimulatedScan scan;
    scan.stamp = start + stamp;
    scan.time_offset = setup.time_offset.at(stamp);
    if (!(std::abs(scan.time_offset) <= motion.duration()))
      throw std::invalid_argument(
          formatted("--time-offset, --time-offset-drift, --time-offset-step: together %g s at %g s after the "
                    "start; expected at most the duration in size, %g s",
                    scan.time_offset, stamp, motion.duration()));
    scan.measured = scan.stamp - scan.time_offset;
    const double measured = scan.measured - start;
    if (measured < 0.0 || measured > motion.duration()) continue;
    scan.seq = seq++;
    Random latency_random(seed, kLatencyStream, k);
    scan.arrival =
        scan.stamp + std::max(0.0, options.latency + options.latency_sigma * latency_random.gaussian());
    const RadarState radar = radarState(motion.at(measured), setup.T_IR);
    scan.v_R = radar.q_WR.conjugate() * radar.v_W;
    Random dropout_random(seed, kDropoutStream, k);
    scan.delivered = !inAnyOf(options.blackouts, stamp) && !dropout_random.chance(options.dropout_share);
    if (scan.delivered) {
      Random random(seed, kScanStream, k);
      const double ghost_share = inAnyOf(options.ghost_bursts, stamp) ? 1.0 : options.ghost_share;
      scan.points = sensor.measure(measured, ghost_share, random);
      Random ambiguous_random(seed, kAmbiguousStream, k);
      addSecondDirections(scan.points, options, ambiguous_random);
      scan.delivered = options.publish_empty || !scan.points.empty();
    }
    scans.push_back(std::move(scan));
  }
  if (scans.empty())
    throw std::invalid_argument(
        formatted("--first-trigger: %g s; expected a scan that is measured within the duration, %g s, after "
                  "its --time-offset",
                  options.first_trigger, motion.duration()));
  return scans;
}

}  // namespace rio_t::simulation
