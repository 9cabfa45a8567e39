// Writes a bag with known truth. See `simulate --help`.
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "option_list.h"
#include "rio_t/evaluation/trajectory.h"
#include "rio_t/ros/bag/simulation_bag.h"
#include "rio_t/simulation/motions.h"
#include "rio_t/simulation/presets.h"
#include "rio_t/simulation/simulation.h"

namespace {

using namespace rio_t;
using namespace rio_t::simulation;

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
  std::map<std::string, std::vector<OptionList::Given>> radars;  // what --radar gives, by name
};

struct RadarRequest {
  RadarSetup setup;
  std::optional<double> fov_elevation = std::nullopt;
};

bool isGiven(const std::vector<OptionList::Given>& given, const std::string& name) {
  return std::any_of(given.begin(), given.end(), [&](const OptionList::Given& g) { return g.name == name; });
}

RadarModelOptions::Interval parseInterval(const std::string& text) {
  const std::vector<double> n = parseNumbers(text, 2);
  if (n[0] < 0.0 || n[1] <= 0.0) {
    throw std::invalid_argument("'" + text + "' must be a start from 0 and a positive duration");
  }
  return {n[0], n[1]};
}

// Half angle of view [deg] of a flat radar: a row of patch antennas has a beam of about 10 degrees.
constexpr double kFlatFovElevation = 5.0;

void apply(Request& request, const Preset& preset) {
  request.preset = preset;
  request.rest = preset.rest;
  request.simulation = preset.options;
}

void addGeneralOptions(OptionList& options, Request& r) {
  options.section("What moves, and where it goes");
  options.add("preset", "NAME",
              "a platform with its motion, sensors and mounting (see below); the other options change it",
              "none", [&r](const std::string& v) { apply(r, presetOf(v)); });
  options.text("motion", "NAME", "built-in motion (see below)", r.motion);
  options.text("trajectory", "FILE",
               "or the poses of a TUM file (t x y z qx qy qz qw), through which a spline is put",
               r.trajectory);
  options.text("out", "BAG", "bag to write", r.out);
  options.text("ground-truth", "FILE", "also write the truth as a TUM file", r.ground_truth);
  options.number("ground-truth-file-rate", "HZ", "rate of that file", r.ground_truth_file_rate,
                 Range::kPositive);
  options.number("ground-truth-rate", "HZ", "rate of the truth in the bag", r.bag.ground_truth_rate,
                 Range::kPositive);
  options.add("seed", "N", "seed of everything random: same options and seed, same bytes", "0",
              [&r](const std::string& v) { r.simulation.seed = parseSeed(v); });
  options.add("format", "FORMAT", "irs | ti_mmwave: topics, fields, axes and stamps of the bag", "irs",
              [&r](const std::string& v) {
                if (v != "irs" && v != "ti_mmwave")
                  throw std::invalid_argument("'" + v + "' is not one of irs, ti_mmwave");
                r.bag.format = v == "irs" ? BagFormat::kIrs : BagFormat::kTiMmwave;
              });
  options.number("duration", "S",
                 "length of the bag with rest; 0 = the motion's own (with --trajectory: of the file)",
                 r.duration, Range::kNotNegative);
  options.add("speed", "M/S", "speed of the motions constant_speed and walk; the others have their own",
              "1; walk 1.3", [&r](const std::string& v) { r.speed = parseNumber(v, Range::kPositive); });
  options.number("static-start", "S", "rest at the start; 0 = starts in motion", r.rest.static_start,
                 Range::kNotNegative);
  options.number("static-end", "S", "rest at the end; 0 = ends in motion", r.rest.static_end,
                 Range::kNotNegative);
  options.number("ramp", "S", "from rest to full speed and back", r.rest.ramp, Range::kPositive);
  options.number("smoothing", "HZ",
                 "with --trajectory: faster motion than this is taken for noise of the poses", r.fit.cutoff,
                 Range::kPositive);
  options.number("start-time", "S", "stamp of the first IMU sample", r.start_time, Range::kPositive);
  options.number("record-offset", "S", "clock of the recorder minus clock of the IMU", r.bag.record_offset);
  options.number("gravity", "M/S^2", "magnitude", r.simulation.imu.gravity, Range::kPositive);
  options.flag("noise-free",
               "no noise, vibration, bias, quantisation, ghosts, moving objects or lost scans (blackouts, "
               "ghost bursts, Doppler span and flat radars stay)",
               r.noise_free);
}

