#pragma once

#include <chrono>
#include <deque>
#include <mutex>
#include <optional>

#include "rio_t/radar/scan.h"

namespace rio_t {

/// Scans on their way to the optimisation thread. Bounded: where the solver falls behind, the oldest goes,
/// and whoever pushed is told. Thread-safe.
class ScanQueue {
 public:
  struct Item {
    RadarScan scan;
    std::chrono::steady_clock::time_point arrival;
  };

  /// `capacity` must be at least 1; throws std::invalid_argument.
  explicit ScanQueue(std::size_t capacity);

  /// The oldest scan if it had to make room.
  std::optional<RadarScan> push(Item item);
  std::optional<Item> pop();
  std::size_t size() const;

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::deque<Item> items_;  // guarded by mutex_; oldest first
};

}  // namespace rio_t
