#include "rio_t/ros/bag/check_bag.h"

#include <algorithm>
#include <boost/algorithm/string.hpp>
#include <cctype>
#include <cmath>
#include <exception>
#include <filesystem>
#include <set>
#include <utility>

#include "../text.h"
#include "inspect_radar.h"
#include "rio_t/ros/bag/bag_runner.h"

namespace rio_t {
namespace {

void append(const std::vector<Finding>& from, std::vector<Finding>* to) {
  to->insert(to->end(), from.begin(), from.end());
}

/// The IMU that can be used, with the most samples; if none can be used, one that says why. There is at least
/// one. The report names the others.
ImuInspection chooseImu(const Recording& recording, BagCheck* check) {
  std::vector<ImuInspection> imus;
  for (const ImuTopic& topic : recording.imus) imus.push_back(inspectImuTopic(topic));
  const auto best =
      std::max_element(imus.begin(), imus.end(), [](const ImuInspection& a, const ImuInspection& b) {
        if (a.to_do.empty() != b.to_do.empty()) return b.to_do.empty();
        return a.times.size() < b.times.size();
      });
  std::string others;
  for (const ImuInspection& imu : imus) {
    if (&imu == &*best) continue;
    appendItem(&others, imu.topic + (imu.to_do.empty() ? "" : " (cannot be used)"));
  }
  if (!others.empty())
    check->findings.push_back({FindingLevel::kOdd, "IMU",
                               best->topic + " is chosen; the other topics of type sensor_msgs/Imu: " +
                                   others + "; --imu-topic chooses another"});
  return std::move(*best);
}

/// The part of each topic that differs: "/radar_a/scan", "/radar_b/scan" give "a", "b".
std::vector<std::string> radarNames(const std::vector<RadarInspection>& radars) {
  std::vector<std::vector<std::string>> words;
  for (const RadarInspection& radar : radars) {
    std::string topic = boost::algorithm::to_lower_copy(radar.topic);
    for (char& c : topic) {
      if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = ' ';
    }
    words.emplace_back();
    boost::algorithm::split(words.back(), topic, boost::algorithm::is_any_of(" "),
                            boost::algorithm::token_compress_on);
  }
  std::set<std::string> keys = {"radars"};
  for (const ParameterDescription& about : parameterDescriptions()) keys.insert(about.key);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < radars.size(); ++k) {
    std::string name;
    for (const std::string& word : words[k]) {
      const bool shared = std::all_of(words.begin(), words.end(), [&](const std::vector<std::string>& other) {
        return std::find(other.begin(), other.end(), word) != other.end();
      });
      if (!shared && !word.empty()) appendItem(&name, word, "_");
    }
    // A name that YAML takes for a number or a truth value is none.
    const bool is_text = !name.empty() && std::isalpha(static_cast<unsigned char>(name.front())) != 0;
    const bool taken = std::find(names.begin(), names.end(), name) != names.end() || keys.count(name) != 0;
    static const std::set<std::string> words_of_yaml = {"y",   "n",    "yes",   "no",  "on",
                                                        "off", "true", "false", "null"};
    if (!is_text || taken || words_of_yaml.count(name) != 0) name = "radar" + std::to_string(k + 1);
    names.push_back(name);
  }
  return names;
}

ProposedConfig proposed(const ImuInspection& imu, const std::vector<RadarInspection>& radars) {
  ProposedConfig config;
  config.top_level.add(imu.keys);
  double worst = 0.0;
  bool all_observed = true;
  for (const RadarInspection& radar : radars) {
    const Eigen::Vector3d& sigma = radar.search.rotation_sigma;
    if (!radar.search.enough || sigma.maxCoeff() > kObservedTurn || radar.isSparse()) all_observed = false;
    worst = std::max(worst, sigma.maxCoeff());
  }
  config.top_level.set("estimate_extrinsics", "rotation",
                       "The mounting below is coarse. The estimate starts there and refines it.");
  constexpr double kLeast = 0.05, kSafety = 3.0;  // [rad]
  if (all_observed && kSafety * worst < SmootherOptions().extrinsics_rotation_sigma)
    config.top_level.set("extrinsics_rotation_sigma",
                         ParameterValue{rounded(std::max(kLeast, kSafety * worst), 100.0)},
                         "Standard deviation of the mounting below [rad], with a margin.");
  if (radars.size() == 1) {
    config.top_level.add(radars.front().keys);
    return config;
  }
  const std::vector<std::string> names = radarNames(radars);
  ParameterValue::List list;
  for (const std::string& name : names) list.push_back({name});
  config.top_level.set("radars", ParameterValue{list});
  for (std::size_t k = 0; k < radars.size(); ++k) config.radars.emplace_back(names[k], radars[k].keys);
  return config;
}

struct Trial {
  std::string failure;  ///< why it did not run; empty: it ran
  RunSummary summary;
  std::uint64_t copies = 0;  ///< clouds that were recorded twice: they say nothing about the configuration

