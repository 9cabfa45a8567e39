#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/diagnosis/run_evidence.h"

namespace rio_t {

enum class RunVerdict {
  kGood,      ///< nothing speaks against it
  kDoubtful,  ///< look at the causes
  kBad,       ///< it never started, used no scan, was silent or diverged: do not trust it
};
std::string toString(RunVerdict verdict);  ///< "good", "doubtful", "bad"

/// [sigma] An estimated mounting is far from the configured one if it is turned by more than this about an
/// axis. The sigma is `extrinsics_rotation_sigma`; if it is right, this happens to one radar in 120.
constexpr double kFarMounting = 3.0;

/// [sigma] The scale of the Doppler counts as wrong beyond this.
constexpr double kWrongScale = 3.0;

/// [sigma] A time offset that is held counts as wrong beyond this.
constexpr double kWrongOffset = 3.0;

/// [sigma] A lever arm that is held counts as wrong beyond this. Noise brings its three numbers there as
/// seldom as it brings one number to three sigma (chi-squared).
constexpr double kWrongLeverArm = 3.77;

/// A run is doubtful if the estimate diverged for more than this share of its scans.
constexpr double kManyDiverged = 0.1;

struct Cause {
  std::string name;                  ///< in snake case: "points_too_weak"
  std::string text;                  ///< a sentence with the numbers that show it
  std::string remedy;                ///< a sentence with the key to change
  double share = 0.0;                ///< 0 to 1: how much of the evidence it explains
  bool remedy_is_check_bag = false;  ///< the remedy sends the user to check_bag, for the mounting
};

struct Check {
  std::string name;  ///< in snake case: "scans_used_share"
  double value = 0.0;
  double limit = 0.0;
  bool at_least = true;  ///< the value must be at least the limit; false: at most
  bool good() const { return at_least ? value >= limit : value <= limit; }
};

struct Diagnosis {
  RunVerdict verdict = RunVerdict::kGood;
  std::vector<Check> checks;  ///< in a good run, all of them are good
  std::vector<Cause> causes;  ///< at most three, the likeliest first; a good run has none
};

/// Judges a run, and finds the likely causes of its trouble. The run may have ended or still go on.
Diagnosis diagnose(const RunEvidence& evidence, const Config& config);

/// Says where the trajectory starts again: at the first of `restarts`, and how many follow. `restarts` must
/// not be empty.
std::string describeRestarts(const std::vector<ImuRestart>& restarts, const Config& config);

/// Says why samples were dropped: "1227 were not finite, ...".
std::string describeDropped(const Counts& dropped);

/// "NAME is VALUE, expected at least LIMIT"
std::string describe(const Check& check);

/// A line for each cause or, if there is none, for each check that is not good.
std::string describeCauses(const Diagnosis& diagnosis);

}  // namespace rio_t
