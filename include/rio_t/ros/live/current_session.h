#pragma once

#include <array>
#include <memory>
#include <mutex>

#include "rio_t/ros/live/session.h"

namespace rio_t {

/// Which session of the live node is the current one, and the promise that nothing of an old one is said once
/// it has been replaced. Thread-safe.
class CurrentSession {
 public:
  using Session = std::shared_ptr<LiveSession>;
  /// Who publishes. Each has a lock of its own, so that neither waits for the other.
  enum class Speaker { kNavigation, kOptimisation };

  /// Null before there is one.
  Session get() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return session_;
  }

  /// Waits for those who are speaking; after it no one speaks for the old session, which is returned. Not to
  /// be called by a speaker while it speaks.
  Session replace(Session fresh) {
    const std::scoped_lock lock(speaking_[0], speaking_[1], mutex_);
    std::swap(session_, fresh);
    return fresh;
  }

  /// Calls say() if `session` still is the current one, which it then stays until say() returns; else false.
  template <typename Say>
  bool speak(Speaker speaker, const Session& session, Say&& say) {
    const std::lock_guard<std::mutex> lock(speaking_[static_cast<std::size_t>(speaker)]);
    if (get() != session) return false;
    say();
    return true;
  }

 private:
  std::array<std::mutex, 2> speaking_;  // by Speaker
  mutable std::mutex mutex_;            // held for nanoseconds
  Session session_;                     // guarded by mutex_; changes with both of speaking_ held too
};

}  // namespace rio_t