void addImuOptions(OptionList& options, ImuModelOptions& imu) {
  options.section("IMU");
  options.number("imu-rate", "HZ", "rate", imu.rate, Range::kPositive);
  options.number("accel-noise", "M/S^2/RTHZ", "density of the noise", imu.noise.accel_density,
                 Range::kNotNegative);
  options.number("gyro-noise", "RAD/S/RTHZ", "density of the noise", imu.noise.gyro_density,
                 Range::kNotNegative);
  options.number("accel-random-walk", "M/S^3/RTHZ", "of the bias", imu.noise.accel_random_walk,
                 Range::kNotNegative);
  options.number("gyro-random-walk", "RAD/S^2/RTHZ", "of the bias", imu.noise.gyro_random_walk,
                 Range::kNotNegative);
  options.add("accel-bias", "X,Y,Z", "bias at the start [m/s^2]", "random", [&imu](const std::string& v) {
    const std::vector<double> n = parseNumbers(v, 3);
    imu.accel_bias = Eigen::Vector3d(n[0], n[1], n[2]);
  });
  options.add("gyro-bias", "X,Y,Z", "bias at the start [rad/s]", "random", [&imu](const std::string& v) {
    const std::vector<double> n = parseNumbers(v, 3);
    imu.gyro_bias = Eigen::Vector3d(n[0], n[1], n[2]);
  });
  options.number("accel-bias-sigma", "M/S^2", "of the random bias", imu.accel_bias_sigma,
                 Range::kNotNegative);
  options.number("gyro-bias-sigma", "RAD/S", "of the random bias", imu.gyro_bias_sigma, Range::kNotNegative);
  options.number(
      "vibration", "M/S^2",
      "sigma of what a vibrating frame adds to each axis and sample of the accelerometer, at rest too",
      imu.accel_vibration, Range::kNotNegative);
  options.number("vibration-gyro", "RAD/S", "sigma of what it adds to the gyro", imu.gyro_vibration,
                 Range::kNotNegative);
  options.number("vibration-frequency", "HZ",
                 "the vibration is a narrow band there and aliases above half the IMU rate; 0 = it is white",
                 imu.vibration_frequency, Range::kNotNegative);
  options.number("accel-saturation", "M/S^2", "largest reading of an axis", imu.accel_saturation,
                 Range::kPositive);
  options.number("gyro-saturation", "RAD/S", "largest reading of an axis", imu.gyro_saturation,
                 Range::kPositive);
}

void addBarometerOptions(OptionList& options, BarometerModelOptions& barometer) {
  options.section("Barometer");
  options.flag("barometer", "the platform carries one; topic /sensor_platform/baro", barometer.enabled);
  options.number("barometer-rate", "HZ", "rate", barometer.rate, Range::kPositive);
  options.number("barometer-noise", "PA", "sigma of a sample; 12 Pa are a metre", barometer.noise,
                 Range::kNotNegative);
  options.number("barometer-drift", "PA/RTS", "random walk: weather, and warmth of the sensor",
                 barometer.drift, Range::kNotNegative);
  options
      .add("pressure-shock", "S,S,PA",
           "START,DURATION,CHANGE: a door or a rotor changes the pressure; may be repeated", "none",
           [&barometer](const std::string& v) {
             const std::vector<double> n = parseNumbers(v, 3);
             if (n[0] < 0.0 || n[1] <= 0.0)
               throw std::invalid_argument("'" + v +
                                           "' must be a start from 0, a positive duration and a change");
             barometer.shocks.push_back({n[0], n[1], n[2]});
           })
      .repeatable = true;
}

