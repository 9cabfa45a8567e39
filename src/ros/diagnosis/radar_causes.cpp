#include <algorithm>

#include "causes.h"
#include "rio_t/core/angle.h"
#include "rio_t/radar/doppler_grid.h"

namespace rio_t {
namespace {

class RadarCauses {
 public:
  RadarCauses(const RadarSummary& radar, const Config& config, std::vector<Cause>* causes)
      : radar_(radar),
        config_(config),
        key_(prefixOf(radar.name)),
        of_(radar.name.empty() ? "" : " of radar " + radar.name),
        causes_(causes) {}

  void add() {
    if (radar_.scans_total < kEnoughScans) return;
    addNotFinite();
    addZeroDoppler();
    addStep();
    addPointFilter();
    addStamps();
    addVelocities();
    addContradictions();
    addScale();
    addOffset();
    addLeverArm();
    addMounting();
  }

 private:
  void cause(const std::string& name, double share, const std::string& text, const std::string& remedy,
             bool remedy_is_check_bag = false) {
    causes_->push_back({name, text, remedy, share, remedy_is_check_bag});
  }

  void addNotFinite() {
    const double share = shareOf(radar_.points_not_finite, pointsReceived(radar_));
    if (share < kManyPoints) return;
    cause("points_not_finite", share,
          outOf(radar_.points_not_finite, pointsReceived(radar_), "points") + of_ +
              " have a position, a Doppler or a power that is not finite.",
          "Look for what the driver of the radar writes there, and check the " + key_ + "radar_field_ keys.");
  }

  /// Scans with Dopplers of zero show a platform at rest. They do not show the step of the Doppler, which may
  /// hide slow motion. So the IMU contradicts them only a little.
  void addZeroDoppler() {
    if (radar_.points_with_doppler > 0 || radar_.scans_fast < kEnoughScans) return;
    cause("doppler_zero", 1.0,
          "All " + std::to_string(radar_.points) + " points" + of_ +
              " have a Doppler of zero, and the platform moved at more than " +
              number(DopplerGrid::kLargestUsualStep) + " m/s for " + std::to_string(radar_.scans_fast) +
              " scans.",
          "Check " + key_ + "radar_field_doppler, and whether the driver of the radar fills this field.");
  }

  /// With too large a step, slow motion counts as rest, and moving objects count as static.
  void addStep() {
    const KnownDoppler& used = radar_.knowledge.doppler_step;
    const KnownDoppler& read = radar_.knowledge.read_doppler_step;
    if (used.source != DopplerSource::kGiven || read.source != DopplerSource::kData) return;
    constexpr double kOther = 1.5;  // a wrong step is at least twice the true one; less is rounding
    if (read.value == 0.0 || used.value < kOther * read.value) return;
    cause("doppler_step_far", 1.0 - read.value / used.value,
          "The Dopplers" + of_ + " are multiples of " + shortText(read.value, 3) + " m/s, and " + key_ +
              "radar_doppler_step says " + number(used.value) + " m/s.",
          "Set " + key_ + "radar_doppler_step: 0, and the step is read off the data.");
  }

  /// Adds a reason why scans were rejected, or gave no velocity before the start.
  void scans(const std::string& reason, const std::string& text, const std::string& remedy) {
    const std::uint64_t count =
        countOf(radar_.scans_rejected, reason) + countOf(radar_.velocity_status, reason);
    const double share = shareOf(count, radar_.scans_total);
    if (share < kManyScans) return;
    cause(reason, share, outOf(count, radar_.scans_total, "scans") + of_ + " " + text, remedy);
  }

