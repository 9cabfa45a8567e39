#pragma once

#include <cstddef>

#include "rio_t/evaluation/trajectory.h"

namespace rio_t {

/// A trajectory of bounded memory that always reaches from the first pose to the last: once `capacity` poses
/// are kept, every second one goes, and from then on only every second (fourth, ...) is kept.
class BoundedTrajectory {
 public:
  /// `capacity` must be at least 2; throws std::invalid_argument.
  explicit BoundedTrajectory(std::size_t capacity);

  void add(const StampedPose& pose);
  /// The poses kept, and the last one added in any case.
  Trajectory poses() const;
  /// One pose in so many is kept: 1, 2, 4, ...
  std::size_t stride() const { return stride_; }

 private:
  bool lastIsKept() const { return (count_ - 1) % stride_ == 0; }

  std::size_t capacity_;  // read-only after construction
  Trajectory kept_;
  std::size_t stride_ = 1;
  std::size_t count_ = 0;  ///< poses added
  StampedPose last_;
};

}  // namespace rio_t
