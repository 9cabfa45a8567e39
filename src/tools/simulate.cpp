// Writes a bag with known truth. See `simulate --help`.
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

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
  std::optional<double> fov_elevation;
  Preset preset;  // what is moved unless --motion or --trajectory says so
  double ground_truth_file_rate = 400.0;
  double start_time = 1.7e9;
  bool noise_free = false;
  MotionRestOptions rest;
  SplineFitOptions fit;
  SimulationOptions simulation;
  SimulationBagOptions bag;
};

enum class Range { kAny, kNotNegative, kPositive, kShare };

double parseNumber(const std::string& text, Range range = Range::kAny) {
  char* end = nullptr;
  errno = 0;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || errno == ERANGE || !std::isfinite(value)) {
    throw std::invalid_argument("'" + text + "' is not a number");
  }
  if (range == Range::kNotNegative && value < 0.0) throw std::invalid_argument("'" + text + "' is below 0");
  if (range == Range::kPositive && value <= 0.0) throw std::invalid_argument("'" + text + "' is not above 0");
  if (range == Range::kShare && (value < 0.0 || value > 1.0)) {
    throw std::invalid_argument("'" + text + "' is not within 0 and 1");
  }
  return value;
}

std::uint64_t parseSeed(const std::string& text) {
  char* end = nullptr;
  errno = 0;
  const std::uint64_t value = std::strtoull(text.c_str(), &end, 10);
  if (text.empty() || text.find_first_not_of("0123456789") != std::string::npos || errno == ERANGE) {
    throw std::invalid_argument("'" + text + "' is not a whole number from 0");
  }
  return value;
}

std::vector<double> parseNumbers(const std::string& text, std::size_t count) {
  std::vector<double> values;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) values.push_back(parseNumber(part));
  if (values.size() != count) {
    throw std::invalid_argument("'" + text + "' must be " + std::to_string(count) +
                                " numbers with commas between");
  }
  return values;
}

RadarModelOptions::Interval parseInterval(const std::string& text) {
  const std::vector<double> n = parseNumbers(text, 2);
  if (n[0] < 0.0 || n[1] <= 0.0) {
    throw std::invalid_argument("'" + text + "' must be a start from 0 and a positive duration");
  }
  return {n[0], n[1]};
}

std::string shown(double value) {
  std::ostringstream out;
  out << std::setprecision(10) << value;
  return out.str();
}

// Half angle of view [deg] of a flat radar: a row of patch antennas has a beam of about 10 degrees.
constexpr double kFlatFovElevation = 5.0;

void apply(Request& request, const Preset& preset) {
  request.preset = preset;
  request.rest = preset.rest;
  request.simulation = preset.options;
}

