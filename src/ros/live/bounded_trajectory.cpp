#include "rio_t/ros/live/bounded_trajectory.h"

#include <stdexcept>

namespace rio_t {

BoundedTrajectory::BoundedTrajectory(std::size_t capacity) : capacity_(capacity) {
  if (capacity < 2) throw std::invalid_argument("BoundedTrajectory: expected a capacity of at least 2");
}

void BoundedTrajectory::add(const StampedPose& pose) {
  last_ = pose;
  if (count_++ % stride_ != 0) return;
  if (kept_.size() == capacity_) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < kept_.size(); k += 2) kept_[kept++] = kept_[k];
    kept_.resize(kept);
    stride_ *= 2;
  }
  if (lastIsKept()) kept_.push_back(pose);
}

Trajectory BoundedTrajectory::poses() const {
  Trajectory all = kept_;
  if (count_ > 0 && !lastIsKept()) all.push_back(last_);
  return all;
}

}  // namespace rio_t
