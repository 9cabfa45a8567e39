// Writes a bag with known truth. See `simulate --help`.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "../ros/command_line.h"
#include "../ros/text.h"
#include "rio_t/core/angle.h"
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
  std::map<std::string, OptionSet::Given> radars;  // what --radar gives, by name
};

struct RadarRequest {
  RadarSetup setup;
  std::optional<double> fov_elevation = std::nullopt;
};

std::uint64_t parseSeed(const std::string& text) {
  std::uint64_t seed = 0;
  std::istringstream in(text);
  const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
  if (!digits || !(in >> seed)) throw UsageError("'" + text + "' is not a whole number from 0");
  return seed;
}

Eigen::Vector3d parseVector(const std::string& text) { return Eigen::Vector3d(parseNumbers(text, 3).data()); }

RadarModelOptions::Interval parseInterval(const std::string& text) {
  const std::vector<double> n = parseNumbers(text, 2);
  if (n[0] < 0.0 || n[1] <= 0.0) {
    throw UsageError("'" + text + "' must be a start from 0 and a positive duration");
  }
  return {n[0], n[1]};
}

// Half angle of view [deg] of a flat radar: a row of patch antennas has a beam of about 10 degrees.
constexpr double kFlatFovElevation = 5.0;

void addGeneralOptions(OptionSet& options, Request& r) {
  options.value("preset", "NAME",
                "a platform with its motion, sensors and mounting (see below); the other options change it",
                "none", [](const std::string& /*name*/) {});  // setAll() applies it
  options.text("motion", "NAME", "built-in motion (see below)", r.motion);
  options.text("trajectory", "FILE",
               "or the poses of a TUM file (t x y z qx qy qz qw), through which a spline is put",
               r.trajectory);
  options.text("out", "BAG", "bag to write", r.out);
  options.text("ground-truth", "FILE", "also write the truth as a TUM file", r.ground_truth);
  options.number("ground-truth-file-rate", "HZ", "rate of that file", r.ground_truth_file_rate,
                 NumberRange::kPositive);
  options.number("ground-truth-rate", "HZ", "rate of the truth in the bag", r.bag.ground_truth_rate,
                 NumberRange::kPositive);
  options.value("seed", "N", "seed of everything random: same options and seed, same bytes", "0",
                [&r](const std::string& v) { r.simulation.seed = parseSeed(v); });
  options.value("format", "FORMAT", "irs | ti_mmwave: topics, fields, axes and stamps of the bag", "irs",
                [&r](const std::string& v) {
                  if (v != "irs" && v != "ti_mmwave")
                    throw UsageError("'" + v + "' is not one of irs, ti_mmwave");
                  r.bag.format = v == "irs" ? BagFormat::kIrs : BagFormat::kTiMmwave;
                });
  options.number("duration", "S",
                 "length of the bag with rest; 0 = the motion's own (with --trajectory: that of the file)",
                 r.duration);
  options.value("speed", "M/S", "speed of the motions constant_speed and walk; the others have their own",
                "1; walk 1.3",
                [&r](const std::string& v) { r.speed = parseNumber(v, NumberRange::kPositive); });
  options.number("static-start", "S", "rest at the start; 0 = starts in motion", r.rest.static_start);
  options.number("static-end", "S", "rest at the end; 0 = ends in motion", r.rest.static_end);
  options.number("ramp", "S", "time from rest to full speed, and back", r.rest.ramp, NumberRange::kPositive);
  options.number("smoothing", "HZ",
                 "with --trajectory: faster motion than this is taken for noise of the poses", r.fit.cutoff,
                 NumberRange::kPositive);
  options.number("start-time", "S", "stamp of the first IMU sample", r.start_time, NumberRange::kPositive);
  options.number("record-offset", "S", "clock of the recorder minus clock of the IMU", r.bag.record_offset,
                 NumberRange::kAny);
  options.number("gravity", "M/S^2", "size of gravity", r.simulation.imu.gravity, NumberRange::kPositive);
  options.flag(
      "noise-free",
      "no noise, vibration, bias, quantisation, ghosts, ambiguous points, moving objects, lost scans or "
      "samples (blackouts, ghost bursts, Doppler span and flat radars stay)",
      r.noise_free);
}