// The options of the program: what each sets, and what --help says about it.
class Options {
 public:
  explicit Options(Request& r) {
    ImuModelOptions& imu = r.simulation.imu;
    RadarModelOptions& radar = r.simulation.radar;
    TimeOffsetProfile& offset = r.simulation.time_offset;

    section("What moves, and where it goes");
    add("preset", "NAME",
        "a platform with its motion, sensors and mounting (see below); the other options change it", "none",
        [&r](const std::string& v) { apply(r, presetOf(v)); });
    options_.back().first = true;
    text("motion", "NAME", "built-in motion (see below)", r.motion);
    text("trajectory", "FILE",
         "or the poses of a TUM file (t x y z qx qy qz qw), through which a spline is put", r.trajectory);
    text("out", "BAG", "bag to write", r.out);
    text("ground-truth", "FILE", "also write the truth as a TUM file", r.ground_truth);
    number("ground-truth-file-rate", "HZ", "rate of that file", r.ground_truth_file_rate, Range::kPositive);
    number("ground-truth-rate", "HZ", "rate of the truth in the bag", r.bag.ground_truth_rate,
           Range::kPositive);
    add("seed", "N", "seed of everything random: same options and seed, same bytes", "0",
        [&r](const std::string& v) { r.simulation.seed = parseSeed(v); });
    add("format", "FORMAT", "irs | ti_mmwave: topics, fields, axes and stamps of the bag", "irs",
        [&r](const std::string& v) {
          if (v != "irs" && v != "ti_mmwave")
            throw std::invalid_argument("'" + v + "' is not one of irs, ti_mmwave");
          r.bag.format = v == "irs" ? BagFormat::kIrs : BagFormat::kTiMmwave;
        });
    number("duration", "S",
           "length of the bag with rest; 0 = the motion's own (with --trajectory: of the file)", r.duration,
           Range::kNotNegative);
    add("speed", "M/S", "speed of the motions constant_speed and walk; the others have their own",
        "1; walk 1.3", [&r](const std::string& v) { r.speed = parseNumber(v, Range::kPositive); });
    number("static-start", "S", "rest at the start; 0 = starts in motion", r.rest.static_start,
           Range::kNotNegative);
    number("static-end", "S", "rest at the end; 0 = ends in motion", r.rest.static_end, Range::kNotNegative);
    number("ramp", "S", "from rest to full speed and back", r.rest.ramp, Range::kPositive);
    number("smoothing", "HZ", "with --trajectory: faster motion than this is taken for noise of the poses",
           r.fit.cutoff, Range::kPositive);
    number("start-time", "S", "stamp of the first IMU sample", r.start_time, Range::kPositive);
    number("record-offset", "S", "clock of the recorder minus clock of the IMU", r.bag.record_offset);
    number("gravity", "M/S^2", "magnitude", imu.gravity, Range::kPositive);
    flag("noise-free",
         "no noise, vibration, bias, quantisation, ghosts, moving objects or lost scans (blackouts, "
         "ghost bursts, Doppler span and flat radars stay)",
         r.noise_free);

    section("Time offset t_O: a scan stamped s was measured at s - t_O");
    number("time-offset", "S", "constant part", offset.constant);
    number("time-offset-drift", "S/S", "growth, from the start of the bag", offset.drift);
    add("time-offset-step", "S,S",
        "TIME,CHANGE: from TIME after the start on the offset is CHANGE more; may be repeated", "none",
        [&offset](const std::string& v) {
          const std::vector<double> n = parseNumbers(v, 2);
          offset.steps.push_back({n[0], n[1]});
        });

    section("IMU");
    number("imu-rate", "HZ", "rate", imu.rate, Range::kPositive);
    number("accel-noise", "M/S^2/RTHZ", "density of the noise", imu.noise.accel_density, Range::kNotNegative);
    number("gyro-noise", "RAD/S/RTHZ", "density of the noise", imu.noise.gyro_density, Range::kNotNegative);
    number("accel-random-walk", "M/S^3/RTHZ", "of the bias", imu.noise.accel_random_walk,
           Range::kNotNegative);
    number("gyro-random-walk", "RAD/S^2/RTHZ", "of the bias", imu.noise.gyro_random_walk,
           Range::kNotNegative);
    add("accel-bias", "X,Y,Z", "bias at the start [m/s^2]", "random", [&imu](const std::string& v) {
      const std::vector<double> n = parseNumbers(v, 3);
      imu.accel_bias = Eigen::Vector3d(n[0], n[1], n[2]);
    });
    add("gyro-bias", "X,Y,Z", "bias at the start [rad/s]", "random", [&imu](const std::string& v) {
      const std::vector<double> n = parseNumbers(v, 3);
      imu.gyro_bias = Eigen::Vector3d(n[0], n[1], n[2]);
    });
    number("accel-bias-sigma", "M/S^2", "of the random bias", imu.accel_bias_sigma, Range::kNotNegative);
    number("gyro-bias-sigma", "RAD/S", "of the random bias", imu.gyro_bias_sigma, Range::kNotNegative);
    number("vibration", "M/S^2",
           "sigma of what a vibrating frame adds to each axis and sample of the accelerometer, at rest too",
           imu.accel_vibration, Range::kNotNegative);
    number("vibration-gyro", "RAD/S", "sigma of what it adds to the gyro", imu.gyro_vibration,
           Range::kNotNegative);
    number("vibration-frequency", "HZ",
           "the vibration is a narrow band there and aliases above half the IMU rate; 0 = it is white",
           imu.vibration_frequency, Range::kNotNegative);
    number("accel-saturation", "M/S^2", "largest reading of an axis", imu.accel_saturation, Range::kPositive);
    number("gyro-saturation", "RAD/S", "largest reading of an axis", imu.gyro_saturation, Range::kPositive);

    section("Radar");
    add("lever-arm", "X,Y,Z", "radar origin in the IMU frame [m] (T_IR)", "0.03,0.03,-0.06",
        [&r](const std::string& v) {
          const std::vector<double> n = parseNumbers(v, 3);
          r.simulation.T_IR.l_I = {n[0], n[1], n[2]};
        });
    add("q-ir", "W,X,Y,Z", "rotation that turns radar axes (right, forward, up) into the IMU's (T_IR)",
        "0.00524,0.69946,0.71461,0.00723", [&r](const std::string& v) {
          const std::vector<double> n = parseNumbers(v, 4);
          const Eigen::Quaterniond q(n[0], n[1], n[2], n[3]);
          if (std::abs(q.norm() - 1.0) > 0.01)
            throw std::invalid_argument("'" + v + "' is not a unit quaternion");
          r.simulation.T_IR.q_IR = q.normalized();
        });
    number("radar-rate", "HZ", "scans a second", radar.rate, Range::kPositive);
    number("first-trigger", "S", "of the first scan, from the start of the bag", radar.first_trigger,
           Range::kNotNegative);
    number("frame-length", "S", "Doppler is the mean over it, centred at the measurement; 0 = an instant",
           radar.frame_length, Range::kNotNegative);
    number("latency", "S", "from stamp to arrival (record time) of a scan", radar.latency,
           Range::kNotNegative);
    number("latency-sigma", "S", "scatter of it", radar.latency_sigma, Range::kNotNegative);
    number("points", "N", "mean number of points a scan", radar.points_mean, Range::kPositive);
    number("points-sigma", "N", "scatter of it", radar.points_sigma, Range::kNotNegative);
    count("points-min", "fewest of it; 0 gives empty scans where mean and scatter do", radar.points_min, 0);
    count("points-max", "limit of it", radar.points_max);
    add("skip-empty", "", "scans without points are not published", "",
        [&radar](const std::string&) { radar.publish_empty = false; });
    number("min-range", "M", "nearest point", radar.min_range, Range::kNotNegative);
    number("max-range", "M", "farthest point", radar.max_range, Range::kPositive);
    number("fov-azimuth", "DEG", "half angle of view", radar.fov_azimuth, Range::kPositive);
    add("fov-elevation", "DEG", "half angle of view",
        shown(radar.fov_elevation) + "; " + shown(kFlatFovElevation) + " with --no-elevation",
        [&r](const std::string& v) { r.fov_elevation = parseNumber(v, Range::kPositive); });
    add("no-elevation", "",
        "a flat radar: sees what is within --fov-elevation, reports it in its own plane, z = 0", "",
        [&radar](const std::string&) { radar.measures_elevation = false; });
    number("range-noise", "M", "sigma", radar.range_noise, Range::kNotNegative);
    number("azimuth-noise", "DEG", "sigma", radar.azimuth_noise, Range::kNotNegative);
    number("elevation-noise", "DEG", "sigma", radar.elevation_noise, Range::kNotNegative);
    number("doppler-noise", "M/S", "sigma, before quantisation", radar.doppler_noise, Range::kNotNegative);
    number("doppler-step", "M/S", "quantisation; 0 = none", radar.doppler_step, Range::kNotNegative);
    number("doppler-span", "M/S",
           "whole unambiguous span, a whole number of steps: 3 wraps into [-1.5, 1.5); 0 = unlimited",
           radar.doppler_span, Range::kNotNegative);
    number("ghosts", "SHARE", "of the points: anywhere, any Doppler", radar.ghost_share, Range::kShare);
    number("moving", "SHARE", "of the time: persons walk through the view", radar.moving_share,
           Range::kShare);
    count("crowd", "so many persons at once; their points take the place of the room's", radar.crowd);
    number("dropouts", "SHARE", "of the scans: triggered, never delivered", radar.dropout_share,
           Range::kShare);
    add("blackout", "S,S", "START,DURATION without scans; may be repeated", "none",
        [&radar](const std::string& v) { radar.blackouts.push_back(parseInterval(v)); });
    add("ghost-burst", "S,S", "START,DURATION in which all points are ghosts; may be repeated", "none",
        [&radar](const std::string& v) { radar.ghost_bursts.push_back(parseInterval(v)); });
  }