  void addPointFilter() {
    const std::string other_axes =
        "The axes of the cloud are probably others: set " + key_ + "radar_axes to rfu or flu.";
    const auto filter = [&](PointVerdict verdict, const std::string& name, const std::string& are,
                            const std::string& remedy) {
      const std::uint64_t taken = pointsOf(radar_, verdict);
      const double share = shareOf(taken, radar_.points);
      if (share < kManyPoints) return;
      cause(name, share, outOf(taken, radar_.points, "points") + of_ + " are " + are, remedy);
    };
    filter(PointVerdict::kTooWeak, "points_too_weak",
           "below " + keyOf(PointVerdict::kTooWeak) + ": their mean is " +
               number(radar_.snr_sum_db / static_cast<double>(std::max<std::uint64_t>(1, radar_.points))) +
               " dB, and " + powerReader() + " reads the power as " +
               toString(pointCloudFormat(config_).power_unit) + ".",
           "Set " + key_ +
               "radar_power_unit to the unit of your driver (not_snr if it is no SNR), or lower " + key_ +
               "radar_min_snr_db.");
    filter(PointVerdict::kTooNear, "points_too_near", "nearer than " + keyOf(PointVerdict::kTooNear) + ".",
           "Lower " + key_ + "radar_min_range, and check the unit of the positions.");
    filter(PointVerdict::kTooFar, "points_too_far", "farther than " + keyOf(PointVerdict::kTooFar) + ".",
           "Raise " + key_ + "radar_max_range, and check the unit of the positions.");
    filter(PointVerdict::kBesideView, "points_beside_view",
           "farther than " + keyOf(PointVerdict::kBesideView) + " to either side of forward.", other_axes);
    filter(PointVerdict::kAboveView, "points_above_view",
           "higher or lower than " + keyOf(PointVerdict::kAboveView) + ".", other_axes);
    filter(PointVerdict::kNoMeasurement, "points_without_measurement",
           "no measurement: their Doppler is " + number(kLargestDoppler) + " m/s or more.",
           "Check " + key_ + "radar_field_doppler: is it the Doppler, in m/s?");
    filter(
        PointVerdict::kAmbiguous, "points_ambiguous",
        "ambiguous: the radar reports one echo at several directions, with the same range, Doppler and SNR.",
        "Let the driver of the radar report one direction for each echo (multiObjBeamForming of TI radars).");
  }

  std::string powerReader() const {
    return config_.radar_overrides.power_unit ? key_ + "radar_power_unit"
                                              : "the preset " + config_.radar_format;
  }

  void addStamps() {
    const std::string other =
        "Set " + key_ + "stamp_source: arrival, or correct the clock with " + key_ + "radar_stamp_shift.";
    scans("stamp_zero", "have a stamp of zero.", "Set " + key_ + "stamp_source to trigger or arrival.");
    scans("stamp_out_of_range", "have a stamp below zero or later than ROS can hold.",
          "Correct " + key_ + "radar_stamp_shift or the stamps of the driver.");
    const double before_imu = shareOf(radar_.scans_before_imu, radar_.scans_total);
    if (before_imu >= kManyScans)
      cause("stamp_before_imu", before_imu,
            outOf(radar_.scans_before_imu, radar_.scans_total, "scans") + of_ +
                " are stamped before the first IMU sample, the first of them by " +
                fixedText(radar_.seconds_before_imu, 1) + " s.",
            other);
    const std::uint64_t ahead =
        countOf(radar_.scans_rejected, "stamp_ahead_of_imu") + radar_.scans_ahead_at_start;
    if (const double share = shareOf(ahead, radar_.scans_total); share >= kManyScans)
      cause("stamp_ahead_of_imu", share,
            outOf(ahead, radar_.scans_total, "scans") + of_ +
                " are stamped ahead of the newest IMU sample, by up to " +
                fixedText(radar_.seconds_ahead_of_imu, 1) + " s.",
            other);
    scans("older_than_window", "are stamped before the IMU samples that are kept.", other);
    scans("imu_not_covering", "are stamped at a time without IMU samples.", other);
    const double zero_triggers = shareOf(radar_.triggers_zero, radar_.scans_total);
    if (zero_triggers < kManyScans) {
      scans("trigger_missing", "have no trigger message.",
            "Check " + key_ + "trigger_topic, or set " + key_ + "stamp_source to header or arrival.");
    } else {
      cause("trigger_stamp_zero", std::min(1.0, zero_triggers),
            std::to_string(radar_.triggers_zero) + " messages on " + key_ + "trigger_topic " +
                config_.trigger_topic + " have a stamp of zero, for " + std::to_string(radar_.scans_total) +
                " scans.",
            "Correct the driver of the trigger, or set " + key_ + "stamp_source to header or arrival.");
    }
    scans("duplicate_stamp", "have the stamp of another scan.",
          "The driver repeats its stamps: set " + key_ + "stamp_source: arrival.");
    scans("scan_repeated", "have the points of the scan before, although the radar moves.",
          "Let the driver of the radar publish a scan only if it has measured a new one.");
    scans("queue_full", "waited too long for the IMU or the solver.",
          "Set " + key_ +
              "stamp_source: arrival if the stamps are ahead of the IMU; lower window if the computer "
              "is too slow.");
    scans("cloud_not_usable", "cannot be read.",
          "Set " + key_ + "radar_format and the radar_field_ keys to the fields of your cloud.");
  }

