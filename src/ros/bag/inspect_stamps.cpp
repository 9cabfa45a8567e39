#include "inspect_stamps.h"

#include <algorithm>
#include <boost/algorithm/string.hpp>
#include <cmath>
#include <exception>
#include <set>

#include "../text.h"
#include "bag_frames.h"

namespace rio_t {
namespace {

constexpr double kLargestDelay = 1.0;  // [s] from stamp to arrival of a scan; beyond, the clocks differ
constexpr double kAhead = 0.02;        // [s] from arrival to stamp; beyond, the clocks differ

std::string milliseconds(double seconds) { return fixedText(1e3 * seconds, 0) + " ms"; }

std::string secondsText(double seconds) { return fixedText(seconds, 1) + " s"; }

std::size_t sharedWords(const std::string& a, const std::string& b) {
  const auto words = [](const std::string& topic) {
    std::vector<std::string> parts;
    boost::algorithm::split(parts, topic, boost::algorithm::is_any_of("/_"));
    return std::set<std::string>(parts.begin(), parts.end());
  };
  const std::set<std::string> of_a = words(a), of_b = words(b);
  return static_cast<std::size_t>(std::count_if(
      of_a.begin(), of_a.end(), [&](const std::string& word) { return of_b.count(word) != 0; }));
}

/// Returns the header topic whose name shares the most words with that of the cloud; of equals, the one that
/// stamps more scans. It stamps eight scans in ten or more, and is at most `bound` ahead of its arrival.
const HeaderTopic* triggerOf(const Recording& recording, const std::vector<MessageTimes>& imu,
                             const CloudTopic& cloud, double bound) {
  const HeaderTopic* best = nullptr;
  std::size_t most = 0, shared = 0;
  const std::vector<RadarScan> empty(cloud.messages.size());
  for (const HeaderTopic& topic : recording.headers) {
    if (10 * topic.messages.size() < 8 * cloud.messages.size()) continue;
    const StreamTiming timing = inspectTiming(topic.times);
    if (!timing.stampsAreUsable()) continue;
    const std::optional<StreamDelay> delay = delayAgainstImu(topic.times, imu);
    if (delay && (delay->median > kLargestDelay || delay->median < -bound)) continue;
    StampingOptions options;
    options.source = StampSource::kTrigger;
    options.trigger_topic = topic.topic;
    const std::size_t stamped = stampScans(recording, imu, cloud, options, empty).size();
    const std::size_t words = sharedWords(topic.topic, cloud.topic);
    if (10 * stamped < 8 * cloud.messages.size()) continue;
    if (best != nullptr && (words < shared || (words == shared && stamped <= most))) continue;
    best = &topic;
    most = stamped;
    shared = words;
  }
  return best;
}

}  // namespace

StampProposal proposeStamps(const Recording& recording, const std::vector<MessageTimes>& imu,
                            const CloudTopic& cloud, const ParameterEntries& configured) {
  const Config known = makeConfig(configured);
  StampProposal proposal;
  StampingOptions& options = proposal.options;
  options.shift = known.radar_stamp_shift;
  if (isConfigured("stamp_source", configured)) {
    options.source = known.stamp_source;
    options.trigger_topic = topicOfBag(known.trigger_topic, recording.types);
    proposal.text = "as configured, stamp_source: " + toString(known.stamp_source);
    return proposal;
  }
  const StreamTiming timing = inspectTiming(cloud.times);
  const std::optional<StreamDelay> known_delay = delayAgainstImu(cloud.times, imu);
  StreamDelay delay = known_delay.value_or(StreamDelay());
  delay.median -= options.shift;
  delay.most -= options.shift;
  const double bound = known.odometry.smoother.max_time_offset;
  std::string fault;
  if (timing.zero == timing.messages) {
    fault = "the stamps in its headers are zero";
  } else if (timing.zero > 0) {
    fault = std::to_string(timing.zero) + " of its " + std::to_string(timing.messages) + " stamps are zero";
  } else if (timing.constant) {
    fault = "the stamps in its headers are all the same";
  } else if (!timing.stampsAreUsable()) {
    fault = std::to_string(timing.backwards) + " of its stamps run back";
  } else if (std::abs(delay.median) > kLargestDelay) {
    fault = "its stamps are on another clock than those of the IMU: " + secondsText(std::abs(delay.median)) +
            (delay.median > 0.0 ? " behind" : " ahead");
  } else if (delay.median < -bound) {
    fault = "its stamps are " + milliseconds(-delay.median) +
            " ahead of their arrival, and the offset estimate covers up to " + milliseconds(bound);
  }
  if (fault.empty()) {
    proposal.text = "stamps in the header; scans arrive " + milliseconds(delay.median) +
                    " after them (90 %: " + milliseconds(delay.most) + "), jitter " +
                    milliseconds(timing.jitter);
    if (!known_delay)
      proposal.odd.emplace_back(
          "scans and IMU were written one after the other, and rio_t reads a bag in the order of its "
          "records: write it again with a record time near the stamp of each message");
    if (delay.median < -kAhead)
      proposal.odd.push_back("the scans are stamped " + milliseconds(-delay.median) +
                             " ahead of their arrival; the offset estimate covers up to " +
                             milliseconds(bound));
    if (delay.median > bound)
      proposal.odd.push_back("the scans arrive " + milliseconds(delay.median) +
                             " after their stamps. If that is the clock of the radar and not its driver, the "
                             "offset estimate does not cover it: --set stamp_source=arrival");
    if (delay.most > kLargestDelay)
      proposal.odd.push_back("a tenth of the scans or more arrive " + secondsText(delay.most) +
                             " after their stamps: the clock of the radar jumps; stamp_source: arrival "
                             "ignores its stamps");
    return proposal;
  }
  if (const HeaderTopic* trigger = triggerOf(recording, imu, cloud, bound)) {
    options.source = StampSource::kTrigger;
    options.trigger_topic = trigger->topic;
    proposal.keys.set("stamp_source", "trigger", "The stamps of the clouds cannot be used: " + fault + ".");
    proposal.keys.set("trigger_topic", trigger->topic);
    proposal.text = "stamps of the trigger " + trigger->topic;
    proposal.odd.push_back(fault + "; stamp_source: trigger takes those of " + trigger->topic);
  } else {
    options.source = StampSource::kArrival;
    proposal.keys.set("stamp_source", "arrival",
                      "The stamps of the clouds cannot be used: " + fault +
                          ". The delay is part of the time offset, which is estimated.");
    proposal.text = "stamps from the arrival";
    proposal.odd.push_back(fault +
                           "; stamp_source: arrival is used, and the delay is estimated as the time offset");
  }
  return proposal;
}

std::vector<RadarScan> stampScans(const Recording& recording, const std::vector<MessageTimes>& imu,
                                  const CloudTopic& cloud, const StampingOptions& options,
                                  const std::vector<RadarScan>& scans) {
  ScanStamper stamper(options);
  const HeaderTopic* trigger = nullptr;
  for (const HeaderTopic& topic : recording.headers) {
    if (options.source == StampSource::kTrigger && topic.topic == options.trigger_topic) trigger = &topic;
  }
  const auto add = [](const auto& message) {
    try {
      message();
    } catch (const std::exception&) {  // a stamp of zero
    }
  };
  std::vector<RadarScan> stamped;
  std::size_t next_imu = 0, next_trigger = 0;
  for (std::size_t k = 0; k < scans.size(); ++k) {
    const Time record = cloud.times[k].record;
    for (; next_imu < imu.size() && imu[next_imu].record <= record; ++next_imu)
      stamper.addImu(imu[next_imu].stamp, imu[next_imu].record);
    for (; trigger != nullptr && next_trigger < trigger->messages.size() &&
           trigger->times[next_trigger].record <= record;
         ++next_trigger) {
      const MessageTimes& times = trigger->times[next_trigger];
      add([&] { stamper.addTrigger(trigger->messages[next_trigger].seq, times.stamp, times.record); });
    }
    add([&] { stamper.addScan(cloud.messages[k]->header.seq, cloud.times[k].stamp, record, scans[k]); });
    for (RadarScan& scan : stamper.take()) stamped.push_back(std::move(scan));
  }
  for (RadarScan& scan : stamper.finish()) stamped.push_back(std::move(scan));
  return stamped;
}

}  // namespace rio_t
