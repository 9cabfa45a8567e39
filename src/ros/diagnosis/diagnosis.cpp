#include "rio_t/ros/diagnosis/diagnosis.h"

#include <algorithm>

#include "../text.h"
#include "causes.h"
#include "rio_t/core/angle.h"
#include "rio_t/core/so3.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

// As kManyScans.
constexpr double kManyWindows = 0.3;
/// A true offset of 0.3 to 0.5 s left 85 % of the windows at the bound, and looked like a wrong scale of the
/// Doppler. A wrong scale of 0.28 to 3.6 left at most 61 % there.
constexpr double kMostWindows = 0.75;
constexpr double kFewScansUsed = 0.5;
constexpr double kLateStart = 0.5;
constexpr double kMostlySilent = 0.5;
/// [rad] A heading that is off by this much leads to a position error of a tenth of the way.
constexpr double kVagueHeading = 0.1;
/// More steps of the offset, for each radar, are a cause: one restart of a driver counts twice at most.
constexpr std::uint64_t kMostSteps = 2;
constexpr std::size_t kMostCauses = 3;

/// Windows that were solved. Some ended with the offset at its bound, some did not converge.
struct Windows {
  std::uint64_t all = 0, at_bound = 0, not_converged = 0;
};
Windows windowsOf(const RunEvidence& evidence) {
  Windows windows;
  for (const auto& [reason, count] : evidence.solver_terminations) windows.all += count;
  windows.at_bound = countOf(evidence.solver_terminations, toString(SolverTermination::kAtBound));
  for (const SolverTermination termination :
       {SolverTermination::kIterationLimit, SolverTermination::kNoDecrease})
    windows.not_converged += countOf(evidence.solver_terminations, toString(termination));
  return windows;
}

/// Share of the scans after the start that were used.
double usedShare(const RunEvidence& evidence) {
  std::uint64_t used = 0, after_start = 0;
  for (const RadarSummary& radar : evidence.radars) {
    used += radar.scans_used;
    after_start += radar.scans_total - radar.scans_before_start;
  }
  return shareOf(used, after_start);
}

/// Share of the scans that came before the estimate began for another reason than their stamps.
double lateStart(const RunEvidence& evidence) {
  std::uint64_t before_start = 0, all = 0;
  for (const RadarSummary& radar : evidence.radars) {
    before_start += radar.scans_before_start - radar.scans_before_imu - radar.scans_ahead_at_start;
    all += radar.scans_total;
  }
  return all < kEnoughScans ? 0.0 : shareOf(before_start, all);
}

double shareOfRun(const RunEvidence& evidence, double seconds) {
  return evidence.run_seconds > 0.0 ? seconds / evidence.run_seconds : 0.0;
}

/// Share of the time in which the IMU alone carried the estimate.
double silentShare(const RunEvidence& evidence) { return shareOfRun(evidence, evidence.silent_seconds); }

/// Share of the time without used scans, of the radar that was silent the longest.
double worstSilentShare(const RunEvidence& evidence) {
  double seconds = evidence.silent_seconds;
  for (const RadarSummary& radar : evidence.radars) seconds = std::max(seconds, radar.silent_seconds);
  return shareOfRun(evidence, seconds);
}

/// Rotation of the estimated vehicle frame from the configured one [rad about the axes of I]; zero if there
/// is no estimate.
Eigen::Vector3d vehicleTurn(const RunEvidence& evidence, const Config& config) {
  if (!evidence.ground_vehicle || !evidence.ground_vehicle->last) return Eigen::Vector3d::Zero();
  return so3::log(evidence.ground_vehicle->rotation * config.odometry.ground_vehicle.T_IV.q_IR.conjugate());
}

/// The same about the worst axis, in sigmas.
double vehicleTurnSigmas(const RunEvidence& evidence, const Config& config) {
  return vehicleTurn(evidence, config).cwiseAbs().maxCoeff() / config.odometry.ground_vehicle.rotation_sigma;
}

