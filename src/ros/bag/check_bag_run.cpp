#include <algorithm>
#include <boost/algorithm/string/replace.hpp>
#include <boost/process.hpp>
#include <filesystem>
#include <optional>
#include <ostream>
#include <stdexcept>
#include <utility>

#include "../command_line.h"
#include "../temporary_folder.h"
#include "rio_t/ros/bag/check_bag.h"
#include "rio_t/ros/parameters/parameters.h"

namespace rio_t {
namespace {

namespace fs = std::filesystem;

/// The script is beside the program, in an installed package and in a build folder.
std::string drawRigScript() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path script = program.parent_path() / "draw_rig.py";
  return !error && fs::is_regular_file(script) ? script.string() : "";
}

void drawRig(const std::string& yaml, const std::string& png) {
  const std::string script = drawRigScript();
  if (script.empty()) throw std::runtime_error("--rig: the script draw_rig.py is not installed");
  namespace process = boost::process;
  if (process::system("/usr/bin/env", "python3", script, "--config", yaml, "--out", png) != 0)
    throw std::runtime_error("--rig " + png + ": draw_rig.py failed");
}

/// Quotes a path for a shell if it needs quotes.
std::string quoted(const std::string& path) {
  const std::string special = " \t'\"\\$`~*?[](){}<>|&;#!";
  return path.find_first_of(special) == std::string::npos
             ? path
             : "'" + boost::algorithm::replace_all_copy(path, "'", "'\\''") + "'";
}

}  // namespace

void validate(const CheckRequest& request) {
  require({{"BAG", !request.bags.empty()}});
  for (const ParameterEntry& entry : request.set) {
    if (entry.key == "imu_topic" || entry.key == "radar_topic")
      throw UsageError("--set " + entry.key + ": expected --" +
                       boost::algorithm::replace_all_copy(entry.key, "_", "-") + ", which chooses the topic");
    if (entry.key == "radars" || entry.key.find('/') != std::string::npos)
      throw UsageError("--set " + entry.key +
                       ": expected a key of every radar, since the bag names the radars; --radar-topic looks "
                       "at one alone");
  }
  makeConfig(request.set);
  for (const auto& [name, file] :
       {std::make_pair("--out ", request.out), std::make_pair("--rig ", request.rig)}) {
    if (file.empty()) continue;
    const std::string fault = faultOfOutput(file, request.bags);
    if (!fault.empty()) throw UsageError(name + fault);
  }
  if (isSameFile(request.out, request.rig))
    throw UsageError("--rig " + request.rig + ": expected another file than that of --out");
}

int runCheck(const CheckRequest& request, std::ostream& out) {
  validate(request);
  std::optional<BagCheck> best;
  bool all_ready = true;
  const std::vector<std::vector<std::string>> recordings = recordingsOf(request.bags);
  for (const std::vector<std::string>& bags : recordings) {
    const BagCheck check = checkBag(bags, request);
    out << describeCheck(check) << std::flush;
    all_ready = all_ready && check.ready() && check.to_do.empty();
    if (check.ready() && (!best || check.quality > best->quality)) best = check;
  }
  if (!best) {
    out << "Not ready: no configuration is written.\n";
    return kExitFailed;
  }
  if (recordings.size() > 1)
    out << "The configuration is that of " << best->bags.front() << ", which shows the mounting best.\n";
  if (request.out.empty()) {
    out << "\n" << best->yaml;
  } else {
    const std::string kept = writeFile(request.out, best->yaml);
    out << "Written to " << request.out << (kept.empty() ? "" : " (the old file is now " + kept + ")")
        << ". Next: rosrun rio_t rio_t_bag";
    for (const std::string& bag : best->bags)
      out << " --bag " << (request.bags_go_away ? "BAG" : quoted(bag));
    out << " --config " << quoted(request.out) << " --output-dir results\n";
  }
  if (!request.rig.empty()) {
    const TemporaryFolder folder;
    const std::string yaml = folder.path() + "/rig.yaml";
    writeFile(yaml, best->yaml);
    drawRig(yaml, request.rig);
    out << "The rig is drawn in " << request.rig << "\n";
  }
  return all_ready ? kExitOk : kExitFailed;
}

}  // namespace rio_t
