#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace rio_t {

/// Counts faults of the input by name. Thread-safe.
class FaultCounters {
 public:
  void count(const std::string& name) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_[name];
  }
  std::map<std::string, std::uint64_t> get() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return counts_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> counts_;  // guarded by mutex_
};

}  // namespace rio_t
