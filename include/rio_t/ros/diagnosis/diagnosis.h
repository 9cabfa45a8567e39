#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/diagnosis/run_evidence.h"

namespace rio_t {

/// Whether a run is good.
enum class RunVerdict {
  kGood,      ///< nothing speaks against it
  kDoubtful,  ///< look at the causes
  kBad,       ///< it never started, used no scan, was silent or diverged: do not trust it
};
std::string toString(RunVerdict verdict);  ///< "good", "doubtful", "bad"

/// An estimated mounting is far from the configured one if it is turned by more than so many
/// `extrinsics_rotation_sigma` about an axis. If that sigma is right, one radar in 120 is.
constexpr double kFarMounting = 3.0;

/// The scale of the Doppler is wrong if it is off by more sigmas.
constexpr double kWrongScale = 3.0;

/// A time offset that is held is wrong if it is off by more sigmas.
constexpr double kWrongOffset = 3.0;

/// A lever arm that is held is wrong if it is off by more sigmas. Noise brings three numbers there as seldom
/// as one number to three sigma (chi-squared).
constexpr double kWrongLeverArm = 3.77;

/// A run is doubtful if the estimate diverged for a larger share of its scans.
constexpr double kManyDiverged = 0.1;

/// A likely cause of trouble.
struct Cause {
  std::string name;                  ///< in snake case: "points_too_weak"
  std::string text;                  ///< a sentence with the numbers that point there
  std::string remedy;                ///< a sentence with the key to change
  double share = 0.0;                ///< 0 to 1: how much of the evidence it explains
  bool remedy_is_check_bag = false;  ///< the remedy sends the user to check_bag, for the mounting
};

/// A number that is red or green.
struct Check {
  std::string name;  ///< in snake case: "scans_used_share"
  double value = 0.0;
  double limit = 0.0;
  bool at_least = true;  ///< the value must be at least the limit; false: at most
  bool good() const { return at_least ? value >= limit : value <= limit; }
};

struct Diagnosis {
  RunVerdict verdict = RunVerdict::kGood;
  std::vector<Check> checks;  ///< all of a good run are good
  std::vector<Cause> causes;  ///< at most three, the likeliest first; none of a good run
};

/// Why a run disappoints, or that it does not. It works on a run that ended and on one that goes on.
Diagnosis diagnose(const RunEvidence& evidence, const Config& config);

/// Says where the trajectory starts again: the first of the restarts, and how many follow. `restarts` must
/// not be empty.
std::string describeRestarts(const std::vector<ImuRestart>& restarts, const Config& config);

/// Says why the samples of a gap were dropped: "1227 were not finite, ...".
std::string describeDropped(const Counts& dropped);

/// "NAME is VALUE, expected at least LIMIT"
std::string describe(const Check& check);

/// A line for each cause or, if there is none, for each check that is not good.
std::string describeCauses(const Diagnosis& diagnosis);

}  // namespace rio_t