  // `--name value` or `--name=value`. Throws std::invalid_argument with a message that names the option.
  void parse(const std::vector<std::string>& arguments) const {
    std::vector<Given> given = read(arguments);
    // A preset says what the others are to change, wherever it stands.
    std::stable_partition(given.begin(), given.end(), [](const Given& g) { return g.option->first; });
    for (const Given& g : given) {
      try {
        g.option->set(g.value);
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("--" + g.option->name + ": " + error.what());
      }
    }
  }

  void print(std::ostream& out) const {
    for (const Option& option : options_) {
      if (!option.set) {
        out << "\n" << option.help << "\n";
        continue;
      }
      const std::string left = "  --" + option.name + (option.argument.empty() ? "" : " " + option.argument);
      out << std::left << std::setw(38) << left << " " << option.help;
      if (!option.shown_default.empty()) out << " [" << option.shown_default << "]";
      out << "\n";
    }
  }

 private:
  using Setter = std::function<void(const std::string&)>;
  struct Option {
    std::string name;
    std::string argument;  // unit or form of the value; empty for a flag
    std::string help;
    std::string shown_default;
    Setter set;          // empty for a heading
    bool first = false;  // set before the others
  };
  struct Given {
    const Option* option;
    std::string value;
  };

  std::vector<Given> read(const std::vector<std::string>& arguments) const {
    std::vector<Given> given;
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const std::string& argument = arguments[i];
      const std::size_t equals = argument.find('=');
      const std::string name = argument.substr(0, equals);
      const Option* option = find(name);
      if (option == nullptr) throw std::invalid_argument("unknown option '" + name + "' (see --help)");
      std::string value;
      if (equals != std::string::npos) {
        if (option->argument.empty()) throw std::invalid_argument(name + ": takes no value");
        value = argument.substr(equals + 1);
      } else if (!option->argument.empty()) {
        if (++i == arguments.size())
          throw std::invalid_argument(name + ": a value is missing (" + option->argument + ")");
        value = arguments[i];
      }
      given.push_back({option, value});
    }
    return given;
  }

  void section(const std::string& heading) { options_.push_back({"", "", heading, "", nullptr, false}); }

  void add(const std::string& name, const std::string& argument, const std::string& help,
           const std::string& shown_default, const Setter& set) {
    options_.push_back({name, argument, help, shown_default, set, false});
  }

  void text(const std::string& name, const std::string& argument, const std::string& help,
            std::string& target) {
    add(name, argument, help, "", [&target](const std::string& v) {
      if (v.empty()) throw std::invalid_argument("the value is empty");
      target = v;
    });
  }

  void flag(const std::string& name, const std::string& help, bool& target) {
    add(name, "", help, "", [&target](const std::string&) { target = true; });
  }

  void number(const std::string& name, const std::string& unit, const std::string& help, double& target,
              Range range = Range::kAny) {
    add(name, unit, help, shown(target),
        [&target, range](const std::string& v) { target = parseNumber(v, range); });
  }

  void count(const std::string& name, const std::string& help, int& target, int least = 1) {
    add(name, "N", help, shown(target), [&target, least](const std::string& v) {
      const double n = parseNumber(v);
      if (n < least || n > 100000.0 || n != std::floor(n)) {
        throw std::invalid_argument("'" + v + "' is not a whole number from " + std::to_string(least) +
                                    " to 100000");
      }
      target = static_cast<int>(n);
    });
  }

  const Option* find(const std::string& argument) const {
    for (const Option& option : options_) {
      if (option.set && "--" + option.name == argument) return &option;
    }
    return nullptr;
  }

  std::vector<Option> options_;
};

