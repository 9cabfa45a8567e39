#include "simulate_options.h"

#include <cmath>
#include <cstdint>
#include <sstream>
#include <utility>
#include <vector>

#include "../ros/text.h"

namespace rio_t::simulation {
namespace {

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
                "none", [](const std::string& /*name*/) {});  // read() applies it
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
                 "with --trajectory: faster motion than this is taken for noise of the poses", r.smoothing,
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

/// Returns the name of a radar, and the options in its text.
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

/// Returns `preset` with what is given. If several sources give an option, the first counts.
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

}  // namespace

CommandLine::CommandLine() : options_("What moves, and where it goes") {
  addGeneralOptions(options_, request_);
  addImuOptions(options_, request_.simulation.imu);
  addBarometerOptions(options_, request_.simulation.barometer);
  addNamedRadars(options_, request_);
  addRadarOptions(options_, radar_);
}

const Request& CommandLine::read(const OptionSet::Given& given) {
  // The preset comes first, since the other options change it.
  OptionSet preset("");
  preset.value("preset", "NAME", "", "", [this](const std::string& name) {
    request_.preset = presetOf(name);
    request_.rest = request_.preset.rest;
    request_.simulation = request_.preset.options;
  });
  preset.set({given});
  options_.set({given});
  SimulationOptions& simulation = request_.simulation;
  RadarSetup& one = simulation;
  const RadarSetup common = one;
  one = setupOf(common, {given});
  for (const auto& [name, own] : request_.radars) simulation.radars.emplace(name, common);
  for (auto& [name, setup] : simulation.radars) {
    const auto own = request_.radars.find(name);
    setup = own == request_.radars.end() ? setupOf(setup, {given}) : setupOf(setup, {own->second, given});
  }
  if (request_.noise_free) {
    simulation.imu.removeErrors();
    simulation.barometer.removeErrors();
    simulation.radar.removeErrors();
    for (auto& [name, setup] : simulation.radars) setup.radar.removeErrors();
  }
  return request_;
}

}  // namespace rio_t::simulation
