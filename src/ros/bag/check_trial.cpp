#include <algorithm>
#include <exception>

#include "../text.h"
#include "check_config.h"
#include "rio_t/ros/bag/bag_runner.h"

namespace rio_t {
namespace {

struct Trial {
  std::string failure;  ///< why it did not run; empty: it ran
  RunSummary summary;
  std::uint64_t copies = 0;  ///< clouds that were recorded twice: they say nothing about the configuration

  /// Neither copies nor scans before the start count.
  double shareUsed() const {
    // By the source of the stamps, a copy is rejected for one of these reasons.
    std::uint64_t rejected = 0;
    for (const char* reason : {"duplicate_stamp", "scan_repeated", "trigger_missing"})
      rejected += countOf(summary.scansRejected(), reason);
    std::uint64_t judged = summary.scansTotal() - std::min(copies, rejected);
    for (const RadarSummary& radar : summary.radars) judged -= radar.scans_before_start;
    return static_cast<double>(summary.scansUsed()) / static_cast<double>(std::max<std::uint64_t>(1, judged));
  }
  bool good() const {
    return failure.empty() && summary.health == Health::kOk &&
           summary.diagnosis.verdict != RunVerdict::kBad && shareUsed() > 0.5 &&
           static_cast<double>(summary.scans_diverged) <=
               kManyDiverged * static_cast<double>(summary.scans_judged);
  }
  /// Larger is better; a good one is better than all others.
  double score() const {
    if (!failure.empty()) return -1e9;
    return shareUsed() - static_cast<double>(summary.divergences) - (good() ? 0.0 : 1.0);
  }
};

Trial tryOut(const Recording& recording, const std::string& yaml, double duration) {
  Trial trial;
  for (const CloudTopic& cloud : recording.clouds) trial.copies += cloud.copies;
  try {
    BagRun run;
    run.bags = recording.bags;
    run.config = readBack(yaml);
    run.config.bag_duration = duration;
    trial.summary = runBag(run);
  } catch (const std::exception& error) {
    trial.failure = error.what();
  }
  return trial;
}

std::string shareText(const Trial& trial) {
  return fixedText(100.0 * trial.shareUsed(), 0) + " % of the scans after the start used";
}

std::string offsetsText(const RunSummary& summary) {
  std::string text;
  for (const RadarSummary& radar : summary.radars) {
    text += (text.empty() ? "offset " : "; ") + (radar.name.empty() ? "" : radar.name + " ") +
            fixedText(1e3 * radar.final_offset_s, 1) + " +- " +
            fixedText(1e3 * radar.final_offset_sigma_s, 1) + " ms";
  }
  return text;
}

std::string divergencesText(const RunSummary& summary) {
  return summary.divergences == 0 ? "no divergence" : "divergences: " + std::to_string(summary.divergences);
}

std::string verdictText(const Diagnosis& diagnosis) {
  std::string text = "the run is " + toString(diagnosis.verdict);
  if (diagnosis.causes.empty()) return text;
  const Cause& cause = diagnosis.causes.front();
  text += ": " + cause.text;
  // The user runs check_bag just now.
  return cause.remedy_is_check_bag ? text : text + " " + cause.remedy;
}

void tellTrial(const Trial& trial, const std::string& note, BagCheck* check) {
  if (!trial.failure.empty()) {
    check->missing("trial run", trial.failure,
                   "See the lines marked odd; then record again, at rest for 3 s and then in motion.");
    return;
  }
  const RunSummary& s = trial.summary;
  const std::string numbers =
      shareText(trial) + ", " + fixedText(s.path_length_m, 1) + " m, " + offsetsText(s);
  if (trial.good()) {
    check->tell(note.empty() ? FindingLevel::kOk : FindingLevel::kOdd, "trial run",
                divergencesText(s) + ", " + numbers + note);
    if (s.diagnosis.verdict != RunVerdict::kGood) check->odd("trial run", verdictText(s.diagnosis));
    return;
  }
  check->missing("trial run", divergencesText(s) + ", at the end " + toString(s.health) + "; " + numbers,
                 "The odometry does not run well with what the bag shows. Look at the odd lines.");
  check->odd("trial run", verdictText(s.diagnosis));
  const std::vector<Cause>& causes = s.diagnosis.causes;
  if (causes.empty() || causes.front().remedy_is_check_bag)
    check->to_do +=
        " Measure the mounting and give it: --set mounting_yaw_pitch_roll_deg=[YAW,PITCH,ROLL] "
        "--set extrinsics_translation=[X,Y,Z] (docs/your_sensors.md, section 3). If that does not help, look "
        "at the axes of the IMU: an inverted axis of the gyro contradicts every radar.";
}

}  // namespace

void chooseByTrial(const Recording& recording, const std::string& header, const ProposedConfig& config,
                   BagCheck* check) {
  const double duration = recording.read < recording.length ? recording.read : 0.0;
  Trial best;
  std::string note;  // about `best`
  const auto attempt = [&](const ProposedConfig& proposed, const std::string& its_note) {
    const std::string yaml = toYaml(proposed, header);
    const Trial trial = tryOut(recording, yaml, duration);
    if (!check->yaml.empty() && trial.score() <= best.score()) return;
    best = trial;
    check->yaml = yaml;
    note = its_note;
  };
  attempt(config, "");
  for (const auto& [name, keys] : config.radars) {
    if (best.good()) break;
    ProposedConfig alone{config.top_level, {}};
    alone.top_level.remove("radars");
    alone.top_level.add(keys);
    attempt(alone, " (with the radar " + name + " alone; together the odometry does not run as well)");
  }
  tellTrial(best, note, check);
  if (!best.good()) check->quality -= 1e3;
  if (!best.failure.empty()) check->yaml.clear();
}

}  // namespace rio_t