void addImuOptions(OptionSet& options, ImuModelOptions& imu) {
  options.section("IMU");
  options.number("imu-rate", "HZ", "rate", imu.rate, NumberRange::kPositive);
  options.number("accel-noise", "M/S^2/RTHZ", "density of the noise", imu.noise.accel_density);
  options.number("gyro-noise", "RAD/S/RTHZ", "density of the noise", imu.noise.gyro_density);
  options.number("accel-random-walk", "M/S^3/RTHZ", "random walk of the bias", imu.noise.accel_random_walk);
  options.number("gyro-random-walk", "RAD/S^2/RTHZ", "random walk of the bias", imu.noise.gyro_random_walk);
  options.number("gyro-scale-error", "SHARE", "sigma of the scale of each axis of the gyro",
                 imu.noise.gyro_scale_error);
  options.value("accel-bias", "X,Y,Z", "bias at the start [m/s^2]", "random",
                [&imu](const std::string& v) { imu.accel_bias = parseVector(v); });
  options.value("gyro-bias", "X,Y,Z", "bias at the start [rad/s]", "random",
                [&imu](const std::string& v) { imu.gyro_bias = parseVector(v); });
  options.number("accel-bias-sigma", "M/S^2", "sigma of the random bias", imu.accel_bias_sigma);
  options.number("gyro-bias-sigma", "RAD/S", "sigma of the random bias", imu.gyro_bias_sigma);
  options.number(
      "vibration", "M/S^2",
      "sigma of what a vibrating frame adds to each axis and sample of the accelerometer, at rest too",
      imu.accel_vibration);
  options.number("vibration-gyro", "RAD/S", "sigma of what it adds to the gyro", imu.gyro_vibration);
  options.number("vibration-frequency", "HZ",
                 "the vibration is a narrow band there and aliases above half the IMU rate; 0 = it is white",
                 imu.vibration_frequency);
  options.number("imu-dropouts", "SHARE", "share of the samples that are lost", imu.dropout_share,
                 NumberRange::kShare);
  options.number("accel-saturation", "M/S^2", "largest reading of an axis", imu.accel_saturation,
                 NumberRange::kPositive);
  options.number("gyro-saturation", "RAD/S", "largest reading of an axis", imu.gyro_saturation,
                 NumberRange::kPositive);
}

void addBarometerOptions(OptionSet& options, BarometerModelOptions& barometer) {
  options.section("Barometer");
  options.flag("barometer", "the platform carries one; topic /sensor_platform/baro", barometer.enabled);
  options.number("barometer-rate", "HZ", "rate", barometer.rate, NumberRange::kPositive);
  options.number("barometer-noise", "PA", "sigma of a sample; 12 Pa are a metre", barometer.noise);
  options.number("barometer-drift", "PA/RTS", "random walk: weather, and warmth of the sensor",
                 barometer.drift);
  options.values("pressure-shock", "S,S,PA",
                 "START,DURATION,CHANGE: a door or a rotor changes the pressure; may be repeated",
                 [&barometer](const std::string& v) {
                   const std::vector<double> n = parseNumbers(v, 3);
                   if (n[0] < 0.0 || n[1] <= 0.0)
                     throw UsageError("'" + v + "' must be a start from 0, a positive duration and a change");
                   barometer.shocks.push_back({n[0], n[1], n[2]});
                 });
}