void printHelp(const Options& options) {
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
  std::size_t delivered = 0, points = 0;
  for (const SimulatedScan& scan : data.scans) {
    delivered += scan.delivered ? 1 : 0;
    points += scan.points.size();
  }
  std::cout << std::fixed << std::setprecision(2) << "motion: " << motion.duration() << " s (rest "
            << motion.rest().static_start << " s at the start, " << motion.rest().static_end
            << " s at the end), " << path << " m, up to " << speed << " m/s, " << rate << " rad/s, "
            << acceleration << " m/s^2\n";
  if (!request.trajectory.empty()) {
    std::cout << "spline: poses of the file are " << 1e3 * motion.path().positionResidual() << " mm and "
              << motion.path().rotationResidual() * 57.29577951308232 << " deg (rms) from it\n";
  }
  std::cout << "IMU: " << data.imu.samples.size() << " samples; radar: " << delivered << " scans of "
            << data.scans.size() << " triggers, "
            << (delivered > 0 ? static_cast<double>(points) / static_cast<double>(delivered) : 0.0)
            << " points each\n"
            << "true accelerometer bias [m/s^2]: " << triple(data.imu.b_a.front()) << " at the start, "
            << triple(data.imu.b_a.back()) << " at the end\n"
            << "true gyro bias [rad/s]: " << triple(data.imu.b_g.front()) << " at the start, "
            << triple(data.imu.b_g.back()) << " at the end\n"
            << std::setprecision(6);
  if (data.scans.empty()) {
    std::cout << "true time offset: no scan\n";
    return;
  }
  std::cout << "true time offset: " << data.scans.front().time_offset << " s";
  if (data.scans.back().time_offset != data.scans.front().time_offset) {
    std::cout << " at the start, " << data.scans.back().time_offset << " s at the end";
  }
  std::cout << " (against arrival: " << request.simulation.radar.latency << " s more)\n"
            << "wrote " << request.out;
  if (!request.ground_truth.empty()) std::cout << " and " << request.ground_truth;
  std::cout << "\n";
}

void run(Request request) {
  if (request.noise_free) {
    request.simulation.imu.removeErrors();
    request.simulation.radar.removeErrors();
  }
  RadarModelOptions& radar = request.simulation.radar;
  if (request.fov_elevation) {
    radar.fov_elevation = *request.fov_elevation;
  } else if (!radar.measures_elevation) {
    radar.fov_elevation = kFlatFovElevation;
  }
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
    const Options options(request);
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    for (const std::string& argument : arguments) {
      if (argument == "--help" || argument == "-h") {
        printHelp(options);
        return 0;
      }
    }
    options.parse(arguments);
    run(request);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "simulate: " << error.what() << "\n";
    return 1;
  }
}
