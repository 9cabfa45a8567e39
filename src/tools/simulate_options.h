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

/// What the user asks for on the command line of `simulate`.
struct Request {
  std::string motion;
  std::string trajectory;
  std::string out;
  std::string ground_truth;
  double duration = 0.0;
  std::optional<double> speed;
  Preset preset;  // gives the motion unless --motion or --trajectory does
  double ground_truth_file_rate = 400.0;
  double start_time = 1.7e9;
  bool noise_free = false;
  MotionRestOptions rest;
  double smoothing = TrajectorySpline::kUsualCutoff;  // [Hz]
  SimulationOptions simulation;
  SimulationBagOptions bag;
  std::map<std::string, OptionSet::Given> radars;  // what --radar gives, by name
};

/// What the options of one radar set. --radar takes the same options.
struct RadarRequest {
  RadarSetup setup;
  std::optional<double> fov_elevation = std::nullopt;
};

class CommandLine {
 public:
  CommandLine();
  CommandLine(const CommandLine&) = delete;  // the options refer to the members that they set
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