// What --radar takes, too.
void addRadarOptions(OptionSet& options, RadarRequest& r) {
  RadarModelOptions& radar = r.setup.radar;
  TimeOffsetProfile& offset = r.setup.time_offset;

  options.section("Time offset t_O: a scan stamped s was measured at s - t_O");
  options.number("time-offset", "S", "constant part", offset.constant, NumberRange::kAny);
  options.number("time-offset-drift", "S/S", "growth, from the start of the bag", offset.drift,
                 NumberRange::kAny);
  options.values("time-offset-step", "S,S",
                 "TIME,CHANGE: from TIME after the start on the offset is CHANGE more; may be repeated",
                 [&offset](const std::string& v) {
                   const std::vector<double> n = parseNumbers(v, 2);
                   offset.steps.push_back({n[0], n[1]});
                 });

  options.section("Radar");
  options.value("extrinsics-translation", "X,Y,Z", "radar origin in the IMU frame [m] (T_IR)",
                "0.03,0.03,-0.06", [&r](const std::string& v) { r.setup.T_IR.l_I = parseVector(v); });
  options.value("extrinsics-rotation-xyzw", "X,Y,Z,W",
                "rotation that turns radar axes (right, forward, up) into the IMU's (T_IR)",
                "0.69946,0.71461,0.00723,0.00524", [&r](const std::string& v) {
                  const std::vector<double> n = parseNumbers(v, 4);
                  const Eigen::Quaterniond q(n[3], n[0], n[1], n[2]);
                  if (std::abs(q.norm() - 1.0) > 0.01)
                    throw UsageError("'" + v + "' is not a unit quaternion");
                  r.setup.T_IR.q_IR = q.normalized();
                });
  options.number("radar-rate", "HZ", "scans a second", radar.rate, NumberRange::kPositive);
  options.number("first-trigger", "S", "time of the first trigger, from the start of the bag",
                 radar.first_trigger);
  options.number("frame-length", "S",
                 "the Doppler is the mean over this time around the measurement; 0 = an instant",
                 radar.frame_length);
  options.number("latency", "S", "time from stamp to arrival (record time) of a scan", radar.latency);
  options.number("latency-sigma", "S", "sigma of the latency", radar.latency_sigma);
  options.number("points", "N", "mean number of points a scan", radar.points_mean, NumberRange::kPositive);
  options.number("points-sigma", "N", "sigma of that number", radar.points_sigma);
  options.count("points-min", "fewest points a scan; 0 allows empty scans", radar.points_min, 0);
  options.count("points-max", "most points a scan", radar.points_max);
  options.flag("skip-empty", "scans without points are not published", radar.publish_empty, false);
  options.number("min-range", "M", "nearest point", radar.min_range);
  options.number("max-range", "M", "farthest point", radar.max_range, NumberRange::kPositive);
  options.number("fov-azimuth-deg", "DEG", "half angle of view", radar.fov_azimuth, NumberRange::kPositive);
  options.value(
      "fov-elevation-deg", "DEG", "half angle of view",
      shortText(radar.fov_elevation, 10) + "; " + shortText(kFlatFovElevation, 10) + " with --no-elevation",
      [&r](const std::string& v) { r.fov_elevation = parseNumber(v, NumberRange::kPositive); });
  options.flag("no-elevation",
               "a flat radar: sees what is within --fov-elevation-deg, reports it in its own plane, z = 0",
               radar.measures_elevation, false);
  options.number("range-noise", "M", "sigma", radar.range_noise);
  options.number("azimuth-noise-deg", "DEG", "sigma", radar.azimuth_noise);
  options.number("elevation-noise-deg", "DEG", "sigma", radar.elevation_noise);
  options.number("doppler-noise", "M/S", "sigma, before quantisation", radar.doppler_noise);
  options.number("doppler-step", "M/S", "quantisation; 0 = none", radar.doppler_step);
  options.number("doppler-span", "M/S",
                 "whole unambiguous span, a whole number of steps: 3 wraps into [-1.5, 1.5); 0 = unlimited",
                 radar.doppler_span);
  options.number("ghosts", "SHARE", "share of the points that are ghosts: anywhere, any Doppler",
                 radar.ghost_share, NumberRange::kShare);
  options.number("ambiguous", "SHARE",
                 "share of the points that the radar reports at a second direction, too: same range, Doppler "
                 "and SNR",
                 radar.ambiguous_share, NumberRange::kShare);
  options.number("moving", "SHARE", "share of the time in which persons walk through the view",
                 radar.moving_share, NumberRange::kShare);
  options.count("crowd", "number of persons at once; their points replace those of the room", radar.crowd);
  options.number("dropouts", "SHARE", "share of the scans that are triggered but never delivered",
                 radar.dropout_share, NumberRange::kShare);
  options.values("blackout", "S,S", "START,DURATION without scans; may be repeated",
                 [&radar](const std::string& v) { radar.blackouts.push_back(parseInterval(v)); });
  options.values("ghost-burst", "S,S", "START,DURATION in which all points are ghosts; may be repeated",
                 [&radar](const std::string& v) { radar.ghost_bursts.push_back(parseInterval(v)); });
}

