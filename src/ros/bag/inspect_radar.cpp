#include "inspect_radar.h"

#include <algorithm>
#include <array>
#include <boost/algorithm/string/join.hpp>
#include <cmath>

#include "../parameters/mounting_parameters.h"
#include "../text.h"
#include "rio_t/core/angle.h"
#include "rio_t/radar/mounting.h"

namespace rio_t {
namespace {

constexpr double kStraight = M_PI;     // [rad]
constexpr double kOnePercent = 0.005;  // smallest share that is shown as 1 %

std::string degrees(double radians) { return fixedText(radians / kDegree, 0); }

/// "x 1.2, y 0.9 deg; not observed about z"
std::string sureness(const Eigen::Vector3d& sigma) {
  std::string known, unknown;
  for (int k = 0; k < 3; ++k) {
    const std::string axis(1, "xyz"[k]);
    if (sigma[k] < kObservedTurn) {
      appendItem(&known, axis + " " + fixedText(sigma[k] / kDegree, 1));
    } else {
      appendItem(&unknown, axis, " and ");
    }
  }
  std::string text = known.empty() ? "" : "sigma " + known + " deg about the axes of the IMU";
  if (!unknown.empty())
    appendItem(&text, "not observed about " + unknown + ": the motion does not show it", "; ");
  return text;
}

MountingSearchOptions searchOptions(const ImuInspection& imu, const InertialTrack& track,
                                    int sign_from_ranges) {
  MountingSearchOptions options;
  options.sign_from_ranges = sign_from_ranges;
  options.accel_density = std::max(options.accel_density, imu.report.accel_density_median);
  if (imu.report.rests_at_start) {
    options.rest_end = track.begin() + (imu.report.rest_begin + imu.report.rest);
    options.gravity_G = -(track.rotation(options.rest_end) * imu.report.rest_acceleration);
  }
  options.up_I = upOf(imu.report);
  return options;
}

/// What the clouds of a radar show with one format.
struct RadarAnalysis {
  DecodedClouds clouds;
  std::vector<RadarScan> scans;  // those that get a stamp
  CloudReport cloud;
  RadarVelocities velocities;
  DopplerSign sign;
  RangeRatio ratio;
  MountingSearch search;
};

RadarAnalysis analyse(const Recording& recording, const ImuInspection& imu, const CloudTopic& cloud,
                      const StampProposal& stamps, const PointCloudFormat& format,
                      const InertialTrack& track) {
  RadarAnalysis analysis;
  analysis.clouds = decodeAll(cloud, format);
  analysis.scans = stampScans(recording, imu.times, cloud, stamps.options, analysis.clouds.scans);
  analysis.cloud = inspectCloud(analysis.scans);
  analysis.velocities = radarVelocities(analysis.scans);
  analysis.sign = dopplerSignFromRanges(analysis.scans, track);
  analysis.ratio = rangeRatio(analysis.scans, track);
  analysis.search =
      searchMounting(analysis.velocities.velocities, track, searchOptions(imu, track, analysis.sign.sign));
  return analysis;
}

/// Says why the radar cannot be used; empty: it can.
std::string faultOf(const RadarAnalysis& analysis, const PointCloudFormat& format,
                    const StampProposal& stamps) {
  if (analysis.clouds.points == 0 && analysis.clouds.points_not_finite > 0)
    return "the position, the power or the field " + format.doppler + " is not finite in every point";
  if (analysis.clouds.points == 0)
    return analysis.clouds.padding > 0 ? "every point is at range zero, or NaN" : "no cloud has a point";
  if (analysis.scans.empty()) return "no scan gets a stamp: " + stamps.text;
  if (!analysis.cloud.has_doppler) return "the field " + format.doppler + " is zero in every point";
  return "";
}

void describeCloud(const RadarAnalysis& analysis, const FormatProposal& format, const StreamTiming& timing,
                   RadarInspection* radar) {
  const CloudReport& c = analysis.cloud;
  radar->tell(
      timing.gaps > timing.messages / 50 ? FindingLevel::kOdd : FindingLevel::kOk, "radar",
      radar->topic + ": " + rateText(timing, 1, timing.zero == 0 && !timing.constant) + "; format " +
          format.format.name +
          (format.fitting.size() > 1 ? " (fitting: " + boost::algorithm::join(format.fitting, ", ") + ")"
                                     : "") +
          ", " + format.power);
  for (const std::string& odd : format.odd) radar->odd("format", odd);
  const KnownDoppler& step = analysis.velocities.doppler_step;
  const bool sparse = radar->isSparse();
  constexpr double kManyEmpty = 0.2;  // some are usual: a radar that drops static points sees none at rest
  const bool often_empty = c.empty > kManyEmpty;
  radar->tell(sparse || often_empty ? FindingLevel::kOdd : FindingLevel::kOk, "points",
              fixedText(c.points_10, 0) + " / " + fixedText(c.points_50, 0) + " / " +
                  fixedText(c.points_90, 0) + " a scan (10, 50, 90 %), to " + fixedText(c.range_99, 1) +
                  " m, field of view +-" + degrees(c.azimuth_95) + " by +-" + degrees(c.elevation_95) +
                  " deg, Doppler step " +
                  (step.value > 0.0 ? fixedText(step.value, 3) + " m/s" : std::string("none")) +
                  (sparse ? ": few points, so start at rest" : "") +
                  (often_empty ? "; " + fixedText(100.0 * c.empty, 0) +
                                     " % of the clouds are empty: look for what empties them in the driver"
                               : ""));
  constexpr double kIncredible = 500.0;  // [m] farther than radars see
  if (c.range_99 > kIncredible)
    radar->odd("points", "the ranges reach " + fixedText(c.range_99, 0) + " m: are the positions in m?");
  const double not_finite = static_cast<double>(analysis.clouds.points_not_finite);
  const double share_not_finite = not_finite / (not_finite + static_cast<double>(c.points));
  if (share_not_finite > kOnePercent)
    radar->odd("points",
               fixedText(100.0 * share_not_finite, 0) +
                   " % have a position, a Doppler or a power that is not finite: look for what the driver "
                   "writes there");
  if (c.ambiguous > kOnePercent)
    radar->ok(
        "points",
        fixedText(100.0 * c.ambiguous, 0) +
            " % have the range, Doppler and SNR of another point: one echo at several directions, left out");
  if (!analysis.velocities.has_elevation)
    radar->odd("points",
               "the radar measures no elevation: z will drift, and a mounting without tilt is assumed");
}

void limitsOfCloud(const CloudReport& cloud, ProposedKeys* keys) {
  if (cloud.behind > 0.02)
    keys->set(
        "radar_max_azimuth", ParameterValue{3.141592},
        "So many points lie behind the radar's forward axis: " + fixedText(100.0 * cloud.behind, 0) + " %.");
  const double max_range = EgoVelocityOptions().max_range;
  if (cloud.range_99 > 0.95 * max_range)
    keys->set("radar_max_range", ParameterValue{std::ceil(1.2 * cloud.range_99)},
              "The radar sees farther than " + fixedText(max_range, 0) + " m.");
}

void describeSign(const RadarAnalysis& analysis, const FormatProposal& format, const ImuReport& imu,
                  RadarInspection* radar) {
  const MountingSearch& search = analysis.search;
  const std::string field = format.format.doppler;
  std::string evidence;
  if (analysis.sign.sign != 0)
    appendItem(&evidence, "ranges (" + fixedText(std::abs(analysis.sign.significance), 0) + " sigma)");
  if (search.enough && search.sign_significance > 25.0)
    appendItem(&evidence, "the IMU (" + fixedText(std::sqrt(search.sign_significance), 0) + " sigma)",
               " and ");
  if (search.mirrored) {
    radar->odd("axes",
               "the ranges say that " + field + " is " +
                   (analysis.sign.sign > 0 ? "positive for receding" : "negative for receding") +
                   " targets, and the IMU says the contrary. Either the axes of the cloud are left-handed "
                   "(one axis is "
                   "inverted): radar_doppler_sign and the mounting make up for it. Or the accelerometer is "
                   "negated (it measures gravity, not the specific force): then the track is a mirror image, "
                   "so correct the driver of the IMU. " +
                   howToTellNegated(imu));
    radar->keys.set(
        "radar_doppler_sign", ParameterValue{std::int64_t{search.sign}},
        "One axis of the cloud is inverted: this sign and the mounting below make up for it. Or the "
        "accelerometer is negated: then correct the driver of the IMU.");
  } else if (search.sign == -1) {
    radar->odd("Doppler", field + " is positive for approaching targets, shown by " + evidence);
    radar->keys.set("radar_doppler_sign", ParameterValue{std::int64_t{-1}},
                    field + " is positive for approaching targets.");
  } else {
    radar->ok("Doppler",
              field + " is positive for receding targets" +
                  (evidence.empty() ? " (assumed: the motion does not show it)" : ", shown by " + evidence));
  }
}

/// Reports if the ranges do not change at the rate that the Doppler says, whatever its sign.
void describeUnit(const RangeRatio& ranges, const std::string& field, RadarInspection* radar) {
  // On gentle motions a correct Doppler gives ratios up to 1.3. Wrong units are farther off: the nearest are
  // knots, with 1.94.
  constexpr double kFactor = 1.5, kSigmas = 3.0;
  if (ranges.ratio == 0.0) return;
  if (std::abs(std::log(ranges.ratio)) <= std::max(std::log(kFactor), kSigmas * ranges.log_sigma)) return;
  radar->odd("Doppler", "ranges change at " + shortText(ranges.ratio, 2) + " +- " +
                            shortText(ranges.ratio * ranges.log_sigma, 1) + " times the Doppler: is " +
                            field + " in m/s? The odometry takes it as m/s, and no parameter scales it");
}

/// Returns the mounting without tilt. A radar without elevation hardly shows its tilt, and most are mounted
/// level.
Eigen::Quaterniond levelled(const Eigen::Quaterniond& q_IR) {
  const double roll = std::abs(mountingOf(q_IR).roll) > 0.5 * kStraight ? kStraight : 0.0;
  return rotationOf({mountingOf(q_IR).yaw, 0.0, roll});
}

/// Says along which axes of the IMU the axes of the radar point. `turn`: one of axisTurns().
std::string turnText(const Eigen::Matrix3d& turn) {
  std::string text;
  const std::array<const char*, 3> names = {"right", "forward", "up"};
  for (int k = 0; k < 3; ++k) {
    int axis = 0;
    turn.col(k).cwiseAbs().maxCoeff(&axis);
    appendItem(&text, std::string(names[static_cast<std::size_t>(k)]) + " = " +
                          (turn(axis, k) < 0.0 ? "-" : "+") + "xyz"[axis]);
  }
  return text;
}

Eigen::Matrix3d nearestTurn(const Eigen::Matrix3d& R) {
  const auto& turns = axisTurns();
  return *std::max_element(turns.begin(), turns.end(),
                           [&](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
                             return (a.transpose() * R).trace() < (b.transpose() * R).trace();
                           });
}

/// `largest` [s]: max_time_offset.
void describeOffset(const MountingSearch& search, double largest, RadarInspection* radar) {
  const double size = std::abs(search.offset);
  constexpr double kNearEnd = 0.02;  // [s]
  const std::string found =
      fixedText(1e3 * search.offset, 0) + " +- " + fixedText(1e3 * search.offset_sigma, 0) + " ms";
  const std::string advice = " The odometry estimates offsets up to max_time_offset " +
                             fixedText(largest, 2) +
                             " s: if the offset is larger, --set max_time_offset=S (up to 1 s), or take a "
                             "known delay off the stamps "
                             "(radar_stamp_shift)";
  if (size > kMaxSearchedOffset - kNearEnd) {
    radar->odd("offset",
               fixedText(1e3 * search.offset, 0) + " ms or beyond: check_bag searches no farther." + advice);
  } else if (size > 0.8 * largest) {
    radar->odd("offset", found + ", roughly, near or beyond max_time_offset." + advice);
  } else {
    radar->ok("offset", found + ", roughly; the odometry estimates it");
  }
}

void describeMounting(const MountingSearch& search, double largest_offset, RadarInspection* radar) {
  if (!search.enough) {
    radar->odd("mounting",
               "not found: less than 3 s with motion and two velocities a second; the radar is taken to look "
               "forward. Record with motion, or set mounting_yaw_pitch_roll_deg by hand");
    radar->keys.set("mounting_yaw_pitch_roll_deg", listOf(Eigen::Vector3d::Zero()),
                    "Assumed: the bag does not show it. Yaw left, pitch up, roll right side down.");
    return;
  }
  const MountingAngles angles = mountingOf(search.q_IR);
  const double yaw = rounded(angles.yaw / kDegree, 10.0), pitch = rounded(angles.pitch / kDegree, 10.0),
               roll = rounded(angles.roll / kDegree, 10.0);
  Eigen::Vector3d sigma = search.rotation_sigma;
  constexpr double kSparseSigma = 0.2;  // [rad]
  if (radar->isSparse()) sigma = (sigma.array().square() + kSparseSigma * kSparseSigma).sqrt().min(kStraight);
  std::string sure = sureness(sigma);
  // If the scans have few points, another mounting may fit as well: upside down, or beside the motion.
  const bool observed = search.rotation_sigma.maxCoeff() < kObservedTurn && !radar->isSparse();
  if (radar->isSparse()) appendItem(&sure, "so few points may show a wrong one", "; ");
  if (!observed) appendItem(&sure, "compare it with the robot", "; ");
  radar->tell(observed ? FindingLevel::kOk : FindingLevel::kOdd, "mounting",
              "yaw " + fixedText(yaw, 1) + ", pitch " + fixedText(pitch, 1) + ", roll " + fixedText(roll, 1) +
                  " deg (radar's " + turnText(nearestTurn(search.q_IR.toRotationMatrix())) +
                  " of the IMU); " + sure);
  radar->keys.set("mounting_yaw_pitch_roll_deg", listOf(Eigen::Vector3d(yaw, pitch, roll)),
                  "Yaw left, pitch up, roll right side down, seen from x forward, y left, z up of the IMU. " +
                      sure + ".");
  const Eigen::Vector3d& l = search.lever_arm_I;
  const Eigen::Vector3d& l_sigma = search.lever_arm_sigma;
  std::string text;
  for (int k = 0; k < 3; ++k) appendItem(&text, fixedText(l[k], 2) + " +- " + fixedText(l_sigma[k], 2));
  // If the scans have few points, the lever arm may be as wrong as the mounting.
  const bool is_known = l_sigma.maxCoeff() < kUnmeasuredLeverArm && !radar->isSparse();
  radar->ok("lever arm",
            "about [" + text + "] m: " +
                (is_known ? "the estimate starts there" : "too vague, the estimate starts at zero") +
                ", unless you give it; measure it with a tape");
  if (is_known) {
    radar->keys.set("extrinsics_translation", listOf(l.unaryExpr([](double x) { return rounded(x, 100.0); })),
                    "Origin of the radar in the IMU frame, roughly [m]. Measure it with a tape.");
    const double least = CalibrationPrior().extrinsics_translation_sigma;
    radar->keys.set("extrinsics_translation_sigma",
                    ParameterValue{rounded(std::max(least, l_sigma.maxCoeff()), 100.0)},
                    "Standard deviation of extrinsics_translation [m].");
  }
  describeOffset(search, largest_offset, radar);
  constexpr double kKnown = 0.03;  // [s]
  const double bound = 0.8 * largest_offset;
  if (std::abs(search.offset) > 0.8 * CalibrationPrior().time_offset_sigma && search.offset_sigma < kKnown &&
      !radar->isSparse())
    radar->keys.set("time_offset_initial",
                    ParameterValue{rounded(std::clamp(search.offset, -bound, bound), 1e3)},
                    "Found roughly, in seconds.");
}

/// The configuration keeps what the user has configured. The report says so if the bag clearly shows
/// something else.
void compareWithConfigured(const MountingSearch& search, const ParameterEntries& configured,
                           RadarInspection* radar) {
  if (!search.enough || search.rotation_sigma.maxCoeff() > kObservedTurn || radar->isSparse()) return;
  const Config known = makeConfig(configured);
  const double turn = known.odometry.radar.T_IR.q_IR.angularDistance(search.q_IR);
  if (isMountingConfigured(configured) && turn > kFarApart)
    radar->odd("mounting", "the configured mounting and the one that the bag shows are " + degrees(turn) +
                               " degrees apart");
  const int sign = known.radar_overrides.doppler_sign;
  if (sign != 0 && sign != search.sign)
    radar->odd("Doppler", "the configured radar_doppler_sign is " + std::to_string(sign) +
                              ", and the bag shows " + std::to_string(search.sign));
}

}  // namespace

bool isMountingConfigured(const ParameterEntries& configured) {
  return isConfigured("mounting_yaw_pitch_roll_deg", configured) ||
         isConfigured("extrinsics_rotation_xyzw", configured);
}

RadarInspection inspectRadar(const Recording& recording, const ImuInspection& imu, const CloudTopic& cloud,
                             const ParameterEntries& configured) {
  RadarInspection radar;
  radar.topic = cloud.topic;
  const StreamTiming timing = inspectTiming(cloud.times);
  FormatProposal format = proposeFormat(cloud, configured);
  if (!format.fault.empty()) {
    radar.missing("radar", cloud.topic + ": " + format.fault, format.to_do);
    return radar;
  }
  const StampProposal stamps = proposeStamps(recording, imu.times, cloud, configured);
  const InertialTrack track(imu.report.samples, imu.report.rest_rate);
  RadarAnalysis analysis = analyse(recording, imu, cloud, stamps, format.format, track);
  if (const std::string fault = faultOf(analysis, format.format, stamps); !fault.empty()) {
    const char* const to_do =
        "Set stamp_source to header or to arrival, or leave it out: check_bag then chooses.";
    radar.missing("radar", cloud.topic + ": " + fault, analysis.scans.empty() ? to_do : "");
    return radar;
  }
  // If the ranges do not show the sign, a contrary sign and a radar that looks along another axis are one
  // fault: two fields are swapped.
  const bool mirrored = analysis.search.mirrored || (analysis.sign.sign == 0 && analysis.search.sign == -1);
  if (correctAxes(analysis.cloud, mirrored, configured, &format))
    analysis = analyse(recording, imu, cloud, stamps, format.format, track);
  const std::optional<Eigen::Vector3d> up = upOf(imu.report);
  constexpr double kUpright = 0.9;  // cosine of the largest tilt: mounting angles assume that z is up
  if (!analysis.velocities.has_elevation && analysis.search.enough && up && up->z() > kUpright)
    analysis.search.q_IR = levelled(analysis.search.q_IR);
  radar.usable = true;
  radar.search = analysis.search;
  radar.points = analysis.cloud.points_50;
  radar.keys.set("radar_topic", cloud.topic);
  radar.keys.add(format.keys);
  radar.keys.add(stamps.keys);
  limitsOfCloud(analysis.cloud, &radar.keys);
  describeCloud(analysis, format, timing, &radar);
  for (const std::string& odd : stamps.odd) radar.odd("stamps", odd);
  if (stamps.odd.empty()) radar.ok("stamps", stamps.text);
  describeSign(analysis, format, imu.report, &radar);
  describeUnit(analysis.ratio, format.format.doppler, &radar);
  describeMounting(analysis.search, makeConfig(configured).odometry.smoother.max_time_offset, &radar);
  compareWithConfigured(analysis.search, configured, &radar);
  return radar;
}

}  // namespace rio_t
