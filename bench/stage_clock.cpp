#include "stage_clock.h"

#include <ctime>
#include <iterator>

#include "count_allocations.h"

namespace rio_t::bench {
namespace {

double threadCpuSeconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

const char* name(Stage stage) {
  static constexpr const char* kNames[] = {
      "reading and the rest", "decode",      "ego-velocity",       "prediction",       "factors",  "solve",
      "covariance",           "marginalise", "navigation: anchor", "navigation: step", "pipeline", "output"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Stage::kCount));
  return kNames[static_cast<std::size_t>(stage)];
}

StageClock& StageClock::instance() {
  static StageClock clock;
  return clock;
}

StageClock::Scope::Scope(Stage stage) : stage_(stage), parent_(instance().current_) {
  instance().current_ = this;
  allocations_before_ = bench::allocations();
  if (stage_ == Stage::kSolve) cpu_before_ = threadCpuSeconds();
  start_ = std::chrono::steady_clock::now();
}

StageClock::Scope::~Scope() {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const std::uint64_t count = bench::allocations() - allocations_before_;
  StageClock& clock = instance();
  StageCost& cost = clock.costs_[static_cast<std::size_t>(stage_)];
  cost.seconds += seconds - seconds_within_;
  cost.allocations += count - allocations_within_;
  ++cost.calls;
  if (stage_ == Stage::kSolve && clock.solves_.size() < clock.solves_.capacity())
    clock.solves_.push_back(threadCpuSeconds() - cpu_before_);
  if (parent_ != nullptr) {
    parent_->seconds_within_ += seconds;
    parent_->allocations_within_ += count;
  }
  clock.current_ = parent_;
}

}  // namespace rio_t::bench