/// The name of a radar, and the options that its text gives.
std::pair<std::string, OptionSet::Given> parseRadar(const std::string& text) {
  std::istringstream in(text);
  std::string name;
  in >> name;
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back("--" + word);
  RadarRequest checked;
  OptionSet options("");
  addRadarOptions(options, checked);
  try {
    const OptionSet::Given given = options.parse(words);
    options.set({given});
    return {name, given};
  } catch (const UsageError& error) {
    throw UsageError(name + ": " + error.what());
  }
}

void addNamedRadars(OptionSet& options, Request& r) {
  options.section("Several radars");
  options.values(
      "radar", "TEXT",
      "\"NAME KEY=VALUE ...\", NAME of a-z, 0-9, _: a radar, in the place of the nameless; may be repeated",
      [&r](const std::string& v) {
        const auto [name, given] = parseRadar(v);
        if (!r.radars.emplace(name, given).second)
          throw UsageError("there are two radars of the name '" + name + "'");
      });
}

/// `preset` with what is given; the first source that gives an option counts.
RadarSetup setupOf(const RadarSetup& preset, const std::vector<OptionSet::Given>& sources) {
  RadarRequest radar{preset};
  OptionSet options("");
  addRadarOptions(options, radar);
  options.set(sources);
  if (radar.fov_elevation) {
    radar.setup.radar.fov_elevation = *radar.fov_elevation;
  } else if (!radar.setup.radar.measures_elevation) {
    radar.setup.radar.fov_elevation = kFlatFovElevation;
  }
  return radar.setup;
}

/// Sets all that the command line gives.
void setAll(const OptionSet& options, const OptionSet::Given& given, Request& request) {
  // A preset says what the others are to change, so it comes first.
  OptionSet preset("");
  preset.value("preset", "NAME", "", "", [&request](const std::string& name) {
    request.preset = presetOf(name);
    request.rest = request.preset.rest;
    request.simulation = request.preset.options;
  });
  preset.set({given});
  options.set({given});
  SimulationOptions& simulation = request.simulation;
  RadarSetup& one = simulation;
  const RadarSetup common = one;
  one = setupOf(common, {given});
  for (const auto& [name, own] : request.radars) simulation.radars.emplace(name, common);
  for (auto& [name, setup] : simulation.radars) {
    const auto own = request.radars.find(name);
    setup = own == request.radars.end() ? setupOf(setup, {given}) : setupOf(setup, {own->second, given});
  }
  if (request.noise_free) {
    simulation.imu.removeErrors();
    simulation.barometer.removeErrors();
    simulation.radar.removeErrors();
    for (auto& [name, setup] : simulation.radars) setup.radar.removeErrors();
  }
}

