#include "rio_t/ros/live/bounded_trajectory.h"

#include <stdexcept>

namespace rio_t {

BoundedTrajectory::BoundedTrajectory(std::size_t capacity) : capacity_(capacity) {
  if (capacity < 2) throw std::invalid_argument("BoundedTrajectory: expected a capacity of at least 2");
  // At once: growing in steps leaves the heap with holes of megabytes. It is only used as poses come.
  kept_.reserve(capacity);
}

void BoundedTrajectory::add(const StampedPose& pose) {
  last_ = pose;
  if (!kept_.empty() && ++since_kept_ < stride_) return;
  if (kept_.size() == capacity_) {
    // The first pose stays; after it every second.
    std::size_t count = 0;
    for (std::size_t k = 0; k < kept_.size(); k += 2) kept_[count++] = kept_[k];
    // If the capacity is even, the newest went too, and this pose comes at the new stride. If it is odd, this
    // pose comes too early.
    const bool newest_stayed = kept_.size() % 2 == 1;
    kept_.resize(count);
    since_kept_ = newest_stayed ? stride_ : 0;
    stride_ *= 2;
    if (newest_stayed) return;
  }
  since_kept_ = 0;
  kept_.push_back(pose);
}

Trajectory BoundedTrajectory::poses() const {
  Trajectory all = kept_;
  if (since_kept_ > 0) all.push_back(last_);
  return all;
}

}  // namespace rio_t
