#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace rio_t::bench {

/// What the time of a run is spent on. `kRest` is what no other has: reading the bag, mostly.
enum class Stage {
  kRest,
  kDecode,
  kEgoVelocity,
  kPrediction,
  kFactors,
  kSolve,
  kCovariance,
  kMarginalise,
  kAnchor,
  kNavigation,
  kPipeline,
  kOutput,
  kCount
};
const char* name(Stage stage);

/// What one stage took by itself, without the stages within it.
struct StageCost {
  double seconds = 0.0;
  std::uint64_t calls = 0;
  std::uint64_t allocations = 0;
};

/// Accounts of the stages of this process; one thread only.
class StageClock {
 public:
  static StageClock& instance();

  const StageCost& cost(Stage stage) const { return costs_[static_cast<std::size_t>(stage)]; }
  /// CPU time of each call of Stage::kSolve [s], the stages within it included: of the thread, so that the
  /// quantiles are not those of whatever else the machine does.
  const std::vector<double>& solves() const { return solves_; }

  /// Times a stage from here to the end of the block.
  class Scope {
   public:
    explicit Scope(Stage stage);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    Stage stage_;
    Scope* parent_;
    double seconds_within_ = 0.0;
    std::uint64_t allocations_within_ = 0;
    std::uint64_t allocations_before_;
    double cpu_before_ = 0.0;  ///< [s] of the thread; of Stage::kSolve only, it costs a system call
    std::chrono::steady_clock::time_point start_;
  };

 private:
  StageClock() { solves_.reserve(1 << 20); }

  std::array<StageCost, static_cast<std::size_t>(Stage::kCount)> costs_;
  std::vector<double> solves_;
  Scope* current_ = nullptr;
};

}  // namespace rio_t::bench