/// A stamp, to the millisecond.
std::string stampText(Time time) { return fixedText(time.seconds(), 3) + " s"; }

/// This cause is certain and explains all others, so its share is 1.
void addPublishers(const RunEvidence& evidence, std::vector<Cause>* causes) {
  for (const std::string& text : evidence.several_publishers)
    causes->push_back({"several_publishers", text, kSeveralPublishersRemedy, 1.0});
}

void addStart(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  const StartObstacle obstacle = evidence.waiting_for.obstacle;
  const std::string text = "The start waits for " + evidence.waiting_for.text + ".";
  if (evidence.initialized) {
    const double late = lateStart(evidence);
    if (late > kLateStart)
      causes->push_back({"started_late",
                         fixedText(100.0 * late, 0) + " % of the scans came before the estimate began.",
                         config.odometry.init_mode == InitMode::kStatic
                             ? "Let the platform rest at the start, or set init_mode: auto."
                             : "Let the platform rest for init_duration at the start.",
                         late});
    return;
  }
  if (obstacle == StartObstacle::kContradiction) {
    causes->push_back({"start_contradicts", text,
                       "Check radar_doppler_sign, radar_axes, extrinsics_rotation_xyzw (order x, y, z, w), "
                       "imu_acceleration_unit and imu_rate_unit. Run `rosrun rio_t check_bag BAG`: it finds "
                       "them all.",
                       0.9, true});
  } else if (obstacle == StartObstacle::kWrongGravity) {
    causes->push_back({"imu_units", text,
                       "The driver of the IMU may publish g: then set imu_acceleration_unit: g. The driver "
                       "must not remove gravity.",
                       0.95});
  } else if (config.odometry.init_mode == InitMode::kStatic) {
    causes->push_back(
        {"never_at_rest", text, "Let the platform rest at the start, or set init_mode: auto.", 0.8});
  } else {
    causes->push_back(
        {"too_short", text,
         "The start needs more data: init_duration of rest, or init_motion_after plus init_motion_window of "
         "motion.",
         0.2});
  }
}

void addOffset(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  const Windows windows = windowsOf(evidence);
  const double share = shareOf(windows.at_bound, windows.all);
  if (share < kManyWindows || windows.all < kEnoughScans) return;
  const double explained = share > kMostWindows ? 1.0 : share;
  const double bound = config.odometry.smoother.max_time_offset;
  causes->push_back({"offset_at_bound",
                     outOf(windows.at_bound, windows.all, "windows") +
                         " end with the time offset at its bound, max_time_offset " + number(bound) + " s.",
                     "Raise max_time_offset, subtract a known delay with radar_stamp_shift, or set "
                     "stamp_source: arrival. A wrong mounting can have the same effect.",
                     explained});
  // A mounting that is far off drives the offset to its bound. So the farthest mounting explains these
  // windows, too.
  Cause* mounting = nullptr;
  for (Cause& each : *causes) {
    const bool is_farthest = mounting == nullptr || each.share > mounting->share;
    if (each.name == "mounting_far" && is_farthest) mounting = &each;
  }
  if (mounting != nullptr) mounting->share = std::max(mounting->share, explained);
}

void addOffsetSteps(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  const std::uint64_t steps = countOf(evidence.input_faults, "time_offset_step");
  if (steps <= kMostSteps * evidence.radars.size()) return;
  std::string remedy =
      "A driver that restarts makes one step. A wrong mounting, persons in front of few points and a wrong "
      "scale of the gyro look like steps, too: check them, or set time_offset_step_detection: false.";
  if (config.odometry.smoother.time_offset_shared)
    remedy += " With time_offset_shared: true, radars of different offsets do so, too.";
  causes->push_back(
      {"offset_steps", "The time offset stepped " + std::to_string(steps) + " times.", remedy, 0.1});
}

