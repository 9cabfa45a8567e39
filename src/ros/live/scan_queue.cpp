#include "rio_t/ros/live/scan_queue.h"

#include <stdexcept>
#include <utility>

namespace rio_t {

ScanQueue::ScanQueue(std::size_t capacity) : capacity_(capacity) {
  if (capacity == 0) throw std::invalid_argument("ScanQueue: capacity 0, expected at least 1");
}

std::optional<RadarScan> ScanQueue::push(Item item) {
  const std::lock_guard<std::mutex> lock(mutex_);
  items_.push_back(std::move(item));
  if (items_.size() <= capacity_) return std::nullopt;
  RadarScan dropped = std::move(items_.front().scan);
  items_.pop_front();
  return dropped;
}

std::optional<ScanQueue::Item> ScanQueue::pop() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (items_.empty()) return std::nullopt;
  Item item = std::move(items_.front());
  items_.pop_front();
  return item;
}

std::size_t ScanQueue::size() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return items_.size();
}

}  // namespace rio_t
