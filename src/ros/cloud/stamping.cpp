#include "rio_t/ros/cloud/stamping.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

#include "rio_t/core/quantile.h"

namespace rio_t {
namespace {

constexpr std::size_t kTriggersKept = 64;  // some seconds of them
// One scan without a trigger of its seq means a lost trigger. So many in a row mean that triggers and scans
// count from different starts.
constexpr std::size_t kUnmatchedMeansUnlike = 5;
constexpr double kClockMapSpan = 60.0;  // [s]
// No transport delays so many IMU samples by more than this. If one did, it would delay the scans as well.
constexpr std::int64_t kJump_ns = 500'000'000;
constexpr int kJumpSamples = 20;
// A message holds no later stamp: its seconds have 32 bits.
constexpr Time kNewestStamp =
    Time::fromNanoseconds(std::int64_t{1'000'000'000} * std::numeric_limits<std::uint32_t>::max());

}  // namespace

void ClockMap::add(Time stamp, Time record) {
  const std::int64_t difference = record.nanoseconds() - stamp.nanoseconds();
  if (smallest_ns_ != kNothing) {
    far_above_ = difference - std::min(smallest_ns_, smallest_before_ns_) > kJump_ns ? far_above_ + 1 : 0;
    if (far_above_ >= kJumpSamples) *this = ClockMap();
  }
  if (smallest_ns_ == kNothing) {
    minute_begin_ = stamp;
  } else if (std::abs(stamp - minute_begin_) > kClockMapSpan) {
    smallest_before_ns_ = smallest_ns_;
    smallest_ns_ = kNothing;
    minute_begin_ = stamp;
  }
  smallest_ns_ = std::min(smallest_ns_, difference);
}

std::optional<Time> ClockMap::toImuClock(Time record) const {
  if (smallest_ns_ == kNothing) return std::nullopt;
  return Time::fromNanoseconds(record.nanoseconds() - std::min(smallest_ns_, smallest_before_ns_));
}

StampingOptions stampingOptions(const Config& config) {
  StampingOptions options;
  options.source = config.stamp_source;
  options.shift = config.radar_stamp_shift;
  options.radar_topic = config.radar_topic;
  options.trigger_topic = config.trigger_topic;
  return options;
}

ScanStamper::ScanStamper(StampingOptions options) : options_(std::move(options)) {}

void ScanStamper::advanceTo(Time record) {
  if (!first_record_) first_record_ = now_ = record;
  now_ = std::max(now_, record);
}

void ScanStamper::followStepBack(Time record) {
  const double step = record - *newest_imu_record_;
  const auto shift = [&](auto& each) {
    if (each.record - record > kMaxDelay) each.record = each.record + step;
  };
  for (Held& scan : held_) shift(scan);
  for (Trigger& trigger : triggers_) shift(trigger);
  if (first_record_) first_record_ = *first_record_ + step;
  now_ = record;
}

void ScanStamper::addImu(Time stamp, Time record) {
  // The samples of the IMU keep their order, so an earlier record means that the clock stepped back. Scans
  // and triggers may be handed over late.
  if (newest_imu_record_ && record - *newest_imu_record_ < -kMaxDelay) followStepBack(record);
  newest_imu_record_ = record;
  advanceTo(record);
  clocks_.add(stamp, record);
}

void ScanStamper::addTrigger(std::uint32_t seq, Time stamp, Time record) {
  advanceTo(record);
  if (stamp == Time()) {
    throw std::runtime_error("topic " + options_.trigger_topic +
                             " (trigger_topic): the stamp in the header is zero; stamp_source: trigger needs "
                             "one. Correct the driver, or set stamp_source to header or to arrival");
  }
  if (!triggers_.empty() && triggers_.back().seq == seq && triggers_.back().stamp == stamp)
    return;  // sent twice
  triggers_.push_back({seq, stamp, record, false});
  if (triggers_.size() > kTriggersKept) triggers_.pop_front();
}

void ScanStamper::addScan(std::uint32_t seq, Time header_stamp, Time record, RadarScan scan) {
  advanceTo(record);
  if (options_.source == StampSource::kHeader && header_stamp == Time()) {
    throw std::runtime_error(
        "topic " + options_.radar_topic +
        ": the stamp in the header is zero; stamp_source: header needs one. Set stamp_source to "
        "trigger (with trigger_topic) or to arrival");
  }
  held_.push_back({seq, header_stamp, record, std::move(scan)});
  if (held_.size() > kMaxHeld) giveUp("too_many_held");
}

void ScanStamper::giveUp(const std::string& reason) {
  held_.pop_front();
  ++given_up_[reason];
}

std::vector<RadarScan> ScanStamper::take() {
  std::vector<RadarScan> stamped;
  while (!held_.empty()) {
    Time stamp;
    const Decision decision = stampFront(&stamp);
    if (decision == Decision::kWait) break;
    if (decision == Decision::kGiveUp) {
      giveUp(options_.source == StampSource::kTrigger ? "trigger_missing" : "imu_missing");
      continue;
    }
    stamp = stamp + options_.shift;
    if (stamp < Time() || stamp > kNewestStamp) {
      giveUp("stamp_out_of_range");
      continue;
    }
    stamped.push_back(std::move(held_.front().scan));
    stamped.back().stamp = stamp;
    held_.pop_front();
  }
  return stamped;
}

std::vector<RadarScan> ScanStamper::finish() {
  finishing_ = true;
  std::vector<RadarScan> stamped = take();
  finishing_ = false;
  return stamped;
}

ScanStamper::Decision ScanStamper::stampFront(Time* stamp) {
  const Held& scan = held_.front();
  if (options_.source == StampSource::kTrigger) return stampFromTrigger(scan, stamp);
  const std::optional<Time> found =
      options_.source == StampSource::kHeader ? scan.header_stamp : clocks_.toImuClock(scan.record);
  if (!found) return finishing_ ? Decision::kGiveUp : Decision::kWait;
  *stamp = *found;
  return Decision::kStamped;
}

ScanStamper::Trigger* ScanStamper::triggerOfSeq(const Held& scan) {
  Trigger* found = nullptr;
  // A busy machine delivers the topics in any order. Once triggers and scans are known to count alike, the
  // seq is enough.
  const double overtake = counting_ == Counting::kAlike ? kMaxDelay : kMaxOvertake;
  for (Trigger& trigger : triggers_) {
    const double delay = scan.record - trigger.record;
    if (trigger.seq != scan.seq || delay < -overtake || delay > kMaxDelay) continue;
    if (found != nullptr) {  // a seq that does not count, e.g. always zero
      counting_ = Counting::kUnlike;
      return nullptr;
    }
    found = &trigger;
  }
  return found;
}

ScanStamper::Decision ScanStamper::stampFromTrigger(const Held& scan, Time* stamp) {
  if (Trigger* trigger = triggerOfSeq(scan)) {
    counting_ = Counting::kAlike;
    unmatched_ = 0;
    if (trigger->used) return Decision::kGiveUp;
    trigger->used = true;
    *stamp = trigger->stamp;
    return Decision::kStamped;
  }
  if (counting_ != Counting::kUnlike) {
    // The threads of a busy node may hand over IMU, scan and trigger in another order than they came.
    // Triggers keep their order, so a later trigger shows that the one of this scan will not come.
    const bool later_came = !triggers_.empty() && triggers_.back().seq > scan.seq;
    const double patience = later_came ? kMaxOvertake : kMaxDelay;
    if (!finishing_ && now_ - scan.record <= patience) return Decision::kWait;
    if (counting_ == Counting::kAlike && ++unmatched_ < kUnmatchedMeansUnlike) return Decision::kGiveUp;
    if (counting_ == Counting::kUnknown && !finishing_) {
      // The trigger may have been sent before the first message, so its absence does not show how they count.
      // A later scan does.
      const bool later_matches = std::any_of(
          held_.begin() + 1, held_.end(), [&](const Held& later) { return triggerOfSeq(later) != nullptr; });
      if (later_matches) return Decision::kGiveUp;
      if (now_ - *first_record_ <= kMaxDelay + kMaxOvertake) return Decision::kWait;
    }
    counting_ = Counting::kUnlike;
  }
  return stampFromTriggerTime(scan, stamp);
}

std::optional<double> ScanStamper::triggerPeriod() const {
  if (triggers_.size() < 2) return std::nullopt;
  std::vector<double> steps;
  for (std::size_t i = 1; i < triggers_.size(); ++i) {
    steps.push_back(triggers_[i].stamp - triggers_[i - 1].stamp);
  }
  return quantile(std::move(steps), 0.5);
}

ScanStamper::Decision ScanStamper::stampFromTriggerTime(const Held& scan, Time* stamp) {
  Trigger* best = nullptr;
  if (scan.header_stamp == Time()) {
    for (Trigger& trigger : triggers_) {
      const double delay = scan.record - trigger.record;
      if (delay >= 0.0 && delay <= kMaxDelay) best = &trigger;
    }
  } else {
    const auto distance = [&](const Trigger& trigger) { return std::abs(trigger.stamp - scan.header_stamp); };
    for (Trigger& trigger : triggers_) {
      if (best == nullptr || distance(trigger) < distance(*best)) best = &trigger;
    }
    const std::optional<double> period = triggerPeriod();
    const bool waited = finishing_ || now_ - scan.record > kMaxDelay;
    if (!period && !waited) return Decision::kWait;
    if (best != nullptr && period && distance(*best) > 0.5 * *period) {
      const bool later_seen = triggers_.back().stamp > scan.header_stamp;
      if (!later_seen && !waited) return Decision::kWait;
      best = nullptr;
    }
    if (!period) best = nullptr;
  }
  if (best == nullptr || best->used) return Decision::kGiveUp;
  best->used = true;
  *stamp = best->stamp;
  return Decision::kStamped;
}

}  // namespace rio_t