  /// Adds scans whose points give no velocity, before the start and after it.
  void addVelocities() {
    const std::uint64_t kept = pointsOf(radar_, PointVerdict::kKept);
    // If the filter removed most points, that is a cause of its own.
    if (shareOf(kept, radar_.points) > 1.0 - kManyPoints || radar_.points == 0) addTooFewPoints(kept);
    scans("too_few_inliers", "have no velocity that enough of their points agree on.",
          "Check " + key_ + "radar_field_doppler, " + key_ +
              "radar_axes and the positions. Moving things in view have the same effect.");
    scans("ill_conditioned", "have all their points in one direction.",
          "Widen the view of the radar: " + key_ + "radar_max_azimuth and " + key_ + "radar_max_elevation.");
    scans("sigma_too_large", "have a velocity that is too uncertain.",
          "Raise " + key_ +
              "ego_velocity_max_sigma, or let the radar report more points. Is the "
              "Doppler in m/s?");
  }

  /// Returns the key that sets a limit of the filter, with its value; empty if there is none.
  std::string keyOf(PointVerdict verdict) const {
    const EgoVelocityOptions& o = config_.odometry.radar.ego_velocity;
    switch (verdict) {
      case PointVerdict::kTooNear:
        return key_ + "radar_min_range " + number(o.min_range) + " m";
      case PointVerdict::kTooFar:
        return key_ + "radar_max_range " + number(o.max_range) + " m";
      case PointVerdict::kTooWeak:
        return key_ + "radar_min_snr_db " + number(o.min_snr_db) + " dB";
      case PointVerdict::kBesideView:
        return key_ + "radar_max_azimuth " + number(o.max_azimuth) + " rad";
      case PointVerdict::kAboveView:
        return key_ + "radar_max_elevation " + number(o.max_elevation) + " rad";
      default:
        return "";
    }
  }

  /// Says how many scans were empty, and which keys removed the points of the others. `kept`: number of
  /// points.
  void addTooFewPoints(std::uint64_t kept) {
    const auto& emptied = radar_.scans_emptied;
    const auto most =
        static_cast<std::size_t>(std::max_element(emptied.begin(), emptied.end()) - emptied.begin());
    std::uint64_t others = radar_.scans_total - std::min(radar_.scans_total, radar_.scans_empty);
    std::string why;
    if (radar_.scans_empty > 0) appendItem(&why, std::to_string(radar_.scans_empty) + " clouds are empty");
    for (std::size_t k = 0; k < kPointVerdicts; ++k) {
      if (emptied[k] == 0) continue;
      others -= std::min(others, emptied[k]);
      const std::string key = keyOf(static_cast<PointVerdict>(k));
      appendItem(
          &why,
          std::to_string(emptied[k]) + " lost their points to " +
              (key.empty() ? "Dopplers that are no measurement or to echoes at several directions" : key));
    }
    if (others > 0)
      appendItem(&why, (why.empty() ? "" : "the other " + std::to_string(others) + " have ") +
                           number(shareOf(kept, others)) + " on average after the filter");
    const std::uint64_t count =
        countOf(radar_.scans_rejected, "too_few_points") + countOf(radar_.velocity_status, "too_few_points");
    std::string remedy =
        "Set a lower detection threshold in the driver of the radar. If radar_factor is velocity, set "
        "doppler.";
    if (2 * radar_.scans_empty > count) {
      remedy =
          "Look for what empties the clouds in the driver of the radar: its detection threshold, a filter "
          "of what stands still, or a second publisher on " +
          key_ + "radar_topic.";
    } else if (2 * emptied[most] > count && !keyOf(static_cast<PointVerdict>(most)).empty()) {
      const std::string key = keyOf(static_cast<PointVerdict>(most));
      remedy = "Change " + key.substr(0, key.find(' ')) +
               " if the radar sees well there, or look for a second publisher on " + key_ + "radar_topic.";
    }
    if (radar_.points == 0 && radar_.padding > 0)
      remedy = "All " + std::to_string(radar_.padding) +
               " points are at range zero, or NaN. Check the names of the fields: " + key_ +
               "radar_field_x and the next ones.";
    if (radar_.points_not_finite > 0)
      remedy = "Look at the driver of the radar: " + std::to_string(radar_.points_not_finite) +
               " more points are not finite. " + remedy;
    scans("too_few_points", "have too few points for a velocity: " + why + ".", remedy);
  }

  /// Adds scans whose velocity contradicts the IMU.
  void addContradictions() {
    const std::uint64_t judged = radar_.scans_total - radar_.scans_before_start;
    const std::uint64_t contradicted = countOf(radar_.scans_rejected, "innovation");
    const double share = shareOf(contradicted, judged);
    if (share < kManyScans) return;
    cause("contradicts_imu", share,
          outOf(contradicted, judged, "scans") + of_ + " show a velocity that contradicts the IMU.",
          "Check the mounting (" + mountingKey() + "), " + key_ + "radar_doppler_sign and " + key_ +
              "radar_axes. Is the Doppler in m/s?" + mountingAdvice(radar_) +
              " estimate_extrinsics: pose corrects up to 10 degrees by itself.",
          true);
  }