// What --radar takes, too.
void addRadarOptions(OptionList& options, RadarRequest& r) {
  RadarModelOptions& radar = r.setup.radar;
  TimeOffsetProfile& offset = r.setup.time_offset;

  options.section("Time offset t_O: a scan stamped s was measured at s - t_O");
  options.number("time-offset", "S", "constant part", offset.constant);
  options.number("time-offset-drift", "S/S", "growth, from the start of the bag", offset.drift);
  options
      .add("time-offset-step", "S,S",
           "TIME,CHANGE: from TIME after the start on the offset is CHANGE more; may be repeated", "none",
           [&offset](const std::string& v) {
             const std::vector<double> n = parseNumbers(v, 2);
             offset.steps.push_back({n[0], n[1]});
           })
      .repeatable = true;

  options.section("Radar");
  options.add("lever-arm", "X,Y,Z", "radar origin in the IMU frame [m] (T_IR)", "0.03,0.03,-0.06",
              [&r](const std::string& v) {
                const std::vector<double> n = parseNumbers(v, 3);
                r.setup.T_IR.l_I = {n[0], n[1], n[2]};
              });
  options.add("q-ir", "W,X,Y,Z", "rotation that turns radar axes (right, forward, up) into the IMU's (T_IR)",
              "0.00524,0.69946,0.71461,0.00723", [&r](const std::string& v) {
                const std::vector<double> n = parseNumbers(v, 4);
                const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
                if (std::abs(q.norm() - 1.0) > 0.01)
                  throw std::invalid_argument("'" + v + "' is not a unit quaternion");
                r.setup.T_IR.q_IR = q.normalized();
              });
  options.number("radar-rate", "HZ", "scans a second", radar.rate, Range::kPositive);
  options.number("first-trigger", "S", "of the first scan, from the start of the bag", radar.first_trigger,
                 Range::kNotNegative);
  options.number("frame-length", "S",
                 "Doppler is the mean over it, centred at the measurement; 0 = an instant",
                 radar.frame_length, Range::kNotNegative);
  options.number("latency", "S", "from stamp to arrival (record time) of a scan", radar.latency,
                 Range::kNotNegative);
  options.number("latency-sigma", "S", "scatter of it", radar.latency_sigma, Range::kNotNegative);
  options.number("points", "N", "mean number of points a scan", radar.points_mean, Range::kPositive);
  options.number("points-sigma", "N", "scatter of it", radar.points_sigma, Range::kNotNegative);
  options.count("points-min", "fewest of it; 0 gives empty scans where mean and scatter do", radar.points_min,
                0);
  options.count("points-max", "limit of it", radar.points_max);
  options.flag("skip-empty", "scans without points are not published", radar.publish_empty, false);
  options.number("min-range", "M", "nearest point", radar.min_range, Range::kNotNegative);
  options.number("max-range", "M", "farthest point", radar.max_range, Range::kPositive);
  options.number("fov-azimuth", "DEG", "half angle of view", radar.fov_azimuth, Range::kPositive);
  options.add("fov-elevation", "DEG", "half angle of view",
              shown(radar.fov_elevation) + "; " + shown(kFlatFovElevation) + " with --no-elevation",
              [&r](const std::string& v) { r.fov_elevation = parseNumber(v, Range::kPositive); });
  options.flag("no-elevation",
               "a flat radar: sees what is within --fov-elevation, reports it in its own plane, z = 0",
               radar.measures_elevation, false);
  options.number("range-noise", "M", "sigma", radar.range_noise, Range::kNotNegative);
  options.number("azimuth-noise", "DEG", "sigma", radar.azimuth_noise, Range::kNotNegative);
  options.number("elevation-noise", "DEG", "sigma", radar.elevation_noise, Range::kNotNegative);
  options.number("doppler-noise", "M/S", "sigma, before quantisation", radar.doppler_noise,
                 Range::kNotNegative);
  options.number("doppler-step", "M/S", "quantisation; 0 = none", radar.doppler_step, Range::kNotNegative);
  options.number("doppler-span", "M/S",
                 "whole unambiguous span, a whole number of steps: 3 wraps into [-1.5, 1.5); 0 = unlimited",
                 radar.doppler_span, Range::kNotNegative);
  options.number("ghosts", "SHARE", "of the points: anywhere, any Doppler", radar.ghost_share, Range::kShare);
  options.number("moving", "SHARE", "of the time: persons walk through the view", radar.moving_share,
                 Range::kShare);
  options.count("crowd", "so many persons at once; their points take the place of the room's", radar.crowd);
  options.number("dropouts", "SHARE", "of the scans: triggered, never delivered", radar.dropout_share,
                 Range::kShare);
  options
      .add("blackout", "S,S", "START,DURATION without scans; may be repeated", "none",
           [&radar](const std::string& v) { radar.blackouts.push_back(parseInterval(v)); })
      .repeatable = true;
  options
      .add("ghost-burst", "S,S", "START,DURATION in which all points are ghosts; may be repeated", "none",
           [&radar](const std::string& v) { radar.ghost_bursts.push_back(parseInterval(v)); })
      .repeatable = true;
}

