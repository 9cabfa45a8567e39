#include "rio_t/inspection/stream_timing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rio_t/core/quantile.h"

namespace rio_t {
namespace {

/// [s] The clock of the records may drift over a bag, but hardly within this.
constexpr double kRecordedNear = 0.5;
/// The last IMU messages before a scan are compared with it. A bus may hand over several at once, the newest
/// last. With more of them, a scan would be compared with samples of another time.
constexpr std::size_t kCompared = 8;

/// Sets rate and burst, and returns true, if the intervals show bursts.
bool findBursts(const std::vector<double>& intervals, double median, double factor, StreamTiming* timing) {
  constexpr std::size_t kEnoughBursts = 10;
  constexpr double kMostOfTheTime = 0.8, kLeastBurst = 2.5;
  std::vector<double> between;
  double span = 0.0, pauses = 0.0;
  for (const double interval : intervals) {
    span += interval;
    if (interval < factor * median) continue;
    pauses += interval;
    between.push_back(interval);
  }
  const double size =
      static_cast<double>(intervals.size()) / static_cast<double>(std::max<std::size_t>(1, between.size()));
  if (between.size() < kEnoughBursts || pauses < kMostOfTheTime * span || size < kLeastBurst) return false;
  timing->rate = static_cast<double>(intervals.size()) / span;
  timing->burst = size;
  timing->burst_period = span / static_cast<double>(between.size());
  return true;
}

}  // namespace

StreamTiming inspectTiming(const std::vector<MessageTimes>& times) {
  constexpr double kGapFactor = 3.5;
  constexpr double kLeastGap = 0.02;  // [s]
  StreamTiming timing;
  timing.messages = times.size();
  if (times.empty()) return timing;
  std::vector<double> intervals, record_intervals;
  std::size_t same_as_first = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    if (times[i].stamp == Time()) ++timing.zero;
    if (times[i].stamp == times.front().stamp) ++same_as_first;
    if (i == 0) continue;
    const double interval = times[i].stamp - times[i - 1].stamp;
    record_intervals.push_back(times[i].record - times[i - 1].record);
    if (times[i].stamp == Time() || times[i - 1].stamp == Time()) continue;
    if (interval == 0.0) ++timing.duplicates;
    if (interval < 0.0) ++timing.backwards;
    if (interval > 0.0) intervals.push_back(interval);
  }
  timing.constant = times.size() > 2 && same_as_first == times.size() && timing.zero == 0;
  if (timing.zero > 0 || timing.constant || intervals.empty()) intervals = record_intervals;
  double median = quantile(intervals, 0.5);
  timing.rate = median > 0.0 ? 1.0 / median : 0.0;
  timing.jitter = 0.5 * (quantile(intervals, 5.0 / 6.0) - quantile(intervals, 1.0 / 6.0));
  if (findBursts(intervals, median, kGapFactor, &timing)) median = timing.burst_period;
  for (const double interval : intervals) {
    if (interval < kGapFactor * median || interval < kLeastGap) continue;
    ++timing.gaps;
    timing.longest_gap = std::max(timing.longest_gap, interval);
  }
  return timing;
}

std::optional<StreamDelay> delayAgainstImu(const std::vector<MessageTimes>& times,
                                           const std::vector<MessageTimes>& imu) {
  std::vector<double> delays;
  std::size_t recorded = 0;
  for (const MessageTimes& each : times) {
    const std::size_t before = recorded;
    while (recorded < imu.size() && imu[recorded].record <= each.record) ++recorded;
    if (recorded == before || each.record - imu[recorded - 1].record > kRecordedNear) continue;
    std::int64_t smallest = std::numeric_limits<std::int64_t>::max();
    for (std::size_t i = recorded - std::min(recorded, kCompared); i < recorded; ++i)
      smallest = std::min(smallest, imu[i].record.nanoseconds() - imu[i].stamp.nanoseconds());
    delays.push_back(Time::fromNanoseconds(each.record.nanoseconds() - smallest) - each.stamp);
  }
  // The topics were recorded one after the other, so the record times show nothing.
  if (10 * delays.size() < times.size()) return std::nullopt;
  return StreamDelay{quantile(delays, 0.5), quantile(delays, 0.9)};
}

}  // namespace rio_t