ProgramText programText() {
  std::ostringstream notes;
  notes << "Defaults are in brackets. Noise is that of an ADIS16448 and a TI IWR6843AOP, measured on a real "
           "bag. Angles are\nin radians, unless the name of the option says deg.\n"
           "\n--radar: KEY is an option of the two sections on time offset and radar, without dashes; a flag "
           "stands alone.\nOptions that a radar leaves out come from outside of --radar. Each has its own "
           "reflectors, persons and ghosts.\n--preset kart_pair has left and right: --radar changes one of "
           "them, or adds another.\n"
           "Topics, irs:       /sensor_platform/radar_NAME/scan, /sensor_platform/radar_NAME/trigger\n"
           "Topics, ti_mmwave: /ti_mmwave/radar_scan_pcl_NAME, /sensor_platform/radar_NAME/trigger\n"
           "\nMotions (duration with rest)\n";
  for (const MotionDescription& motion : builtInMotions()) {
    notes << "  " << std::left << std::setw(18) << motion.name << motion.summary << " ("
          << motion.default_duration << " s)\n";
  }
  notes << "\nPresets (motion)\n";
  for (const Preset& preset : presets()) {
    notes << "  " << std::left << std::setw(18) << preset.name << preset.summary << " (" << preset.motion
          << ")\n";
  }
  return {"simulate", "(--motion NAME | --trajectory FILE.txt | --preset NAME) --out FILE.bag [options]\n",
          "Writes a bag of a simulated IMU and radar whose motion and time offset are known.",
          "rosrun rio_t simulate --motion difficult --time-offset 0.03 --seed 1 --out sim.bag\n"
          "rosrun rio_t simulate --preset kart --out kart.bag --ground-truth truth.txt\n"
          "rosrun rio_t simulate --preset kart_pair --radar \"left time-offset=0.03\" --out pair.bag\n",
          notes.str()};
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
    throw UsageError("exactly one of --motion and --trajectory is needed, or a --preset");
  }
  if (request.out.empty()) throw UsageError("--out: the bag to write is not given");
  if (!request.trajectory.empty()) {
    if (request.speed) {
      throw UsageError(
          "--speed: only the motions constant_speed and walk can be given one, a trajectory has its own");
    }
    try {
      return motionFromFile(request);
    } catch (const std::invalid_argument& error) {
      throw UsageError("--trajectory " + request.trajectory + ": " + error.what());
    }
  }
  const double duration = preset && request.duration == 0.0 ? request.preset.duration : request.duration;
  return makeMotion({name, request.simulation.seed, duration, request.rest, request.speed});
}

std::string triple(const Eigen::Vector3d& v) { return fixedTexts(v, 5, " "); }

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
              << motion.path().rotationResidual() / kDegree << " deg (rms) from it\n";
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
    throw UsageError("--pressure-shock needs --barometer");
  if (isSameFile(request.ground_truth, request.out))
    throw UsageError("--ground-truth " + request.ground_truth + ": expected another file than that of --out");
  for (const auto& [name, file] :
       {std::make_pair("--out ", request.out), std::make_pair("--ground-truth ", request.ground_truth)}) {
    if (file.empty()) continue;
    const std::string fault = faultOfOutput(file, {request.trajectory});
    if (!fault.empty()) throw UsageError(name + fault);
  }
  constexpr double kLastStamp = 4294967295.0;  // [s] ROS counts them in 32 bits
  if (request.start_time > kLastStamp)
    throw UsageError("--start-time " + std::to_string(request.start_time) +
                     ": expected at most 4294967295, the last stamp of ROS");
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
  Request request;
  RadarRequest radar;  // for the defaults that --help shows; setAll() sets the radars themselves
  OptionSet options("What moves, and where it goes");
  addGeneralOptions(options, request);
  addImuOptions(options, request.simulation.imu);
  addBarometerOptions(options, request.simulation.barometer);
  addNamedRadars(options, request);
  addRadarOptions(options, radar);
  return runProgramWith(programText(), options, {argv + 1, argv + argc}, std::cout, std::cerr,
                        [&](const OptionSet::Given& given) {
                          setAll(options, given, request);
                          run(request);
                          return kExitOk;
                        });
}