void addVehicle(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  // The cause is certain, and the estimate keeps what the constraint did before: the share is 1.
  if (evidence.ground_vehicle && evidence.ground_vehicle->contradicted_at)
    causes->push_back({"vehicle_contradicted",
                       "The motion contradicted platform: ground_vehicle: the platform moves sideways or "
                       "upwards.",
                       "If it is no ground vehicle, set platform: free. If it is one, check "
                       "vehicle_frame_rotation_xyzw, the way it drives, and vehicle_frame_translation, the "
                       "point that does not slip.",
                       1.0});
  const double sigmas = vehicleTurnSigmas(evidence, config);
  if (sigmas <= kFarMounting) return;
  const Eigen::Vector3d turn = vehicleTurn(evidence, config) / kDegree;
  causes->push_back(
      {"vehicle_frame_far",
       "The estimated vehicle frame is turned from the configured one by " + fixedText(turn.x(), 0) + ", " +
           fixedText(turn.y(), 0) + ", " + fixedText(turn.z(), 0) + " degrees about x, y, z of the IMU, " +
           number(sigmas) + " vehicle_frame_rotation_sigma.",
       "Check vehicle_frame_rotation_xyzw (order x, y, z, w): which way does the vehicle drive?",
       1.0 - kFarMounting / sigmas});
}

void addSolver(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  const Windows windows = windowsOf(evidence);
  const double share = shareOf(windows.not_converged, windows.all);
  if (share < kManyWindows) return;
  if (config.mode == RunMode::kBatch) {
    causes->push_back({"not_converged", "The batch stopped before it converged.",
                       "Raise batch_max_iterations " + std::to_string(config.batch_max_iterations) +
                           ". A wrong mounting can have the same effect.",
                       share});
  } else if (windows.all >= kEnoughScans) {
    causes->push_back({"not_converged",
                       outOf(windows.not_converged, windows.all, "windows") + " stop before they converge.",
                       "Raise max_iterations " + std::to_string(config.odometry.smoother.max_iterations) +
                           ". A wrong mounting can have the same effect.",
                       share});
  }
}

/// The heading also drifts after a start at rest, but only by the noise of the gyro.
void addHeading(const RunEvidence& evidence, std::vector<Cause>* causes) {
  if (evidence.initialized_from != InitializedFrom::kMotion || evidence.heading_sigma <= kVagueHeading)
    return;
  causes->push_back({"heading_vague",
                     "The heading is known to " + number(evidence.heading_sigma) +
                         " rad only: a start in motion does not show the bias of the gyro.",
                     "Let the platform rest for init_duration at the start, or lower "
                     "init_motion_sigma_gyro_bias to what your IMU promises.",
                     std::min(1.0, evidence.heading_sigma)});
}

void addRestarts(const RunEvidence& evidence, const Config& config, std::vector<Cause>* causes) {
  if (evidence.imu_restarts.empty()) return;
  // The cause is certain and concerns the whole trajectory: the share is 1.
  causes->push_back({"imu_clock_restart", describeRestarts(evidence.imu_restarts, config),
                     evidence.imu_restarts.front().stamps_went_on
                         ? "Correct what the driver of the IMU writes there, or run each part by itself "
                           "(bag_start, bag_duration)."
                         : "Run each part by itself (bag_start, bag_duration). For a short gap, raise "
                           "max_bridged_imu_gap.",
                     1.0});
}

/// Adds each of several radars that is silent while another works.
void addSilentRadar(const RunEvidence& evidence, std::vector<Cause>* causes) {
  if (silentShare(evidence) > kMostlySilent) return;
  for (const RadarSummary& radar : evidence.radars) {
    const double share = shareOfRun(evidence, radar.silent_seconds);
    if (share <= kMostlySilent) continue;
    causes->push_back({"radar_silent",
                       "No scan of radar " + radar.name + " was used for " +
                           fixedText(radar.silent_seconds, 1) + " of " + fixedText(evidence.run_seconds, 1) +
                           " s.",
                       "Look for what stops this radar or loses its messages.", share});
  }
}

