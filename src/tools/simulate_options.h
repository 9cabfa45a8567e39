#pragma once

#include <map>
#include <optional>
#include <string>

#include "../ros/command_line.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/simulation/presets.h"
#include "rio_t/simulation/simulation.h"
#include "rio_t/simulation/trajectory_spline.h"

namespace rio_t::simulation {

/// The user asks for this on the command line of `simulate`.
struct Request {
  std::string motion;
  std::string trajectory;
  std::string out;
  std::string ground_truth;
  double duration = 0.0;
  std::optional<double> speed;
  Preset preset;  // what is moved unless --motion or --trajectory says so
  double ground_truth_file_rate = 400.0;
  double start_time = 1.7e9;
  bool noise_free = false;
  MotionRestOptions rest;
  SplineFitOptions fit;
  SimulationOptions simulation;
  SimulationBagOptions bag;
  std::map<std::string, OptionSet::Given> radars;  // what --radar gives, by name
};

/// The options of one radar set this. --radar takes the same options.
struct RadarRequest {
  RadarSetup setup;
  std::optional<double> fov_elevation = std::nullopt;
};

/// The options of `simulate`.
class CommandLine {
 public:
  CommandLine();
  CommandLine(const CommandLine&) = delete;  // the options name the members that they set
  CommandLine& operator=(const CommandLine&) = delete;

  OptionSet& options() { return options_; }
  /// Sets all that the command line gives. Throws UsageError.
  const Request& read(const OptionSet::Given& given);

 private:
  Request request_;
  RadarRequest radar_;  ///< for the defaults that --help shows
  OptionSet options_;
};

}  // namespace rio_t::simulation