  void addScale() {
    const double sigmas = scaleSigmas(radar_);
    if (sigmas <= kWrongScale) return;
    // A large error is vague, since tilt and biases follow it.
    const double left = 1.0 - radar_.errors.scale.error;
    constexpr double kLeast = 0.01;  // of zero, the factor would be infinite
    cause("doppler_scale", 1.0 - kWrongScale / sigmas,
          "The Doppler" + of_ + " seems to be about " + shortText(1.0 / std::max(left, kLeast), 2) +
              " times the velocity that the IMU feels.",
          "Check that " + key_ + "radar_format and " + key_ +
              "radar_field_doppler fit the driver, and that this field is in m/s: no parameter scales it. "
              "Check imu_acceleration_unit, too. `rosrun rio_t check_bag BAG` compares the Doppler with the "
              "ranges.",
          true);
  }

  void addOffset() {
    const double sigmas = offsetSigmas(radar_);
    if (sigmas <= kWrongOffset) return;
    const double held = config_.odometry.radar.time_offset_initial;
    cause("offset_far", 1.0 - kWrongOffset / sigmas,
          "The scans fit better with a time offset" + of_ + " of about " +
              fixedText(held + radar_.errors.offset->error, 3) +
              " s, and estimate_time_offset: false holds it at " + fixedText(held, 3) + " s.",
          "Set estimate_time_offset: true, or correct " + key_ + "time_offset_initial.");
  }

  void addLeverArm() {
    const double sigmas = leverArmSigmas(radar_);
    if (sigmas <= kWrongLeverArm) return;
    cause("lever_arm_far", 1.0 - kWrongLeverArm / sigmas,
          "The scans fit better if the lever arm" + of_ + " changes by " +
              fixedTexts(radar_.errors.lever_arm->error, 3) + " m along x, y, z of the IMU, with sigmas of " +
              fixedTexts(radar_.errors.lever_arm->sigma(), 3) + ".",
          "Set estimate_extrinsics: pose, or correct " + keyOrTf("extrinsics_translation") +
              ": `rosrun rio_t calibrate` finds it.");
  }

  void addMounting() {
    const double sigmas = turnSigmas(radar_, config_);
    if (sigmas <= kFarMounting) return;
    const double share = 1.0 - kFarMounting / sigmas;
    if (radar_.errors.turn) {
      cause("mounting_far", share,
            "The scans fit better if the mounting" + of_ + " is turned by " +
                degrees(radar_.errors.turn->error) + ", with sigmas of " +
                fixedTexts(radar_.errors.turn->sigma() / kDegree, 1) + ".",
            "Set estimate_extrinsics: pose, or correct " + mountingKey() +
                ": `rosrun rio_t calibrate` finds it.");
      return;
    }
    if (refinesHeldMounting(config_)) {
      cause("mounting_far", share,
            "The motion of the vehicle shows that the mounting" + of_ +
                " is turned from the configured one by " + degrees(radar_.turn) +
                ", and estimate_extrinsics: none takes it to be right to " +
                number(config_.odometry.smoother.extrinsics_rotation_sigma / kDegree) + " degrees.",
            "Set estimate_extrinsics: rotation, or correct " + mountingKey() + ".");
      return;
    }
    // With a wrong sign the estimate turns the mounting around, and then nothing contradicts it.
    cause("mounting_far", share,
          "The estimated mounting" + of_ + " is turned from the configured one by " + degrees(radar_.turn) +
              ", with extrinsics_rotation_sigma " +
              number(config_.odometry.smoother.extrinsics_rotation_sigma / kDegree) + " degrees.",
          "Check " + key_ + "radar_doppler_sign, " + key_ + "radar_axes and the mounting (" + mountingKey() +
              ")." + mountingAdvice(radar_),
          true);
  }

  /// Returns the key, or the tf, that gives the mounting of the radar.
  std::string keyOrTf(const std::string& key) const {
    return config_.extrinsics_source == ExtrinsicsSource::kTf ? "the tf of the cloud in the IMU" : key_ + key;
  }
  std::string mountingKey() const { return keyOrTf("extrinsics_rotation_xyzw, order x, y, z, w"); }

  static std::string degrees(const Eigen::Vector3d& turn) {
    return fixedTexts(turn / kDegree, 0) + " degrees about x, y, z of the IMU";
  }

  const RadarSummary& radar_;
  const Config& config_;
  const std::string key_, of_;
  std::vector<Cause>* causes_;
};

}  // namespace

void addCausesOfRadar(const RadarSummary& radar, const Config& config, std::vector<Cause>* causes) {
  RadarCauses(radar, config, causes).add();
}

}  // namespace rio_t