// Of a radar with a name: what its text gives.
std::pair<std::string, std::vector<OptionList::Given>> parseRadar(const std::string& text) {
  std::istringstream words(text);
  std::string name;
  words >> name;
  RadarRequest checked;
  OptionList options;
  addRadarOptions(options, checked);
  std::vector<OptionList::Given> given;
  for (std::string word; words >> word;) {
    const std::size_t equals = word.find('=');
    const std::string key = word.substr(0, equals);
    const OptionList::Option* option = options.find(key);
    if (option == nullptr) {
      std::string known;
      for (const std::string& other : options.names()) known += (known.empty() ? "" : ", ") + other;
      throw std::invalid_argument(name + ": unknown key '" + key + "'; known are " + known);
    }
    const bool has_value = equals != std::string::npos;
    if (has_value && option->argument.empty()) {
      throw std::invalid_argument(name + ": " + key + " takes no value");
    }
    if (!has_value && !option->argument.empty()) {
      throw std::invalid_argument(name + ": a value is missing (" + key + "=" + option->argument + ")");
    }
    if (!option->repeatable && isGiven(given, key)) {
      throw std::invalid_argument(name + ": " + key + " is given twice");
    }
    given.push_back({key, has_value ? word.substr(equals + 1) : ""});
    try {
      options.set(given.back());
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(name + ": " + error.what());
    }
  }
  return {name, given};
}

void addNamedRadars(OptionList& options, Request& r) {
  options.section(
      "Several radars. KEY is an option of the two sections below, without dashes; a flag stands alone.\n"
      "What a radar leaves out comes from the options outside. Each has its own reflectors, persons and\n"
      "ghosts. --preset kart_pair has left and right: --radar changes one of them, or adds another.\n"
      "Topics, irs:       /sensor_platform/radar_NAME/scan, /sensor_platform/radar_NAME/trigger\n"
      "Topics, ti_mmwave: /ti_mmwave/radar_scan_pcl_NAME, /sensor_platform/radar_NAME/trigger");
  options
      .add("radar", "TEXT",
           "\"NAME KEY=VALUE ...\", NAME of a-z, 0-9, _: a radar, in the place of the nameless; may be "
           "repeated",
           "none",
           [&r](const std::string& v) {
             const auto [name, given] = parseRadar(v);
             if (!r.radars.emplace(name, given).second) {
               throw std::invalid_argument("there are two radars of the name '" + name + "'");
             }
           })
      .repeatable = true;
}

// `outside` without what the radar gives itself, then that.
RadarSetup setupOf(const RadarSetup& preset, const std::vector<OptionList::Given>& outside,
                   const std::vector<OptionList::Given>& own) {
  RadarRequest radar{preset};
  OptionList options;
  addRadarOptions(options, radar);
  for (const OptionList::Given& given : outside) {
    if (options.find(given.name) != nullptr && !isGiven(own, given.name)) options.set(given);
  }
  for (const OptionList::Given& given : own) options.set(given);
  if (radar.fov_elevation) {
    radar.setup.radar.fov_elevation = *radar.fov_elevation;
  } else if (!radar.setup.radar.measures_elevation) {
    radar.setup.radar.fov_elevation = kFlatFovElevation;
  }
  return radar.setup;
}

