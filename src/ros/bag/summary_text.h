#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/bag/run_output.h"

namespace rio_t {

/// The text of summary.yaml. `saved`: the files of the run.
std::string summaryText(const RunSummary& summary, const std::vector<std::string>& saved);

/// "_left"; empty if there is but one radar.
std::string suffixOf(const std::string& radar);

}  // namespace rio_t
