#include "rio_t/ros/bag/check_bag.h"

#include <algorithm>
#include <boost/algorithm/string/join.hpp>
#include <iterator>
#include <set>
#include <utility>

#include "../text.h"
#include "bag_file.h"
#include "bag_frames.h"
#include "check_config.h"
#include "inspect_radar.h"

namespace rio_t {
namespace {

/// Chooses the usable IMU with the most samples. If none is usable, the one with the most samples says why.
/// The report names the others. There is at least one IMU.
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
    check->odd("IMU", best->topic + " is chosen; the other topics of type sensor_msgs/Imu: " + others +
                          "; --imu-topic chooses another");
  return std::move(*best);
}

std::string header(const Recording& recording) {
  return "Written by rio_t check_bag from " + boost::algorithm::join(recording.bags, ", ") +
         ".\nIt has the keys that differ from the defaults; config/estimator.yaml lists all."
         "\nRun: rosrun rio_t rio_t_bag --bag BAG --config THIS_FILE --output-dir results";
}

bool hasType(const Recording& recording, const std::string& type) {
  return std::any_of(recording.types.begin(), recording.types.end(),
                     [&](const auto& topic) { return topic.second == type; });
}

bool hasCloud(const Recording& recording, const std::string& topic) {
  return std::any_of(recording.clouds.begin(), recording.clouds.end(),
                     [&](const CloudTopic& cloud) { return cloud.topic == topic; });
}

/// Says that the bag has no clouds on these topics. An empty list means any topic.
void missRadar(const std::vector<std::string>& topics, const Recording& recording, BagCheck* check) {
  std::string wanted;
  for (const std::string& topic : topics) wanted += topic + " ";
  check->missing(
      "radar",
      "the bag has no topic " + wanted + "of type sensor_msgs/PointCloud2; it has " +
          topicsText(recording.types),
      !topics.empty() && hasType(recording, "sensor_msgs/PointCloud2")
          ? "Choose topics of that type which the bag has with --radar-topic, or leave the option out."
          : "Record the radar, too: a point cloud with positions and Doppler.");
}

/// A driver may publish one radar on two topics, one of them filtered. Keeps the topic with more points.
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
      const bool knows_mounting = a.search.enough && b.search.enough;
      if (of_a.empty() || 10 * static_cast<std::size_t>(both) < 9 * std::min(of_a.size(), of_b.size()) ||
          (knows_mounting && turn >= kFarApart))
        continue;
      if (b.points > a.points) std::swap(a, b);
      check->odd("radar",
                 knows_mounting
                     ? b.topic + " has the stamps and the mounting of " + a.topic +
                           ": one radar, so only the topic with more points is used"
                     : b.topic + " has the stamps of " + a.topic +
                           ", so only the topic with more points is used. If these are two radars, record "
                           "with motion, or choose one with --radar-topic");
      radars->erase(radars->begin() + static_cast<std::ptrdiff_t>(k));
    }
  }
}

/// Marks a good trial run as odd if the axes are mirrored. With a negated accelerometer the odometry runs
/// well, too, but its track is a mirror image.
void markMirrored(const std::vector<RadarInspection>& radars, BagCheck* check) {
  const bool is_mirrored = std::any_of(radars.begin(), radars.end(),
                                       [](const RadarInspection& each) { return each.search.mirrored; });
  if (!is_mirrored) return;
  for (Finding& finding : check->findings) {
    if (finding.subject != "trial run" || finding.level != FindingLevel::kOk) continue;
    finding.level = FindingLevel::kOdd;
    finding.text += ". If the accelerometer is negated, this track is a mirror image: see the line axes";
  }
}

/// Names the topics with several publishers. They mislead all other checks, so this comes first. Returns
/// whether there are any.
bool nameSeveralPublishers(const Recording& recording, BagCheck* check) {
  const auto name = [check](const std::string& subject, const auto& topic) {
    const std::string several = topic.publishers.describeSeveral(topic.topic);
    if (!several.empty()) check->odd(subject, several + " " + kSeveralPublishersRemedy);
  };
  for (const ImuTopic& topic : recording.imus) name("IMU", topic);
  for (const CloudTopic& topic : recording.clouds) name("radar", topic);
  return !check->findings.empty();
}

std::string levelText(FindingLevel level) {
  constexpr const char* kNames[] = {"OK      ", "odd     ", "missing "};
  static_assert(std::size(kNames) == static_cast<std::size_t>(FindingLevel::kMissing) + 1);
  return kNames[static_cast<std::size_t>(level)];
}

