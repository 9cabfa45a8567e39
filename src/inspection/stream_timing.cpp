#include "rio_t/inspection/stream_timing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "rio_t/core/quantile.h"

namespace rio_t {

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
  const double median = quantile(intervals, 0.5);
  timing.rate = median > 0.0 ? 1.0 / median : 0.0;
  timing.jitter = 0.5 * (quantile(intervals, 5.0 / 6.0) - quantile(intervals, 1.0 / 6.0));
  for (const double interval : intervals) {
    if (interval < kGapFactor * median || interval < kLeastGap) continue;
    ++timing.gaps;
    timing.longest_gap = std::max(timing.longest_gap, interval);
  }
  return timing;
}

StreamDelay delayAgainstImu(const std::vector<MessageTimes>& times, const std::vector<MessageTimes>& imu) {
  std::int64_t smallest = std::numeric_limits<std::int64_t>::max();
  for (const MessageTimes& each : imu)
    smallest = std::min(smallest, each.record.nanoseconds() - each.stamp.nanoseconds());
  std::vector<double> delays;
  delays.reserve(times.size());
  for (const MessageTimes& each : times)
    delays.push_back(Time::fromNanoseconds(each.record.nanoseconds() - smallest) - each.stamp);
  return {quantile(delays, 0.5), quantile(delays, 0.9)};
}

}  // namespace rio_t
