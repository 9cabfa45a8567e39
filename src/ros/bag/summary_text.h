#pragma once

#include <string>
#include <vector>

#include "rio_t/ros/bag/run_output.h"

namespace rio_t {

/// The text of summary.yaml. `saved`: the files of the run.
std::string summaryText(const RunSummary& summary, const std::vector<std::string>& saved);

}  // namespace rio_t
