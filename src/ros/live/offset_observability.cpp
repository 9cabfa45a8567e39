#include "rio_t/ros/live/offset_observability.h"

namespace rio_t {

void OffsetObservability::add(const ScanResult& result) {
  const Time stamp = result.scan.stamp;
  if (result.used) samples_.push_back({stamp, result.offset_information});
  while (!samples_.empty() && stamp - samples_.front().stamp > kWindow) samples_.pop_front();
}

bool OffsetObservability::observable() const {
  double information = 0.0;
  for (const Sample& sample : samples_) information += sample.information;
  return information * kMaxSigma * kMaxSigma > 1.0;
}

}  // namespace rio_t
