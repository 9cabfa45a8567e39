#pragma once

#include <cstddef>
#include <vector>

namespace rio_t {

/// First in, first out, in one piece of memory that is kept: a queue whose length stays about the same does
/// not allocate, which a std::deque does each time it has moved on by a chunk.
template <typename T>
class SlidingQueue {
 public:
  void push_back(const T& item) { items_.push_back(item); }
  /// Not on an empty queue.
  void pop_front() {
    ++first_;
    // What is left is moved to the front once it is no more than what went before it: O(1) on the mean.
    if (2 * first_ < items_.size()) return;
    items_.erase(items_.begin(), items_.begin() + static_cast<std::ptrdiff_t>(first_));
    first_ = 0;
  }
  void clear() {
    items_.clear();
    first_ = 0;
  }

  bool empty() const { return size() == 0; }
  std::size_t size() const { return items_.size() - first_; }
  const T& front() const { return items_[first_]; }
  const T& back() const { return items_.back(); }
  const T& operator[](std::size_t k) const { return items_[first_ + k]; }
  const T* begin() const { return items_.data() + first_; }
  const T* end() const { return items_.data() + items_.size(); }

 private:
  std::vector<T> items_;
  std::size_t first_ = 0;  ///< of items_ that are still in the queue
};

}  // namespace rio_t
