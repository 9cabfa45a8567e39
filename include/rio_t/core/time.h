#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace rio_t {

/// A point in time of the IMU clock, in whole nanoseconds since the epoch of that clock.
///
/// Nanoseconds, not double seconds: at a Unix epoch a double resolves 0.24 us, so a stamp would not survive
/// the way from message to estimate and back unchanged. Differences are double seconds.
class Time {
 public:
  constexpr Time() = default;
  static constexpr Time fromNanoseconds(std::int64_t ns) { return Time(ns); }
  /// Rounds to the nearest nanosecond. `s` must lie within +-9.2e9.
  static Time fromSeconds(double s) { return Time(static_cast<std::int64_t>(std::llround(s * 1e9))); }

  constexpr std::int64_t nanoseconds() const { return ns_; }
  constexpr double seconds() const { return static_cast<double>(ns_) * 1e-9; }

  /// Seconds from `b` to `a`.
  friend constexpr double operator-(Time a, Time b) { return static_cast<double>(a.ns_ - b.ns_) * 1e-9; }
  friend Time operator+(Time a, double s) { return Time(a.ns_ + std::llround(s * 1e9)); }
  friend Time operator-(Time a, double s) { return a + (-s); }
  friend constexpr bool operator==(Time a, Time b) { return a.ns_ == b.ns_; }
  friend constexpr bool operator!=(Time a, Time b) { return a.ns_ != b.ns_; }
  friend constexpr bool operator<(Time a, Time b) { return a.ns_ < b.ns_; }
  friend constexpr bool operator<=(Time a, Time b) { return a.ns_ <= b.ns_; }
  friend constexpr bool operator>(Time a, Time b) { return a.ns_ > b.ns_; }
  friend constexpr bool operator>=(Time a, Time b) { return a.ns_ >= b.ns_; }

 private:
  explicit constexpr Time(std::int64_t ns) : ns_(ns) {}
  std::int64_t ns_ = 0;
};

/// Factor by which an exponentially fading sum with the time constant `memory` [s] decays from `last` to
/// `now`. It is 1 for data that come late, and never zero.
inline double fading(Time last, Time now, double memory) {
  return std::exp(-std::clamp(now - last, 0.0, 10.0 * memory) / memory);
}

}  // namespace rio_t