// Sets all that the command line gives.
void setAll(const OptionList& options, std::vector<OptionList::Given> given, Request& request) {
  // A preset says what the others are to change, wherever it stands.
  std::stable_partition(given.begin(), given.end(),
                        [](const OptionList::Given& g) { return g.name == "preset"; });
  try {
    for (const OptionList::Given& g : given) options.set(g);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("--") + error.what());
  }
  SimulationOptions& simulation = request.simulation;
  RadarSetup& one = simulation;
  const RadarSetup common = one;
  one = setupOf(common, given, {});
  for (const auto& [name, own] : request.radars) simulation.radars.emplace(name, common);
  for (auto& [name, setup] : simulation.radars) setup = setupOf(setup, given, request.radars[name]);
  if (request.noise_free) {
    simulation.imu.removeErrors();
    simulation.barometer.removeErrors();
    simulation.radar.removeErrors();
    for (auto& [name, setup] : simulation.radars) setup.radar.removeErrors();
  }
}

void printHelp(const OptionList& options) {
  std::cout
      << "Writes a bag of a simulated IMU and radar whose motion and time offset are known.\n\n"
         "usage: simulate (--motion NAME | --trajectory FILE.txt | --preset NAME) --out FILE.bag [options]\n"
         "example: rosrun rio_t simulate --motion difficult --time-offset 0.03 --seed 1 --out sim.bag\n"
         "\nDefaults are in brackets. Noise is that of an ADIS16448 and a TI IWR6843AOP, measured on a "
         "real bag.\n";
  options.print(std::cout);
  std::cout << "\nMotions (duration with rest)\n";
  for (const MotionDescription& motion : builtInMotions()) {
    std::cout << "  " << std::left << std::setw(18) << motion.name << motion.summary << " ("
              << motion.default_duration << " s)\n";
  }
  std::cout << "\nPresets (motion)\n";
  for (const Preset& preset : presets()) {
    std::cout << "  " << std::left << std::setw(18) << preset.name << preset.summary << " (" << preset.motion
              << ")\n";
  }
}

Motion motionFromFile(const Request& request) {
  Trajectory poses = readTum(request.trajectory);
  if (request.duration > 0.0) {
    const double wanted = Motion::pathDuration(request.duration, request.rest);
    while (!poses.empty() && poses.back().time - poses.front().time > wanted) poses.pop_back();
  }
  return Motion(TrajectorySpline(poses, request.fit), request.rest);
}

Motion motionOf(const Request& request) {
  const bool preset = request.motion.empty() && request.trajectory.empty() && !request.preset.motion.empty();
  const std::string& name = preset ? request.preset.motion : request.motion;
  if (name.empty() == request.trajectory.empty()) {
    throw std::invalid_argument(
        "exactly one of --motion and --trajectory is needed, or a --preset (see --help)");
  }
  if (request.out.empty()) throw std::invalid_argument("--out: the bag to write is not given (see --help)");
  if (!request.trajectory.empty()) {
    if (request.speed) {
      throw std::invalid_argument(
          "--speed: only the motions constant_speed and walk can be given one, a trajectory has its own");
    }
    try {
      return motionFromFile(request);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("--trajectory " + request.trajectory + ": " + error.what());
    }
  }
  const double duration = preset && request.duration == 0.0 ? request.preset.duration : request.duration;
  return makeMotion({name, request.simulation.seed, duration, request.rest, request.speed});
}

std::string triple(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out << std::fixed << std::setprecision(5) << v.x() << " " << v.y() << " " << v.z();
  return out.str();
}

