#pragma once

#include <functional>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "rio_t/ros/bag/run_output.h"
#include "rio_t/ros/parameters/config.h"

namespace rio_t {

struct BagRun {
  std::vector<std::string> bags;  ///< paths; several bags are played as one, in the order of their records
  std::string output_folder;      ///< made if need be; empty: no files
  Config config;
  std::function<void(double)> progress;  ///< share of the bag done, 0 to 1; may be empty
};

/// A run that gave no result, with what its data show of the causes.
class RunFailed : public std::runtime_error {
 public:
  RunFailed(const std::string& what, Diagnosis diagnosis)
      : std::runtime_error(what), diagnosis_(std::move(diagnosis)) {}
  const Diagnosis& diagnosis() const { return diagnosis_; }

 private:
  Diagnosis diagnosis_;
};

/// Plays the bags through the estimator as fast as it goes, in one thread, so that the same bag gives the
/// same files. Needs no roscore. Throws std::runtime_error with one line that names the bag, topic, key or
/// file that is wrong: bag missing or unreadable, topic missing or of another type, cloud not as configured,
/// no data, output not writable; RunFailed: never initialised, every scan rejected.
RunSummary runBag(const BagRun& run);

/// A short table for people. `files` is the folder that it names.
std::string describeRun(const RunSummary& summary, const std::string& files);

/// The program rio_t_bag: `words` are its arguments. Returns the exit status; what went wrong is reported in
/// `err`.
int runBagTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err);

}  // namespace rio_t
