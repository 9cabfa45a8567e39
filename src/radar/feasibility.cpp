#include "rio_t/radar/feasibility.h"

namespace rio_t {

bool FeasibilityCheck::accept(Time stamp, const Eigen::Vector3d& v_R) {
  if (!v_R.allFinite()) return false;
  // If the stamps run back (a bag that loops), the average starts again.
  if (!accepted_.empty() && stamp < accepted_.back().stamp) accepted_.clear();
  while (!accepted_.empty() && stamp - accepted_.front().stamp > options_.window) accepted_.pop_front();

  if (!accepted_.empty()) {
    Eigen::Vector3d mean_v = Eigen::Vector3d::Zero();
    double mean_age = 0.0;
    for (const Entry& entry : accepted_) {
      mean_v += entry.v_R;
      mean_age += stamp - entry.stamp;
    }
    const auto n = static_cast<double>(accepted_.size());
    const double allowed = options_.margin + options_.max_acceleration * mean_age / n;
    if ((v_R - mean_v / n).norm() > allowed) return false;
  }
  accepted_.push_back({stamp, v_R});
  return true;
}

}  // namespace rio_t