void checkRecording(const Recording& recording, const CheckRequest& request, BagCheck* check) {
  if (recording.read < recording.length)
    check->ok("bag", "the first " + fixedText(recording.read, 0) + " of " + fixedText(recording.length, 0) +
                         " s were read (--duration)");
  if (recording.imus.empty()) {
    check->missing(
        "IMU",
        "the bag has no topic " + (request.imu_topic.empty() ? "" : request.imu_topic + " ") +
            "of type sensor_msgs/Imu; it has " + topicsText(recording.types),
        !request.imu_topic.empty() && hasType(recording, "sensor_msgs/Imu")
            ? "Choose a topic of that type which the bag has with --imu-topic, or leave the option out."
            : "Record the IMU, too: 100 Hz or more, with raw acceleration and angular velocity.");
    return;
  }
  const ImuInspection imu = chooseImu(recording, check);
  check->findings.insert(check->findings.end(), imu.findings.begin(), imu.findings.end());
  if (!imu.to_do.empty()) {
    check->to_do = imu.to_do;
    return;
  }
  std::vector<RadarInspection> radars;
  std::string to_do;
  for (const CloudTopic& cloud : recording.clouds) {
    RadarInspection radar = inspectRadar(recording, imu, cloud, request.set);
    check->findings.insert(check->findings.end(), radar.findings.begin(), radar.findings.end());
    if (to_do.find(radar.to_do) == std::string::npos) appendItem(&to_do, radar.to_do, " ");
    if (radar.usable) radars.push_back(std::move(radar));
  }
  if (radars.empty()) {
    if (recording.clouds.empty()) {
      missRadar(request.radar_topics, recording, check);
    } else {
      check->to_do =
          to_do.empty()
              ? "Use a radar driver that publishes positions and Doppler as sensor_msgs/PointCloud2."
              : to_do;
    }
    return;
  }
  // A radar works, so a cloud of another sensor is no reason to stop.
  for (Finding& finding : check->findings) {
    if (finding.level == FindingLevel::kMissing) finding.level = FindingLevel::kOdd;
  }
  for (const std::string& topic : request.radar_topics)
    if (!hasCloud(recording, topicOfBag(topic, recording.types))) missRadar({topic}, recording, check);
  leaveOutCopies(&radars, recording, check);
  for (const RadarInspection& radar : radars) {
    if (radar.search.enough) check->quality += 1.0 / radar.search.rotation_sigma.norm();
  }
  const ProposedConfig config = proposedConfig(imu, radars, request.set);
  if (request.try_out) {
    chooseByTrial(recording, header(recording), config, check);
    markMirrored(radars, check);
  } else {
    check->yaml = toYaml(config, header(recording));
    readBack(check->yaml);
  }
  const bool all_found = std::all_of(radars.begin(), radars.end(),
                                     [](const RadarInspection& each) { return each.search.enough; });
  if (!all_found && !isMountingConfigured(request.set) && check->to_do.empty())
    check->to_do =
        "The mounting is a guess. Record with motion for 3 s or more, or give it: --set "
        "mounting_yaw_pitch_roll_deg=[YAW,PITCH,ROLL] (docs/your_sensors.md, section 3).";
}

}  // namespace

BagCheck checkBag(const std::vector<std::string>& bags, const CheckRequest& request) {
  const Recording recording = readRecording(bags, request);
  BagCheck check;
  check.bags = recording.bags;
  const bool has_several_publishers = nameSeveralPublishers(recording, &check);
  checkRecording(recording, request, &check);
  if (has_several_publishers && !check.to_do.empty())
    check.to_do = "First give each publisher of a topic a topic of its own. " + check.to_do;
  return check;
}

std::string describeCheck(const BagCheck& check) {
  constexpr std::size_t kSubject = 11, kWidth = 118;
  std::string text = boost::algorithm::join(check.bags, "\n") + "\n";
  for (const Finding& finding : check.findings) {
    std::string line = "  " + levelText(finding.level) + finding.subject;
    line += std::string(finding.subject.size() < kSubject ? kSubject - finding.subject.size() : 1, ' ');
    text += line + wrapped(finding.text, std::string(2 + 8 + kSubject, ' '), kWidth) + "\n";
  }
  if (!check.to_do.empty()) text += "  To do: " + wrapped(check.to_do, std::string(9, ' '), kWidth) + "\n";
  return text;
}

}  // namespace rio_t