  /// Copies do not count.
  double shareUsed() const {
    const std::uint64_t duplicates = countOf(summary.scansRejected(), "duplicate_stamp");
    const std::uint64_t judged = summary.scansTotal() - std::min(copies, duplicates);
    return static_cast<double>(summary.scansUsed()) / static_cast<double>(std::max<std::uint64_t>(1, judged));
  }
  bool good() const {
    return failure.empty() && summary.divergences == 0 && summary.health_at_end == toString(Health::kOk) &&
           summary.diagnosis.verdict != RunVerdict::kBad && shareUsed() > 0.5;
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
    run.bags = {recording.bag};
    run.config = readBack(yaml);
    run.config.bag_duration = duration;
    trial.summary = runBag(run);
  } catch (const std::exception& error) {
    trial.failure = error.what();
  }
  return trial;
}

struct Attempt {
  const char* key;
  const char* value;
  const char* why;
};
/// The configurations that are tried one after the other if the odometry does not run well.
constexpr Attempt kAttempts[] = {
    {nullptr, nullptr, nullptr},
    {"estimate_extrinsics", "pose", "With a fixed lever arm the odometry diverged."},
};

std::string shareText(const Trial& trial) {
  return fixedText(100.0 * trial.shareUsed(), 0) + " % of the scans used";
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

void tellTrial(const Trial& trial, const std::string& note, BagCheck* check) {
  if (!trial.failure.empty()) {
    check->findings.push_back({FindingLevel::kMissing, "trial run", trial.failure});
    check->to_do = "See the lines marked odd; then record again, at rest for 3 s and then in motion.";
    return;
  }
  const RunSummary& s = trial.summary;
  const std::string numbers =
      shareText(trial) + ", " + fixedText(s.path_length_m, 1) + " m, " + offsetsText(s);
  if (trial.good()) {
    check->findings.push_back({note.empty() ? FindingLevel::kOk : FindingLevel::kOdd, "trial run",
                               "no divergence, " + numbers + note});
    return;
  }
  check->findings.push_back(
      {FindingLevel::kMissing, "trial run",
       "divergences: " + std::to_string(s.divergences) + ", at the end " + s.health_at_end + "; " + numbers});
  std::string why = "the run is " + toString(s.diagnosis.verdict);
  if (!s.diagnosis.causes.empty()) {
    const Cause& cause = s.diagnosis.causes.front();
    why += ": " + cause.text + " " + cause.remedy;
  }
  check->findings.push_back({FindingLevel::kOdd, "trial run", why});
  check->to_do =
      "The odometry does not run well with what the bag shows. Measure the mounting, set "
      "mounting_yaw_pitch_roll_deg and extrinsics_translation, and see docs/your_sensors.md.";
}

/// The configuration with which the odometry runs best on the bag.
void chooseByTrial(const Recording& recording, const std::string& header, const ProposedConfig& config,
                   BagCheck* check) {
  const double duration = recording.read < recording.length ? recording.read : 0.0;
  Trial best;
  best.failure = "not tried";
  std::string note;
  for (const Attempt& attempt : kAttempts) {
    ProposedConfig changed = config;
    if (attempt.key != nullptr) changed.top_level.set(attempt.key, attempt.value, attempt.why);
    const std::string yaml = toYaml(changed, header);
    const Trial trial = tryOut(recording, yaml, duration);
    if (check->yaml.empty() || trial.score() > best.score()) {
      best = trial;
      check->yaml = yaml;
      note = attempt.key == nullptr ? ""
                                    : std::string(" (with ") + attempt.key + ": " + attempt.value +
                                          "; without it, it does not run as well)";
    }
    if (trial.good()) break;
  }
  // One radar alone may do.
  for (const auto& [name, keys] : config.radars) {
    if (best.good()) break;
    ProposedConfig alone{config.top_level, {}};
    alone.top_level.remove("radars");
    alone.top_level.add(keys);
    const std::string yaml = toYaml(alone, header);
    const Trial trial = tryOut(recording, yaml, duration);
    if (trial.score() <= best.score()) continue;
    best = trial;
    check->yaml = yaml;
    note = " (with the radar " + name + " alone; together the odometry does not run as well)";
  }
  tellTrial(best, note, check);
  if (!best.good()) check->quality -= 1e3;
  if (!best.failure.empty()) check->yaml.clear();
}

std::string header(const Recording& recording) {
  return "Written by rio_t check_bag from " + oneLine(recording.bag) +
         ".\nIt has the keys that differ from the defaults; config/estimator.yaml lists all."
         "\nRun: rosrun rio_t rio_t_bag --bag BAG --config THIS_FILE --output-dir results";
}

std::string topicsOf(const Recording& recording) {
  std::string text;
  for (const auto& [topic, type] : recording.types) appendItem(&text, topic + " (" + type + ")");
  return text.empty() ? "none" : text;
}

bool hasType(const Recording& recording, const std::string& type) {
  return std::any_of(recording.types.begin(), recording.types.end(),
                     [&](const auto& topic) { return topic.second == type; });
}

void missing(const std::string& subject, const std::string& text, const std::string& to_do, BagCheck* check) {
  check->findings.push_back({FindingLevel::kMissing, subject, text});
  check->to_do = to_do;
}

/// Two topics of one radar, one filtered: the other has more points.
void leaveOutCopies(std::vector<RadarInspection>* radars, const Recording& recording, BagCheck* check) {
  const auto stampsOf = [&](const std::string& topic) {
    std::set<std::int64_t> stamps;
    for (const CloudTopic& cloud : recording.clouds) {
      if (cloud.topic != topic) continue;
      for (const MessageTimes& times : cloud.times) {
        if (times.stamp != Time()) stamps.insert(times.stamp.nanoseconds());
      }
    }
    return stamps;
  };
  for (std::size_t i = 0; i < radars->size(); ++i) {
    for (std::size_t k = radars->size(); k-- > i + 1;) {
      RadarInspection& a = (*radars)[i];
      RadarInspection& b = (*radars)[k];
      const std::set<std::int64_t> of_a = stampsOf(a.topic), of_b = stampsOf(b.topic);
      const auto both =
          std::count_if(of_a.begin(), of_a.end(), [&](std::int64_t s) { return of_b.count(s) != 0; });
      const double turn = a.search.q_IR.angularDistance(b.search.q_IR);
      constexpr double kSame = 0.26;  // [rad]
      const bool same_mounting = !a.search.enough || !b.search.enough || turn < kSame;
      if (of_a.empty() || 10 * static_cast<std::size_t>(both) < 9 * std::min(of_a.size(), of_b.size()) ||
          !same_mounting)
        continue;
      if (b.points > a.points) std::swap(a, b);
      check->findings.push_back({FindingLevel::kOdd, "radar",
                                 b.topic + " has the stamps and the mounting of " + a.topic +
                                     ": one radar, so only the topic with more points is used"});
      radars->erase(radars->begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
}

std::string levelText(FindingLevel level) {
  switch (level) {
    case FindingLevel::kOk:
      return "OK      ";
    case FindingLevel::kOdd:
      return "odd     ";
    case FindingLevel::kMissing:
      break;
  }
  return "missing ";
}

}  // namespace

BagCheck checkBag(const std::string& bag, const CheckRequest& request) {
  BagCheck check;
  check.bag = bag;
  const Recording recording = readRecording(bag, request);
  if (recording.read < recording.length)
    check.findings.push_back({FindingLevel::kOk, "bag",
                              "the first " + fixedText(recording.read, 0) + " of " +
                                  fixedText(recording.length, 0) + " s were read (--duration)"});
  if (recording.imus.empty()) {
    missing("IMU",
            "the bag has no topic " + (request.imu_topic.empty() ? "" : request.imu_topic + " ") +
                "of type sensor_msgs/Imu; it has " + topicsOf(recording),
            !request.imu_topic.empty() && hasType(recording, "sensor_msgs/Imu")
                ? "Choose a topic of that type which the bag has with --imu-topic, or leave the option out."
                : "Record the IMU, too: 100 Hz or more, with raw acceleration and angular velocity.",
            &check);
    return check;
  }
  const ImuInspection imu = chooseImu(recording, &check);
  append(imu.findings, &check.findings);
  if (!imu.to_do.empty()) {
    check.to_do = imu.to_do;
    return check;
  }
  std::vector<RadarInspection> radars;
  for (const CloudTopic& cloud : recording.clouds) {
    RadarInspection radar = inspectRadar(recording, imu, cloud);
    append(radar.findings, &check.findings);
    if (radar.usable) radars.push_back(std::move(radar));
  }
  if (radars.empty()) {
    if (recording.clouds.empty()) {
      std::string wanted;
      for (const std::string& topic : request.radar_topics) wanted += topic + " ";
      missing(
          "radar",
          "the bag has no topic " + wanted + "of type sensor_msgs/PointCloud2; it has " + topicsOf(recording),
          !request.radar_topics.empty() && hasType(recording, "sensor_msgs/PointCloud2")
              ? "Choose topics of that type which the bag has with --radar-topic, or leave the option out."
              : "Record the radar, too: a point cloud with positions and Doppler.",
          &check);
    } else {
      check.to_do = "Use a radar driver that publishes positions and Doppler as sensor_msgs/PointCloud2.";
    }
    return check;
  }
  // A cloud of another sensor beside a radar that works is no reason to stop.
  for (Finding& finding : check.findings) {
    if (finding.level == FindingLevel::kMissing) finding.level = FindingLevel::kOdd;
  }
  leaveOutCopies(&radars, recording, &check);
  for (const RadarInspection& radar : radars) {
    if (radar.search.enough) check.quality += 1.0 / radar.search.rotation_sigma.norm();
  }
  const ProposedConfig config = proposed(imu, radars);
  if (request.try_out) {
    chooseByTrial(recording, header(recording), config, &check);
  } else {
    check.yaml = toYaml(config, header(recording));
    readBack(check.yaml);
  }
  return check;
}

std::string describeCheck(const BagCheck& check) {
  constexpr std::size_t kSubject = 11, kWidth = 118;
  std::string text = check.bag + "\n";
  for (const Finding& finding : check.findings) {
    std::string line = "  " + levelText(finding.level) + finding.subject;
    line += std::string(finding.subject.size() < kSubject ? kSubject - finding.subject.size() : 1, ' ');
    text += line + wrapped(finding.text, std::string(2 + 8 + kSubject, ' '), kWidth) + "\n";
  }
  if (!check.to_do.empty()) text += "  To do: " + wrapped(check.to_do, std::string(9, ' '), kWidth) + "\n";
  return text;
}

}  // namespace rio_t