/// If scans came and were rejected, they have causes of their own.
void addSilence(const RunEvidence& evidence, std::vector<Cause>* causes) {
  const double share = silentShare(evidence);
  if (share <= kMostlySilent || (usedShare(evidence) < kFewScansUsed && !causes->empty())) return;
  causes->push_back({"radar_silent",
                     "No scan was used from " + fixedText(evidence.silence_begin, 1) + " to " +
                         fixedText(evidence.silence_end, 1) +
                         " s after the start: the IMU alone carried the estimate for " +
                         fixedText(evidence.silent_seconds, 1) + " of " + fixedText(evidence.run_seconds, 1) +
                         " s.",
                     "Look for what stops the radar or loses its messages, or run the part with scans "
                     "(bag_start, bag_duration).",
                     share});
}

void addDivergence(const RunEvidence& evidence, std::vector<Cause>* causes) {
  const double share = shareOf(evidence.scans_diverged, evidence.scans_judged);
  const std::uint64_t divergences = evidence.divergences;
  if (divergences == 0 && evidence.health != Health::kDiverged) return;
  // Without scans the velocity gets lost, which counts as diverged. The cause is then the lack of scans.
  const auto contradicts = [](const Cause& cause) { return cause.name == "contradicts_imu"; };
  const bool scans_are_used = usedShare(evidence) >= kFewScansUsed && silentShare(evidence) <= kMostlySilent;
  if (!scans_are_used && !causes->empty() && std::none_of(causes->begin(), causes->end(), contradicts))
    return;
  if (evidence.scans_diverged == 0) {
    causes->push_back({"no_scans",
                       "The estimate diverged " + timesText(divergences) +
                           " while no scan came that can be used: the IMU alone carried it.",
                       "Look for what keeps the scans of the radar away.", 0.05});
    return;
  }
  if (evidence.scans_contradicted == 0) {
    causes->push_back({"velocity_lost",
                       "The velocity was lost " + timesText(divergences) + ", for " +
                           outOf(evidence.scans_diverged, evidence.scans_judged, "scans") +
                           ": the data had gaps or wrong samples, and no scan contradicts the estimate.",
                       "Look for what loses messages of the IMU (imu_gap among the input faults) or of the "
                       "radar, and for samples of the IMU that jump.",
                       std::max(0.05, share)});
    return;
  }
  // The estimate diverged only briefly, for example near a person, and is good again.
  if (share <= kManyDiverged && evidence.reinitializations == 0 && evidence.health == Health::kOk) return;
  const auto fewest = std::min_element(evidence.radars.begin(), evidence.radars.end(),
                                       [](const RadarSummary& a, const RadarSummary& b) {
                                         return a.points_per_scan[1] < b.points_per_scan[1];
                                       });
  causes->push_back({"diverged",
                     "The estimate diverged " + timesText(divergences) + ", for " +
                         outOf(evidence.scans_diverged, evidence.scans_judged, "scans") +
                         ": radar and IMU contradict each other.",
                     "Check the mounting (extrinsics_rotation_xyzw has the order x, y, z, w), "
                     "radar_doppler_sign and radar_axes. Is the Doppler in m/s?" +
                         mountingAdvice(*fewest) +
                         " If the estimate diverged only near large moving things, it is good again after "
                         "them.",
                     std::max(0.05, share), true});
}

/// If the data contradict each other, a mounting that nobody set is the likeliest cause.
void addMissingMounting(const Config& config, std::vector<Cause>* causes) {
  double share = -1.0;
  for (const Cause& cause : *causes)
    if (cause.name == "contradicts_imu" || cause.name == "start_contradicts" || cause.name == "diverged")
      share = std::max(share, cause.share);
  if (share < 0.0) return;
  std::vector<Cause> missing;
  for (const std::string& warning : mountingWarnings(config))
    missing.push_back(
        {"no_mounting", warning, "`rosrun rio_t check_bag BAG` finds the mounting.", share, true});
  causes->insert(causes->begin(), missing.begin(), missing.end());
}