void printRadar(const std::string& title, const RadarSetup& setup, const std::vector<SimulatedScan>& scans) {
  std::size_t delivered = 0, points = 0;
  for (const SimulatedScan& scan : scans) {
    delivered += scan.delivered ? 1 : 0;
    points += scan.points.size();
  }
  std::cout << title << ": " << delivered << " scans of " << scans.size() << " triggers, "
            << std::setprecision(2)
            << (delivered > 0 ? static_cast<double>(points) / static_cast<double>(delivered) : 0.0)
            << " points each; true time offset: " << std::setprecision(6);
  if (scans.empty()) {
    std::cout << "no scan\n";
    return;
  }
  std::cout << scans.front().time_offset << " s";
  if (scans.back().time_offset != scans.front().time_offset) {
    std::cout << " at the start, " << scans.back().time_offset << " s at the end";
  }
  std::cout << " (against arrival: " << setup.radar.latency << " s more)\n";
}

void printSummary(const Request& request, const Motion& motion, const SensorData& data) {
  double path = 0.0, speed = 0.0, rate = 0.0, acceleration = 0.0;
  constexpr double kStep = 0.005;
  for (double t = 0.0; t <= motion.duration(); t += kStep) {
    const MotionState state = motion.at(t);
    path += kStep * state.v_W.norm();
    speed = std::max(speed, state.v_W.norm());
    rate = std::max(rate, state.omega_I.norm());
    acceleration = std::max(acceleration, state.a_W.norm());
  }
  std::cout << std::fixed << std::setprecision(2) << "motion: " << motion.duration() << " s (rest "
            << motion.rest().static_start << " s at the start, " << motion.rest().static_end
            << " s at the end), " << path << " m, up to " << speed << " m/s, " << rate << " rad/s, "
            << acceleration << " m/s^2\n";
  if (!request.trajectory.empty()) {
    std::cout << "spline: poses of the file are " << 1e3 * motion.path().positionResidual() << " mm and "
              << motion.path().rotationResidual() * 57.29577951308232 << " deg (rms) from it\n";
  }
  std::cout << "IMU: " << data.imu.samples.size() << " samples\n"
            << "true accelerometer bias [m/s^2]: " << triple(data.imu.b_a.front()) << " at the start, "
            << triple(data.imu.b_a.back()) << " at the end\n"
            << "true gyro bias [rad/s]: " << triple(data.imu.b_g.front()) << " at the start, "
            << triple(data.imu.b_g.back()) << " at the end\n";
  if (!data.pressures.empty())
    std::cout << "barometer: " << data.pressures.size() << " samples, true drift at the end "
              << data.pressures.back().drift << " Pa\n";
  if (data.radars.empty()) printRadar("radar", request.simulation, data.scans);
  for (const auto& [name, scans] : data.radars) {
    printRadar("radar " + name, request.simulation.radars.at(name), scans);
  }
  std::cout << "wrote " << request.out;
  if (!request.ground_truth.empty()) std::cout << " and " << request.ground_truth;
  std::cout << "\n";
}

void run(Request request) {
  if (!request.simulation.barometer.shocks.empty() && !request.simulation.barometer.enabled)
    throw std::invalid_argument("--pressure-shock needs --barometer");
  request.simulation.start = Time::fromSeconds(request.start_time);
  const Motion motion = motionOf(request);
  const SensorData data = simulate(motion, request.simulation);
  writeSimulationBag(request.out, motion, data, request.simulation.start, request.bag);
  if (!request.ground_truth.empty()) {
    writeTum(request.ground_truth,
             groundTruth(motion, request.ground_truth_file_rate, request.simulation.start));
  }
  printSummary(request, motion, data);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    Request request;
    RadarRequest radar;  // for the defaults that --help shows; setAll() sets the radars themselves
    OptionList options;
    addGeneralOptions(options, request);
    addImuOptions(options, request.simulation.imu);
    addBarometerOptions(options, request.simulation.barometer);
    addNamedRadars(options, request);
    addRadarOptions(options, radar);
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments) {
      if (argument == "--help" || argument == "-h") {
        printHelp(options);
        return 0;
      }
    }
    setAll(options, options.read(arguments), request);
    run(request);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "simulate: " << error.what() << "\n";
    return 1;
  }
}
