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

/// runBag throws this if the odometry never starts or rejects every scan. The diagnosis has the likely
/// causes.
class RunFailed : public std::runtime_error {
 public:
  RunFailed(const std::string& what, Diagnosis diagnosis)
      : std::runtime_error(what), diagnosis_(std::move(diagnosis)) {}
  const Diagnosis& diagnosis() const { return diagnosis_; }

 private:
  Diagnosis diagnosis_;
};

/// Plays the bags through the estimator as fast as the computer can, in one thread, so that the same bag
/// gives the same files. Needs no roscore. Throws RunFailed, or std::runtime_error with one line that names
/// the wrong bag, topic, key or file: bag missing or unreadable, topic missing or of another type, cloud not
/// as configured, no data, output not writable.
RunSummary runBag(const BagRun& run);

/// Returns the summary as a short table. `files`: the output folder, which the table names.
std::string describeRun(const RunSummary& summary, const std::string& files);

/// The program rio_t_bag: `words` are its arguments. Returns the exit status; what went wrong is reported in
/// `err`.
int runBagTool(const std::vector<std::string>& words, std::ostream& out, std::ostream& err);

}  // namespace rio_t