std::vector<Check> checksOf(const RunEvidence& evidence, const Config& config,
                            const std::vector<Config>& radars) {
  const Windows windows = windowsOf(evidence);
  double kept = 1.0, turned = vehicleTurnSigmas(evidence, config), scaled = 0.0, offset = 0.0, moved = 0.0;
  for (std::size_t k = 0; k < evidence.radars.size(); ++k)
    turned = std::max(turned, turnSigmas(evidence.radars[k], radars.at(k)));
  for (const RadarSummary& radar : evidence.radars) {
    scaled = std::max(scaled, scaleSigmas(radar));
    offset = std::max(offset, offsetSigmas(radar));
    moved = std::max(moved, leverArmSigmas(radar));
  }
  for (const RadarSummary& radar : evidence.radars)
    if (pointsReceived(radar) > 0)
      kept = std::min(kept, shareOf(pointsOf(radar, PointVerdict::kKept), pointsReceived(radar)));
  return {
      {"started", evidence.initialized ? 1.0 : 0.0, 1.0, true},
      {"scans_used_share", usedShare(evidence), kFewScansUsed, true},
      {"scans_before_start_share", lateStart(evidence), kLateStart, false},
      {"silent_time_share", worstSilentShare(evidence), kMostlySilent, false},
      {"points_kept_share", kept, 1.0 - kManyPoints, true},
      {"scans_diverged_share", shareOf(evidence.scans_diverged, evidence.scans_judged), kManyDiverged, false},
      {"windows_at_offset_bound_share", shareOf(windows.at_bound, windows.all), kManyWindows, false},
      {"windows_not_converged_share", shareOf(windows.not_converged, windows.all), kManyWindows, false},
      {"mounting_turned_sigmas", turned, kFarMounting, false},
      {"held_lever_arm_error_sigmas", moved, kWrongLeverArm, false},
      {"doppler_scaled_sigmas", scaled, kWrongScale, false},
      {"held_offset_error_sigmas", offset, kWrongOffset, false},
      {"imu_faults_share", shareOfImuFaults(evidence), kManySamples, false},
      {"healthy_at_end", evidence.health == Health::kOk ? 1.0 : 0.0, 1.0, true}};
}

RunVerdict verdictOf(const RunEvidence& evidence, const Diagnosis& diagnosis) {
  const auto used = [](const RadarSummary& radar) { return radar.scans_used > 0; };
  const bool any_used = std::any_of(evidence.radars.begin(), evidence.radars.end(), used);
  const bool diverged =
      evidence.health == Health::kDiverged || shareOf(evidence.scans_diverged, evidence.scans_judged) > 0.5;
  const bool silent = silentShare(evidence) > kMostlySilent;
  if (!evidence.initialized || !any_used || diverged || silent) return RunVerdict::kBad;
  const bool all_green = std::all_of(diagnosis.checks.begin(), diagnosis.checks.end(),
                                     [](const Check& check) { return check.good(); });
  return all_green && diagnosis.causes.empty() ? RunVerdict::kGood : RunVerdict::kDoubtful;
}

}  // namespace

std::string toString(RunVerdict verdict) {
  return verdict == RunVerdict::kGood ? "good" : verdict == RunVerdict::kDoubtful ? "doubtful" : "bad";
}

Diagnosis diagnose(const RunEvidence& evidence, const Config& config) {
  Diagnosis result;
  const std::vector<Config> radars = configsOfRadars(config);
  addPublishers(evidence, &result.causes);
  for (std::size_t k = 0; k < evidence.radars.size(); ++k)
    addCausesOfRadar(evidence.radars[k], radars.at(k), &result.causes);
  addStart(evidence, config, &result.causes);
  addOffset(evidence, config, &result.causes);
  addOffsetSteps(evidence, config, &result.causes);
  addVehicle(evidence, config, &result.causes);
  addSolver(evidence, config, &result.causes);
  addCausesOfImu(evidence, config, &result.causes);
  addHeading(evidence, &result.causes);
  addRestarts(evidence, config, &result.causes);
  addSilence(evidence, &result.causes);
  addSilentRadar(evidence, &result.causes);
  addDivergence(evidence, &result.causes);
  addMissingMounting(config, &result.causes);
  // Stable: if two causes have the same share, the one nearer to the sensor comes first.
  std::stable_sort(result.causes.begin(), result.causes.end(),
                   [](const Cause& a, const Cause& b) { return a.share > b.share; });
  if (result.causes.size() > kMostCauses) {
    // A run that ends diverged is bad for that reason, so its cause stays.
    const auto last = result.causes.begin() + (kMostCauses - 1);
    const auto diverged =
        std::find_if(last, result.causes.end(), [](const Cause& cause) { return cause.name == "diverged"; });
    if (evidence.health == Health::kDiverged && diverged != result.causes.end()) std::swap(*last, *diverged);
    result.causes.resize(kMostCauses);
  }
  result.checks = checksOf(evidence, config, radars);
  result.verdict = verdictOf(evidence, result);
  return result;
}

std::string describeRestarts(const std::vector<ImuRestart>& restarts, const Config& config) {
  const ImuRestart& first = restarts.front();
  const bool is_ahead = first.before < first.after;
  const std::string from_to = " from " + stampText(first.before) + " to " + stampText(first.after);
  std::string text = first.stamps_went_on ? "No sample of the IMU that can be used came for " +
                                                fixedText(first.after - first.before, 1) + " s," + from_to
                                          : std::string("The stamps of the IMU jump ") +
                                                (is_ahead ? "ahead" : "back") + from_to;
  if (is_ahead)
    text +=
        ", more than max_bridged_imu_gap " + number(config.odometry.imu_input_check.max_bridged_gap) + " s";
  if (first.stamps_went_on) text += ": " + describeDropped(first.dropped);
  text += ". There the trajectory starts again at the origin";
  if (restarts.size() > 1)
    text += std::string(first.stamps_went_on ? "; more such gaps and jumps: " : "; more such jumps: ") +
            std::to_string(restarts.size() - 1);
  return text + ".";
}

std::string describeDropped(const Counts& dropped) {
  static const std::map<std::string, std::string> kTexts = {
      {"imu_not_finite", "were not finite"},
      {"imu_not_plausible", "had a reading that no IMU measures"},
      {"imu_out_of_order", "were out of order"},
      {"imu_stamp_jump", "were good ones after the gap, dropped for imu_jump_patience"}};
  std::string text;
  for (const auto& [fault, count] : dropped) {
    const auto known = kTexts.find(fault);
    appendItem(&text, std::to_string(count) + " " + (known == kTexts.end() ? fault : known->second));
  }
  return text;
}

std::string describe(const Check& check) {
  return check.name + " is " + number(check.value) + ", expected at " +
         (check.at_least ? "least " : "most ") + number(check.limit);
}

std::string describeCauses(const Diagnosis& diagnosis) {
  std::string text;
  for (std::size_t i = 0; i < diagnosis.causes.size(); ++i) {
    const Cause& cause = diagnosis.causes[i];
    text += "  " + std::to_string(i + 1) + ". " + cause.text + " " + cause.remedy + "\n";
  }
  for (const Check& check : diagnosis.checks) {
    if (check.good() || !diagnosis.causes.empty()) continue;  // a cause says it better
    text += "  " + describe(check) + "\n";
  }
  return text;
}

}  // namespace rio_t
